"""From a campaign to coefficients: import, steady parts, surface, the question of a richer law."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats, Progress
from analyses.estimation.least_squares import scaled_lstsq
from analyses.estimation.parameters import default_value
from analyses.identification.asked import refuse_linear
from analyses.identification.design_values import design_value, kept_constant
from analyses.identification.points import SteadyPoint, steady_point
from analyses.identification.richer import RicherLaws, compare_laws
from analyses.identification.surface import NAMES, SurfaceFit, fit_surface
from analyses.identification.verdict import Item, kept_items, residual_item, simulated_item, size_item
from analyses.records.campaign_import import ImportedCampaign, ImportedRun, SetAside
from analyses.records.consistency import check_record
from analyses.records.factors import named_factor
from analyses.records.finding import SURE, Finding, wrong_of
from analyses.records.inputs import InputUse
from analyses.records.steady_window import CRITERION, SteadyCriterion
from nonlinear import commands, simulate

RUN_UP_S = 0.3
STEADY_S = 0.2
SPEED_REACHED = 0.01
MOST_CAMPAIGN_TICKS = 200_000
SPEED_TOLERANCE = 0.05
LOAD_TOLERANCE = 0.10
IN_MOTION = {"C0": "dry", "Cv": "viscous", "CM": "load_coefficient"}  # the same by the names of a motion's


@dataclass(frozen=True, kw_only=True)
class CampaignResult:
    """Everything that a campaign told: the fit, the runs behind it, and those set aside with their reasons.

    ``runs_listed == len(fit.points) + len(set_aside) + outliers set aside``.
    """

    imported: ImportedCampaign = field(repr=False)
    fit: SurfaceFit
    laws: RicherLaws | None
    set_aside: tuple[SetAside, ...]
    criterion: SteadyCriterion
    torque_constant_Nm_A: float
    findings: Mapping[str, tuple[Finding, ...]] = field(default_factory=dict)

    @property
    def runs_listed(self) -> int:
        """Runs in the campaign file."""
        return len(self.imported.campaign.runs)

    @property
    def rows_in(self) -> int:
        """Data rows in the files of the runs that are used."""
        return sum(counts.rows_in for counts in self.imported.counts)

    @property
    def rows_out(self) -> int:
        """Rows that were kept of them."""
        return sum(counts.rows_out for counts in self.imported.counts)

    @property
    def inputs(self) -> tuple[InputUse, ...]:
        """The columns of the runs' files, and what each was used for."""
        return self.imported.inputs


def identify_campaign(
    imported: ImportedCampaign,
    design: AnyDesign,
    *,
    richer: bool = True,
    fixed: Mapping[str, float] | None = None,
) -> CampaignResult:
    """Identify C0, Cv and CM (paper, section 3) from imported runs.

    The design's torque constant makes torques of currents; ``richer``: whether to ask, by cross-validation,
    for a richer law; ``fixed``: coefficients (C0, Cv, CM) that are held at a value.

    Raises `InputError`: of a linear axis, without a torque constant, or with too few usable runs; the reasons
    of those set aside are told.
    """
    design = as_design(design)
    refuse_linear(design, "a campaign")
    constant = design.effective_motor.torque_constant_Nm_A
    if constant is None:
        why = "motor.torque_constant: the design has none, so currents cannot become torques"
        raise InputError(why, design.name)
    campaign = imported.campaign
    points, aside, findings = [], list(imported.set_aside), {}
    for run in imported.runs:
        try:
            point = steady_point(run, constant)
        except InputError as error:
            aside.append(SetAside(id=run.id, reason=str(error)))
            continue
        findings[run.id] = tuple(check_run(design, imported, run, point))
        if wrong := wrong_of(findings[run.id]):
            aside.append(SetAside(id=run.id, reason=wrong, contradicts=True))
        else:
            points.append(point)
    tools, own = campaign.instruments, {name: default_value(design, one) for name, one in IN_MOTION.items()}
    try:
        fit = fit_surface(points, tools, constant, outliers=campaign.outliers, fixed=fixed, kept=own)
    except InputError as error:
        why = "; ".join(f"{run.id}: {run.reason}" for run in aside[:3])
        raise InputError(error.message + f" ({why})" * bool(why), campaign.origin) from None
    gone = {run.id for run in aside}
    if lost := sum(run.id in gone and bool(run.load_Nm) for run in campaign.runs):
        none = "no run is loaded"
        words = f"{none} but those set aside ({lost})"
        kept = {name: replace(f, reason=f.reason.replace(none, words)) for name, f in fit.fixed.items()}
        fit = replace(fit, fixed=kept)
    if not tools.torque_constant:  # else the intervals hold its error
        given = kept_constant(design, "torque_constant", fit, _constant_shares(fit))
        fit = replace(fit, fixed={**fit.fixed, **given})
    return CampaignResult(
        imported=imported,
        fit=fit,
        laws=compare_laws(fit) if richer and not fixed and len(fit.points) >= 5 else None,
        set_aside=tuple(aside),
        criterion=CRITERION,
        torque_constant_Nm_A=constant,
        findings=findings,
    )


def _constant_shares(fit: SurfaceFit) -> Floats:
    """Relative change of each coefficient over that of the torque constant, beside those that are held."""
    rows = np.array([[1.0, p.speed_rad_s, p.load_Nm] for p in fit.points]) / fit.residual_stds_Nm[:, None]
    torque = np.array([p.torque_Nm for p in fit.points]) / fit.residual_stds_Nm
    free, held = list(fit.determined), [k for k in range(len(NAMES)) if k not in fit.determined]
    own = torque - rows[:, held] @ fit.values[held]
    shares = np.zeros(len(NAMES))
    shares[free] = scaled_lstsq(rows[:, free], torque) / scaled_lstsq(rows[:, free], own)
    return shares


def check_run(
    design: Design, imported: ImportedCampaign, run: ImportedRun, point: SteadyPoint
) -> Iterator[Finding]:
    """Hold a run against its set speed and load, itself, and the design's limits.

    The speed may be off by 5 % of its setting, the load by 10 % and twice the sensor's accuracy. Friction
    takes power in steady motion.
    """
    speed, load = abs(run.entry.speed_rad_s or 0.0), abs(run.entry.load_Nm or 0.0)
    tools = imported.campaign.instruments
    sensor = 2.0 * tools.torque_accuracy * tools.torque_full_scale_Nm / max(load, 1e-300)
    for what, unit, measured, wanted, allowed in (
        ("speed", "rad/s", point.speed_rad_s, speed, SPEED_TOLERANCE),
        ("load", "N m", point.load_Nm, load, LOAD_TOLERANCE + sensor),
    ):
        if wanted:
            ratio, text = measured / wanted, f"{what} {measured:.4g} {unit}, set {wanted:.4g} {unit}"
            passed, factor = abs(ratio - 1.0) <= allowed, named_factor(ratio)
            text += "" if passed else f": {ratio:.4g} times" + (f", factor {factor}" if factor else "")
            yield Finding(subject=f"set {what}", passed=passed, text=text)
    least = (design.effective_motor.torque_constant_Nm_A or 0.0) * tools.current_offset_A
    least += SURE * float(np.sqrt(point.covariance[0, 0]))
    if point.torque_Nm < -least and (design.load.path == "self-locking" or not point.load_Nm):
        torque = f"{point.torque_Nm:.4g} N m with the motion, where friction alone acts against it"
        text = f"the sign of the current is turned, or that of the speed: kM i is {torque}"
        yield Finding(subject="current against the motion", passed=False, text=text)
    yield from check_record(design, run.record)
    for other in imported.runs:
        if other is not run and run.sensor_file and run.sensor_file == other.sensor_file:
            text = f"the sensor's file is that of run {other.id} as well"
            yield Finding(subject="sensor file", passed=False, text=text)
            break


def campaign_items(
    design: Design, result: CampaignResult, simulated: float | None, limit: float, held: Collection[str] = ()
) -> tuple[Item, ...]:
    """The verdict on a campaign: runs, residual, size, and the written design simulated again."""
    fit, aside = result.fit, sorted(result.set_aside, key=lambda run: not run.contradicts)
    why = "".join(f"run {run.id}: {run.reason}" for run in aside[:1])
    why += f"; set aside are runs {', '.join(run.id for run in aside)}" if len(aside) > 1 else ""
    passed = None if aside else True
    found, names = fit.renamed(IN_MOTION), [IN_MOTION[name] for name in NAMES if name not in fit.fixed]
    compared = [design_value(design, found, one, default_value(design, one)) for one in names]
    items = []
    if design.load.path != "self-locking" and any(point.load_Nm for point in fit.points):
        reason = (
            f'load.path = "{design.load.path}": the motor carries M/N as well, which the law C0 + Cv w + CM '
            f"|M| lacks, so CM holds 1/N = {1e3 / design.total_ratio:.4g} mN m/(N m) beside the friction; "
            'allowed: load.path = "self-locking", or records of a motion, whose model has M/N'
        )
        items.append(Item(id="law", label="The load only adds friction", passed=False, reason=reason))
    label = "Runs agree with their set speed and load, themselves and the design"
    items += [
        Item(id="runs", label=label, passed=False if aside and aside[0].contradicts else passed, reason=why),
        size_item(design, [one for one in compared if one], kept_constants=False, loaded=True),
        residual_item(fit.relative_residual, limit),
        *kept_items(fit, held),
        *_fit_items(result),
    ]
    if simulated is not None:
        items.append(simulated_item("the runs", simulated, limit, "steady current, simulated"))
    return tuple(items)


def _fit_items(result: CampaignResult) -> Iterator[Item]:
    """Runs that are no part of the others and yet in the fit, and a law that tells unseen runs better."""
    if kept := sorted(
        (one for one in result.fit.outliers if not one.set_aside), key=lambda one: -abs(one.standardised)
    ):
        off, names = kept[0], ", ".join(one.run for one in kept)
        why = f"run {off.run} is {abs(off.standardised):.3g} standard deviations off, limit {off.limit:.3g}"
        why += f"; in the fit, and far off: {names}" if len(kept) > 1 else ", and in the fit"
        why += '; outliers = "set-aside" in [campaign] leaves such runs out'
        yield Item.unproven("outliers", "Every run is one of the others", why)
    if result.laws is not None and result.laws.best != "plain":
        why = f"{result.laws.best}: tells unseen runs better, so that the truth need not lie in the intervals"
        yield Item.unproven("friction-law", "Friction law of the fit is that of the runs", why)


def steady_error(design: Design, points: Sequence[SteadyPoint], *, progress: Progress = None) -> float | None:
    """Relative error of the simulated steady torques kM i over all runs; None where no run can be driven.

    Each run is a ramp of the output angle at the run's mean speed under its mean load, 0.3 s for running up
    and 0.2 s for the mean. Runs that the simulated drive leaves more than 1 % off their speed are left out.
    """
    constant, duration = design.effective_motor.torque_constant_Nm_A, RUN_UP_S + STEADY_S
    if constant is None or duration / design.controller.period_s > MOST_CAMPAIGN_TICKS:
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
    return float(np.linalg.norm(np.subtract(result, wanted)) / np.linalg.norm(wanted)) if wanted else None
