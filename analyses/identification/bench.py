"""From bench records to a design that may be written: inputs, joint fit, refinement, verdicts."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design import read_design_text, with_values, write_design
from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.model import Design, Tolerance
from actuator_lti.design.writing import by_its_own_numbers
from actuator_lti.errors import InputError
from actuator_lti.types import Progress
from analyses.correlation.driving import command_of
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import UNSTATED, own_std, parameter
from analyses.identification import to_design, verdict
from analyses.identification.asked import Settings, fixed_values
from analyses.identification.design_values import (
    DesignValue,
    at_constant,
    design_values,
    with_found_constant,
    with_given_constant,
)
from analyses.identification.diagnosis import Diagnosed, without_flat_tops
from analyses.identification.electrical import ElectricalFit
from analyses.identification.inverse import held_out_residual
from analyses.identification.joint_model import JointModel, LawChoice
from analyses.identification.motor_and_motion import Sought, names_of
from analyses.identification.output_error import OutputErrorResult, Resimulated, refine_records, resimulate
from analyses.identification.residuals import ResidualTest, residual_tests
from analyses.identification.rows import is_loaded, recipe_for, stands
from analyses.identification.run_down import runs_down, switched_off
from analyses.records.consistency import check_record
from analyses.records.finding import Finding, because
from analyses.records.inputs import InputUse, account
from analyses.records.record import HELD, Record, prepared

HELD_OUT_FACTOR = 1.5
HELD_OUT_EXTRA = 0.02


@dataclass(frozen=True, kw_only=True)
class BenchResult(verdict.Identified):
    """Everything that the records told: the fit, the design that would be written, and whether it may be."""

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    findings: Mapping[str, tuple[Finding, ...]]
    model: JointModel
    # whiteness of each record's residual, and its independence of the inputs
    residual_tests: tuple[ResidualTest, ...]
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
        own = {} if self.electrical is None else {"voltage": "voltage equation: R, kE, L"}
        return {record.name: account(record, {**own, **part.used}) for part, record in pairs}


def identify_bench(
    design: Design,
    records: Sequence[Record],
    *,
    validation: Sequence[Record] = (),
    settings: Settings | None = None,
    progress: Progress = None,
) -> BenchResult:
    """Identify a drive from records of its motion, and hold the design that comes of it against them.

    Raises `InputError`: if a record lacks a signal, a key cannot be fixed, or no design comes of the result.
    """
    settings = Settings() if settings is None else settings
    limit = settings.residual_limit / 100.0
    used, unseen = (tuple(prepared(record) for record in these) for these in (records, validation))
    plain = replace(with_values(design, fixed_values(design, settings.fix)), nominal=design)
    usual = settings.cutoff_hz is None and settings.decimation is None
    recipe = None if usual else recipe_for(used[0], settings.cutoff_hz, settings.decimation)
    sought = Sought(design, plain, settings, recipe)
    findings = {record.name: check_record(plain, record) for record in (*used, *unseen)}
    with because(findings):
        used, unseen = (tuple(switched_off(plain, one) for one in these) for these in (used, unseen))
        if settings.electrical:
            judged = _judged(plain, sought.by_voltage(used)[0])
            findings = {record.name: check_record(judged, record) for record in (*used, *unseen)}
        if all(stands(plain, record, recipe) for record in used):
            still = "no motion beyond noise: inertia and friction take a record that moves"
            raise InputError(f"{still}; of a motor held fast --electrical tells R and L", names_of(used))
    with because(findings):
        found = sought.motor_and_motion(used)
    start, electrical, right = found.start, found.electrical, found.right
    if HELD in {record.between for record in right.records}:
        judged = _judged(plain, start) if settings.electrical else plain
        held = (replace(record, between=HELD) for record in (*used, *unseen))
        findings = {record.name: check_record(judged, record) for record in held}
    compared = design_values(design, right.model, right.records, start)
    if electrical is None:
        model, both = with_given_constant(start, right.model, right.records, compared), None
    else:
        model, both = with_found_constant(start, right.model, right.records, electrical)
    whole = [without_flat_tops(start, record, recipe) for record in unseen]
    more = {**right.findings, **{record.name: tuple(clipped) for record, clipped in whole}}
    findings = {name: (*each, *more[name]) for name, each in findings.items()}
    right, unseen = replace(right, model=model), tuple(record for record, _ in whole)
    tests = residual_tests(model)
    items = list(_items(sought, findings, right, compared, tests))
    made, refined, unmade = _made(start, right, both, settings, items, progress)
    every = () if unmade else (*right.records, *unseen)
    again = tuple(resimulate(made, record, model.form) for record in every)
    items += verdict.made_items(unmade, design, made)
    allowed = min(HELD_OUT_FACTOR * model.relative_residual + HELD_OUT_EXTRA, limit)
    for record in unseen:
        if not runs_down(start, record):  # others have no torque
            label = f"Relative residual of {record.name}, not seen by the fit"
            residual, why = held_out_residual(start, model, record), "the fit does not carry over to it"
            items.append(verdict.share_item(f"held-out-{record.name}", label, residual, allowed, why))
    items += [verdict.simulated_item(one.record, one.beyond_noise, limit, one.how) for one in again]
    return BenchResult(
        records=right.records,
        validation=unseen,
        findings=findings,
        model=model,
        residual_tests=tests,
        refined=refined,
        design=by_its_own_numbers(made),
        unmade=unmade,
        resimulated=again,
        items=tuple(items),
        settings=settings,
        design_values=compared,
        laws=model.laws,
        electrical=electrical,
    )


def _judged(plain: Design, start: Design) -> Design:
    """The design that records are held against: its own, its kE as doubtful as what was found is off."""
    key, motor = parameter("back_emf").key, start.motor
    found, parameters = start.parameters[key], dict(plain.parameters)
    own = plain.motor.back_emf_constant_Vs_rad
    if own is not None and motor.back_emf_constant_Vs_rad is not None:
        off = float(np.hypot(own_std(plain, key) or UNSTATED * own, motor.back_emf_constant_Vs_rad - own))
        parameters[key] = replace(found, value=own, tolerance=Tolerance(kind="normal", std=off))
        motor = replace(motor, back_emf_constant_Vs_rad=own)
    motor = replace(motor, resistance_ohm=plain.motor.resistance_ohm)
    return replace(start, motor=motor, parameters=FrozenMap(parameters))


def _made(
    start: Design,
    right: Diagnosed,
    both: Fit | None,
    settings: Settings,
    items: Sequence[verdict.Item],
    progress: Progress,
) -> tuple[Design, OutputErrorResult | None, str]:
    """The design with what was found, as its file gives it, and the refinement where one was asked for.

    Where none comes of a record that fails anyway, that of the start, and why.
    """
    model, records = right.model, right.records
    source = f"identified from {names_of(records)}{at_constant(model, start)}"
    try:
        values = to_design.joint_values(start, model, inertia_to=settings.inertia_to)
        made = to_design.design_with_fit(to_design.with_structure(start, model), values, source)
        if both is not None:
            both = to_design.joint_values(start, both, inertia_to=settings.inertia_to)
            made = to_design.with_correlations(made, both)
    except InputError as error:
        if all(item.passed is not False for item in items):
            raise
        return start, None, error.message
    for record in records:
        for key in record.settings.keys() & set(values.names):
            why = f"is found from all records; allowed: any other key, or --fix {key}=VALUE"
            raise InputError(f"settings.{key}: {why}", where=record.name)
    refined = None
    if settings.refine:
        refined = refine_records(made, records, values.names, progress=progress)
        if both is not None:  # its values are those at the constants that the voltage tells
            both = both.refined(refined)
            own = both.renamed({name: name for name in refined.names})
            refined = replace(refined, covariance=own.covariance)
        made = to_design.design_with_fit(made, refined, f"{source}, refined by simulation")
        made = made if both is None else to_design.with_correlations(made, both)
    return read_design_text(write_design(made)), refined, ""


def _items(
    sought: Sought,
    findings: Mapping[str, tuple[Finding, ...]],
    right: Diagnosed,
    compared: Sequence[DesignValue],
    tests: Sequence[ResidualTest],
) -> Iterator[verdict.Item]:
    """What must hold before a design is made, and what is kept of the old one."""
    model, records, design, settings = right.model, right.records, sought.design, sought.settings
    for name, result in findings.items():
        yield verdict.inputs_item(name, result)
    for name, one in right.followed.items():  # before what comes of it
        yield verdict.following_item(name, one)
    loaded = any(is_loaded(record) for record in records)
    yield verdict.size_item(design, compared, kept_constants=not settings.electrical, loaded=loaded)
    rows, least = model.rows_used, verdict.ROWS_EACH * len(model.names)
    why = f"{rows} rows for {len(model.names)} parameters, {least} wanted: take a longer record"
    yield verdict.Item.of("rows", "Rows enough for the parameters", "" if rows >= least else why)
    yield verdict.residual_item(model.relative_residual, settings.residual_limit / 100.0)
    commanded = all(command_of(design, record) is not None for record in records)
    late = right.late_s > max(record.period_s for record in records)
    feigned = verdict.feigned_law(late=late, reversals=not (commanded and model.simulated))
    yield from verdict.law_items(right.bend, model, design.axis, feigned)
    yield from verdict.independence_items(tests)
    yield from verdict.noise_items(model)
    yield from verdict.offset_items(design, model)
    yield from verdict.kept_items(model, sought.held, design.axis)
    yield from verdict.lag_items(right.late_s, late)
    yield from verdict.phase_items(design, model, records)
    for record in records:
        yield from verdict.sampling_items(record)
