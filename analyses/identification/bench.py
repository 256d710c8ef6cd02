"""From bench records to a design that may be written: inputs, joint fit, refinement, verdicts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

from actuator_lti.design import read_design_text, with_values, write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.correlation.driving import command_of
from analyses.estimation.fit import Fit
from analyses.identification import verdict
from analyses.identification.asked import Settings, fixed_values, held_by_name
from analyses.identification.design_values import (
    DesignValue,
    at_constant,
    design_values,
    with_found_constant,
    with_given_constant,
)
from analyses.identification.diagnosis import Diagnosed, diagnosed, without_flat_tops
from analyses.identification.electrical import ElectricalFit, electrical_values, fit_electrical
from analyses.identification.friction_map import fit_map
from analyses.identification.inverse import fit_records, held_out_residual
from analyses.identification.joint_model import NAMES, FrictionForm, JointModel, LawChoice, Recipe
from analyses.identification.output_error import OutputErrorResult, Resimulated, refine_records, resimulate
from analyses.identification.own_bias import without_bias
from analyses.identification.residuals import ResidualTest, residual_tests
from analyses.identification.rows import is_loaded, recipe_for
from analyses.identification.to_design import (
    INERTIAS,
    design_with_fit,
    joint_values,
    with_correlations,
    with_structure,
)
from analyses.records.consistency import Finding, because, check_record
from analyses.records.inputs import InputUse, account
from analyses.records.record import Record, prepared

HELD_OUT_FACTOR = 1.5
HELD_OUT_EXTRA = 0.02


@dataclass(frozen=True, kw_only=True)
class BenchResult(verdict.Identified):
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
    used, unseen = (tuple(prepared(record) for record in these) for these in (records, validation))
    names = ", ".join(record.name for record in records)
    start = plain = with_values(design, fixed_values(design, settings.fix))
    electrical, told = None, f"voltage equation of {names}"
    both: Fit | None = None
    cutoff, decimation = settings.cutoff_hz, settings.decimation
    usual = cutoff is None and decimation is None
    recipe = None if usual else recipe_for(used[0], cutoff, decimation)
    findings = {record.name: check_record(start, record) for record in (*used, *unseen)}
    if settings.electrical:
        with because(findings):
            electrical = fit_electrical(plain, used, recipe)
            start = design_with_fit(plain, electrical_values(plain, electrical), told)
        judged = replace(start, motor=replace(start.motor, resistance_ohm=design.motor.resistance_ohm))
        findings = {record.name: check_record(judged, record) for record in (*used, *unseen)}
    limit = settings.residual_limit / 100.0
    held = _held(design, start, settings)
    with because(findings):
        right = diagnosed(design, start, used, partial(_fitted, start, settings, held, recipe), recipe)
    if electrical is not None and "inductance" in electrical.names:
        electrical = fit_electrical(plain, used, recipe, right.late_s)
        start = design_with_fit(plain, electrical_values(plain, electrical), told)
    used, model = right.records, right.model
    compared = design_values(design, model, used, start)  # at the constant that made the torques
    if electrical is None:
        model = with_given_constant(start, model, used, compared)
    else:
        model, both = with_found_constant(start, model, used, electrical_values(start, electrical))
    others = [without_flat_tops(start, record, recipe) for record in unseen]
    unseen = tuple(record for record, _ in others)
    told_of = {**right.findings, **{record.name: tuple(clipped) for record, clipped in others}}
    findings |= {name: (*findings[name], *more) for name, more in told_of.items()}
    source = f"identified from {names}{at_constant(model)}"
    loaded = any(is_loaded(record) for record in used)
    size = verdict.size_item(design, compared, kept_constants=electrical is None, loaded=loaded)
    items = list(_items(design, findings, size, right, model, held, limit))
    try:
        values = joint_values(start, model, inertia_to=settings.inertia_to)
        for record in used:
            for key in record.settings.keys() & set(values.names):
                told = f"is found from all records; allowed: any other key, or --fix {key}=VALUE"
                raise InputError(f"settings.{key}: {told}", where=record.name)
        made = design_with_fit(with_structure(start, model), values, source)
        if both is not None:
            both = joint_values(start, both, inertia_to=settings.inertia_to)
            made = with_correlations(made, both)
    except InputError as error:
        reasons = "; ".join(item.reason for item in items if item.passed is False)
        raise InputError(f"{error.message} ({reasons})" if reasons else error.message, error.where) from None
    refined = None
    if settings.refine:
        refined = refine_records(made, used, values.names, progress=progress)
        if both is not None:  # its values are those at the constants that the voltage tells
            both = both.refined(refined)
            own = both.renamed({name: name for name in refined.names})
            refined = replace(refined, covariance=own.covariance)
        made = design_with_fit(made, refined, f"{source}, refined by simulation")
        made = made if both is None else with_correlations(made, both)
    written = read_design_text(write_design(made))
    again = tuple(resimulate(written, record, model.form) for record in (*used, *unseen))
    allowed = min(HELD_OUT_FACTOR * model.relative_residual + HELD_OUT_EXTRA, limit)
    for record in unseen:
        label = f"Relative residual of {record.name}, not seen by the fit"
        residual, why = held_out_residual(start, model, record), "the fit does not carry over to it"
        items.append(verdict.share_item(f"held-out-{record.name}", label, residual, allowed, why))
    items += [verdict.simulated_item(one.record, one.relative_error, limit, one.how) for one in again]
    return BenchResult(
        records=used,
        validation=unseen,
        findings=findings,
        model=model,
        refined=refined,
        design=written,
        resimulated=again,
        items=tuple(items),
        settings=settings,
        design_values=compared,
        laws=model.laws,
        electrical=electrical,
    )


def _held(design: Design, start: Design, settings: Settings) -> dict[str, float]:
    """What is held, by the names of the model; a fixed rotor or load inertia fixes the whole."""
    form: FrictionForm = "symmetric" if settings.friction == "map" else settings.friction
    names = (*NAMES[form], "load_coefficient")
    held = held_by_name(fixed_values(design, settings.fix), names, dict.fromkeys(INERTIAS, "inertia"))
    return held | {"inertia": start.inertia_kgm2} if "inertia" in held else held


def _fitted(
    start: Design,
    settings: Settings,
    held: Mapping[str, float],
    recipe: Recipe | None,
    records: Sequence[Record],
) -> JointModel:
    """The joint model as the settings ask, less its own bias."""
    gravity = settings.gravity or start.load.gravity is not None
    if settings.friction == "map":
        model = fit_map(start, records, recipe=recipe, fixed=held, gravity=gravity)
    else:
        form = settings.friction
        model = fit_records(start, records, form=form, recipe=recipe, fixed=held, gravity=gravity)
    parts = []
    for part, record in zip(model.records, records, strict=True):
        command = command_of(start, record)
        more = {} if command is None else {command.signal: "command of the simulated drive"}
        parts.append(replace(part, used={**more, **part.used}))

    def made(model: JointModel) -> Design:
        values = joint_values(start, model, inertia_to=settings.inertia_to)
        return design_with_fit(with_structure(start, model), values, "")

    return without_bias(start, made, replace(model, records=tuple(parts)), records)


def _items(
    design: Design,
    findings: Mapping[str, tuple[Finding, ...]],
    size: verdict.Item,
    right: Diagnosed,
    model: JointModel,
    held: Mapping[str, float],
    limit: float,
) -> Iterator[verdict.Item]:
    """What must hold before a design is made, and what is kept of the old one."""
    for name, result in findings.items():
        yield verdict.inputs_item(name, result)
    yield size
    rows, least = model.rows_used, verdict.ROWS_EACH * len(model.names)
    why = f"{rows} rows for {len(model.names)} parameters, {least} wanted: take a longer record"
    yield verdict.Item.of("rows", "Rows enough for the parameters", "" if rows >= least else why)
    yield verdict.residual_item(model.relative_residual, limit)
    yield from verdict.offset_items(design, model)
    yield from verdict.kept_items(model, held, design.axis)
    yield from verdict.lag_items(right.late_s, max(record.period_s for record in right.records))
    for record in right.records:
        yield from verdict.sampling_items(record)
    for name, one in right.followed.items():
        yield verdict.following_item(name, one)
