"""From bench records to a design that may be written: inputs, joint fit, refinement, verdicts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from actuator_lti.design import read_design_text, write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.correlation.driving import command_of
from analyses.estimation.parameters import parameter
from analyses.identification.asked import Settings, fixed_values, held_by_name
from analyses.identification.design_values import DesignValue, design_values
from analyses.identification.diagnosis import diagnosed
from analyses.identification.drive_constant import given_constant, with_given_constant
from analyses.identification.electrical import ElectricalFit, electrical_values, fit_electrical
from analyses.identification.friction_map import LawChoice, fit_map
from analyses.identification.inverse import fit_records, held_out_residual
from analyses.identification.joint_model import NAMES, JointModel, Recipe
from analyses.identification.output_error import OutputErrorResult
from analyses.identification.own_bias import without_bias
from analyses.identification.residuals import ResidualTest, residual_tests
from analyses.identification.resimulation import Resimulated, refine_records, resimulate
from analyses.identification.rows import is_loaded, recipe_for
from analyses.identification.to_design import (
    INERTIAS,
    design_with_fit,
    joint_values,
    with_fixed,
    with_structure,
)
from analyses.identification.verdict import (
    Identified,
    Item,
    following_item,
    held_out_item,
    inputs_item,
    kept_items,
    offset_item,
    residual_item,
    rows_item,
    sampling_item,
    simulated_item,
    size_item,
)
from analyses.records.consistency import Finding, check_record
from analyses.records.inputs import InputUse, account
from analyses.records.record import Record, prepared


@dataclass(frozen=True, kw_only=True)
class BenchResult(Identified):
    """Everything that the records told: the fit, the design that would be written, and whether it may be."""

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    findings: Mapping[str, tuple[Finding, ...]]
    model: JointModel
    refined: OutputErrorResult | None
    resimulated: tuple[Resimulated, ...]
    settings: Settings
    design_values: tuple[DesignValue, ...] = ()
    laws: tuple[LawChoice, ...] = ()
    electrical: ElectricalFit | None = None

    @property
    def inputs(self) -> dict[str, tuple[InputUse, ...]]:
        """The columns of each record, and what each was used for."""
        pairs = zip(self.model.records, self.records, strict=True)
        return {record.name: account(record, part.used) for part, record in pairs}

    @cached_property
    def residual_tests(self) -> tuple[ResidualTest, ...]:
        """Whiteness of each record's residual, and its independence of the inputs."""
        return residual_tests(self.model)


def identify_bench(
    design: Design,
    records: Sequence[Record],
    *,
    validation: Sequence[Record] = (),
    settings: Settings | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> BenchResult:
    """Identify a drive from records of its motion, and hold the design that comes of it against them.

    Raises
    ------
    InputError
        If a record lacks a signal, a key cannot be fixed, or no design can be made of the result.
    """
    settings = Settings() if settings is None else settings
    fixed, limit = fixed_values(design, settings.fix), settings.residual_limit / 100.0
    used = tuple(prepared(record) for record in records)
    unseen = tuple(prepared(record) for record in validation)
    start, electrical = with_fixed(design, fixed), None
    if settings.electrical:
        electrical = fit_electrical(start, used)
        told = f"voltage equation of {', '.join(record.name for record in records)}"
        start = design_with_fit(start, electrical_values(start, electrical), told)
    judged = replace(start, motor=replace(start.motor, resistance_ohm=design.motor.resistance_ohm))
    findings = {record.name: check_record(judged, record) for record in (*used, *unseen)}
    laws: tuple[LawChoice, ...] = ()

    def fit(records: Sequence[Record]) -> tuple[JointModel, tuple[Record, ...]]:
        nonlocal laws
        model, laws = _fitted(start, records, settings, fixed)
        return _unbiased(start, _with_commands(start, model, records), records, settings)

    recipe = _recipe(used[0], settings)
    right = diagnosed(design, start, used, fit, recipe)
    used = right.records
    model = right.model if electrical else with_given_constant(start, right.model, used, recipe)
    findings |= {name: (*findings[name], *more) for name, more in right.findings.items()}
    source = f"identified from {', '.join(record.name for record in records)}"
    given = given_constant(model)
    if given is not None:
        source += f" at {parameter(given).key} = {model[given]:g} {parameter(given).unit}"
    sampled = tuple(item for record in used if (item := sampling_item(record)) is not None)
    lags = [following_item(name, one) for name, one in right.followed.items()]
    compared = design_values(design, model, used, start)
    size = size_item(
        design, compared, kept_constants=electrical is None, loaded=any(is_loaded(record) for record in used)
    )
    kept = kept_items(model, _held(start, fixed, settings.friction), design.axis)
    offset = [item for item in (offset_item(design, model),) if item is not None]
    items = (*_fit_items(findings, size, model, limit), *offset, *kept, *sampled, *lags)
    try:
        values = joint_values(start, model, inertia_to=settings.inertia_to)
        _refuse_settings(used, values.names)
        made = design_with_fit(with_structure(start, model), values, source)
    except InputError as error:
        reasons = "; ".join(item.reason for item in items if item.passed is False)
        raise InputError(f"{error.message} ({reasons})" if reasons else error.message, error.where) from None
    refined = None
    if settings.refine:
        refined = refine_records(made, used, values.names, progress=progress)
        made = design_with_fit(made, refined, f"{source}, refined by simulation")
    text = write_design(made)
    again = resimulate(read_design_text(text), (*used, *unseen), model.form)
    return BenchResult(
        records=used,
        validation=unseen,
        findings=findings,
        model=model,
        refined=refined,
        design=made,
        text=text,
        resimulated=again,
        items=(
            *items,
            *_held_out(start, model, unseen, limit),
            *(simulated_item(one.record, one.relative_error, limit, one.how) for one in again),
        ),
        settings=settings,
        design_values=compared,
        laws=laws,
        electrical=electrical,
    )


def _refuse_settings(records: Sequence[Record], looked_for: Sequence[str]) -> None:
    """Refuse a record's own setting of what is found from all of them."""
    for record in records:
        for key in record.settings.keys() & set(looked_for):
            told = f"settings.{key}: is found from all records; allowed: any other key, or --fix {key}=VALUE"
            raise InputError(told, where=record.name)


def _fitted(
    start: Design, used: Sequence[Record], settings: Settings, asked: Mapping[str, float]
) -> tuple[JointModel, tuple[LawChoice, ...]]:
    """The joint model, and the friction laws that were tried."""
    recipe, fixed = _recipe(used[0], settings), _held(start, asked, settings.friction)
    gravity = settings.gravity or start.load.gravity is not None
    if settings.friction == "map":
        fit = fit_map(start, used, recipe=recipe, fixed=fixed, gravity=gravity)
        return fit.model, fit.laws
    model = fit_records(start, used, form=settings.friction, recipe=recipe, fixed=fixed, gravity=gravity)
    return model, ()


def _with_commands(start: Design, model: JointModel, used: Sequence[Record]) -> JointModel:
    """The model whose records say what their command is used for."""
    parts = []
    for part, record in zip(model.records, used, strict=True):
        command = command_of(start, record)
        more = {} if command is None else {command.signal: "command of the simulated drive"}
        parts.append(replace(part, used={**more, **part.used}))
    return replace(model, records=tuple(parts))


def _unbiased(
    start: Design, model: JointModel, used: Sequence[Record], settings: Settings
) -> tuple[JointModel, tuple[Record, ...]]:
    """The model less its own bias, where a design can be made of it and simulated; the simulated records."""

    def make(model: JointModel) -> Design:
        values = joint_values(start, model, inertia_to=settings.inertia_to)
        return design_with_fit(with_structure(start, model), values, "")

    return without_bias(start, make, model, used, _recipe(used[0], settings))


def _recipe(record: Record, settings: Settings) -> Recipe | None:
    if settings.cutoff_hz is None and settings.decimation is None:
        return None
    return recipe_for(record, settings.cutoff_hz, settings.decimation)


def _held(design: Design, asked: Mapping[str, float], form: str) -> dict[str, float]:
    """Fixed keys by the model's names; a fixed rotor or load inertia fixes the whole."""
    names = (*NAMES["per-direction" if form == "per-direction" else "symmetric"], "load_coefficient")
    held = held_by_name(asked, names, dict.fromkeys(INERTIAS, "inertia"))
    return held | ({"inertia": design.inertia_kgm2} if "inertia" in held else {})


def _fit_items(
    findings: Mapping[str, tuple[Finding, ...]], size: Item, model: JointModel, limit: float
) -> tuple[Item, ...]:
    return (
        *(inputs_item(name, result) for name, result in findings.items()),
        size,
        rows_item(model.rows_used, len(model.names)),
        residual_item(model.relative_residual, limit),
    )


def _held_out(start: Design, model: JointModel, unseen: Sequence[Record], limit: float) -> tuple[Item, ...]:
    fit = model.relative_residual
    return tuple(
        held_out_item(record.name, held_out_residual(start, model, record), fit, limit) for record in unseen
    )
