"""From a campaign to coefficients: import, steady parts, surface, the question of a richer law."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.identification.design_values import DesignValue, design_value
from analyses.identification.richer import RicherLaws, compare_laws
from analyses.identification.steady import SteadyCriterion, SteadyPoint, steady_points
from analyses.identification.surface import NAMES, SurfaceFit, fit_surface
from analyses.identification.verdict import Item, residual_item, simulated_item, size_item
from analyses.records.campaign_file import Instruments
from analyses.records.campaign_import import ImportedCampaign, ImportedRun, SetAside
from analyses.records.consistency import Finding, check_record
from analyses.records.factors import named_factor
from analyses.records.inputs import InputUse

RUN_UP_S = 0.3
STEADY_S = 0.2
SPEED_REACHED = 0.01
MOST_CAMPAIGN_TICKS = 200_000
SPEED_TOLERANCE = 0.05
LOAD_TOLERANCE = 0.10


@dataclass(frozen=True, kw_only=True)
class CampaignResult:
    """Everything that a campaign told: the fit, the runs behind it, and those set aside with their reasons.

    ``runs_listed == len(fit.points) + len(set_aside) + outliers set aside``. ``contradicting`` are those of
    the runs set aside whose record does not agree with what is said of it.
    """

    imported: ImportedCampaign = field(repr=False)
    fit: SurfaceFit
    laws: RicherLaws | None
    set_aside: tuple[SetAside, ...]
    criterion: SteadyCriterion
    torque_constant_Nm_A: float
    contradicting: tuple[SetAside, ...] = ()
    findings: Mapping[str, tuple[Finding, ...]] = field(default_factory=dict)

    @property
    def runs_listed(self) -> int:
        """Runs in the campaign file."""
        return len(self.imported.campaign.runs)

    @property
    def rows_in(self) -> int:
        """Data rows in the files of the runs that are used."""
        return self.imported.rows_in

    @property
    def rows_out(self) -> int:
        """Rows that were kept of them."""
        return self.imported.rows_out

    @property
    def inputs(self) -> tuple[InputUse, ...]:
        """The columns of the runs' files, and what each was used for."""
        return self.imported.inputs


def identify_campaign(
    imported: ImportedCampaign,
    design: Design,
    *,
    richer: bool = True,
    fixed: Mapping[str, float] | None = None,
) -> CampaignResult:
    """Identify C0, Cv and CM (paper, section 3) from imported runs.

    Parameters
    ----------
    imported : ImportedCampaign
    design : Design
        Its torque constant makes torques of currents.
    richer : bool
        Whether to ask, by cross-validation, for a richer law.
    fixed : mapping, optional
        Coefficients (C0, Cv, CM) that are held at a value.

    Raises
    ------
    InputError
        Without a torque constant, or with too few usable runs; the reasons of those set aside are told.
    """
    constant = design.effective_motor.torque_constant_Nm_A
    if constant is None:
        told = "motor.torque_constant: the design has none, so currents cannot become torques"
        raise InputError(told, design.name)
    points, restless = steady_points(imported.runs, constant)
    used, contradicting, findings = check_runs(design, imported.runs, points, imported.campaign.instruments)
    aside = (*imported.set_aside, *restless, *contradicting)
    try:
        fit = fit_surface(
            used,
            imported.campaign.instruments,
            constant,
            outliers=imported.campaign.outliers,
            fixed=fixed,
            kept=_values_of(design),
        )
    except InputError as error:
        told = "; ".join(f"{run.id}: {run.reason}" for run in aside[:3])
        message = f"{error.message} ({told})" if told else error.message
        raise InputError(message, imported.campaign.origin) from None
    laws = compare_laws(fit) if richer and not fixed and len(fit.points) >= 5 else None
    return CampaignResult(
        imported=imported,
        fit=fit,
        laws=laws,
        set_aside=aside,
        criterion=SteadyCriterion(),
        torque_constant_Nm_A=constant,
        contradicting=tuple(contradicting),
        findings=findings,
    )


def check_runs(
    design: Design,
    runs: Sequence[ImportedRun],
    points: Sequence[SteadyPoint],
    instruments: Instruments,
) -> tuple[list[SteadyPoint], list[SetAside], dict[str, tuple[Finding, ...]]]:
    """The points that agree with what is said of their runs, those runs that do not, and all findings.

    Each is held against its set speed and load, itself, and the design's limits. The speed may be off by 5 %
    of its setting, the load by 10 % and twice the sensor's accuracy.
    """
    by_id = {run.id: run for run in runs}
    good, bad, findings = [], [], {}
    for point in points:
        run = by_id[point.run]
        result = [*_settings(run, point, instruments), *check_record(design, run.record)]
        result += [_same_file(other) for other in runs if _share_a_file(run, other)][:1]
        findings[run.id] = tuple(result)
        wrong = [f"{one.subject}: {one.text}" for one in result if one.passed is False]
        if wrong:
            bad.append(SetAside(id=run.id, reason="; ".join(wrong)))
        else:
            good.append(point)
    return good, bad, findings


def _share_a_file(run: ImportedRun, other: ImportedRun) -> bool:
    """Whether the file of the load sensor of one run is that of another as well."""
    files = [None if one.load_is_zero or one.sensor is None else one.sensor.sha256 for one in (run, other)]
    return run is not other and bool(files[0]) and files[0] == files[1]


def _same_file(other: ImportedRun) -> Finding:
    text = f"the sensor's file is that of run {other.id} as well"
    return Finding(subject="sensor file", passed=False, text=text)


def _settings(run: ImportedRun, point: SteadyPoint, instruments: Instruments) -> Iterator[Finding]:
    speed, load = abs(run.entry.speed_rad_s or 0.0), abs(run.entry.load_Nm or 0.0)
    if speed:
        yield _against("speed", "rad/s", point.speed_rad_s, speed, SPEED_TOLERANCE)
    if load:
        sensor = 2.0 * instruments.torque_accuracy * instruments.torque_full_scale_Nm / load
        yield _against("load", "N m", point.load_Nm, load, LOAD_TOLERANCE + sensor)


def _against(what: str, unit: str, measured: float, wanted: float, allowed: float) -> Finding:
    ratio = measured / wanted
    text = f"{what} {measured:.4g} {unit}, set {wanted:.4g} {unit}"
    passed = abs(ratio - 1.0) <= allowed
    if not passed:
        factor = named_factor(ratio)
        text += f": {ratio:.4g} times" + (f", factor {factor}" if factor else "")
    return Finding(subject=f"set {what}", passed=passed, text=text)


def _values_of(design: Design) -> dict[str, float]:
    """The design's own C0, Cv and CM, kept where the runs do not tell them."""
    friction = design.friction
    values = (friction.dry_torque_Nm, friction.viscous_Nms_rad, friction.load_coefficient)
    return dict(zip(NAMES, values, strict=True))


def campaign_items(
    design: Design, result: CampaignResult, simulated: float | None, limit: float
) -> tuple[Item, ...]:
    """The verdict on a campaign: runs, residual, size, and the written design simulated again."""
    fit, wrong = result.fit, result.contradicting
    why = "; ".join(f"run {run.id}: {run.reason}" for run in wrong[:3])
    why += f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
    label = "Runs agree with their set speed and load, themselves and the design"
    items = [
        Item(id="runs", label=label, passed=not wrong, reason=why),
        size_item(design, _compared(design, fit), kept_constants=False, loaded=True),
        residual_item(fit.relative_residual, limit),
    ]
    if simulated is not None:
        items.append(simulated_item("the runs", simulated, limit, "steady current, simulated"))
    return tuple(items)


def _compared(design: Design, fit: SurfaceFit) -> list[DesignValue]:
    names, before = ("dry", "viscous", "load_coefficient"), _values_of(design)
    found = fit.renamed(dict(zip(NAMES, names, strict=True)))
    values = (design_value(design, found, names[k], before[NAMES[k]]) for k in fit.told)
    return [one for one in values if one]


def steady_current_error(
    design: Design, points: Sequence[SteadyPoint], *, progress: Callable[[int, int], None] | None = None
) -> float | None:
    """Relative error of the simulated steady torques kM i over all runs; None where no run can be driven.

    Each run is a ramp of the output angle at the run's mean speed under its mean load, 0.3 s for running up
    and 0.2 s for the mean. Runs that the simulated drive does not bring to within 1 % of their speed are left
    out.
    """
    from nonlinear import commands, simulate

    constant = design.effective_motor.torque_constant_Nm_A
    duration = RUN_UP_S + STEADY_S
    period = design.controller.period_s
    if constant is None or duration / period > MOST_CAMPAIGN_TICKS:
        return None
    wanted, result = [], []
    for k, point in enumerate(points, 1):
        command = commands.ramp(point.direction * point.speed_rad_s / design.total_ratio)
        try:
            run = simulate(design, command, duration, point.load_Nm)
        except (InputError, NumericalError):
            continue
        late = run.time_s >= RUN_UP_S
        speed = point.direction * float(np.mean(run.motor_speed_rad_s[late]))
        if abs(speed - point.speed_rad_s) <= SPEED_REACHED * point.speed_rad_s:
            wanted.append(point.torque_Nm)
            result.append(point.direction * constant * float(np.mean(run.current_A[late])))
        if progress is not None:
            progress(k, len(points))
    if not wanted:
        return None
    return float(np.linalg.norm(np.subtract(result, wanted)) / np.linalg.norm(wanted))
