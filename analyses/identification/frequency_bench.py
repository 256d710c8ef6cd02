"""From records of a two-mass drive to a design: frequency response, play, verdict."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from actuator_lti.design import parameter_value, read_design_text, write_design
from actuator_lti.design.model import Coupling, Design, LoadFriction
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.parameters import parameter
from analyses.identification import two_mass, verdict
from analyses.identification.asked import held_by_name, refuse_linear
from analyses.identification.design_values import STEP, at_constant, constant_of, kept_constant
from analyses.identification.play import Play, play_of
from analyses.identification.rows import drive_of
from analyses.identification.sampled_current import held_voltage
from analyses.identification.to_design import design_with_fit
from analyses.identification.two_mass import Lines, TwoMass
from analyses.identification.verdict import Identified, Item
from analyses.records.consistency import check_record
from analyses.records.finding import Finding
from analyses.records.inputs import InputUse, account
from analyses.records.record import Record, prepared

MISFIT_LIMIT = 3.0
MISFIT_DOUBTED = 1.5  # above this other starts are tried: a valley may be the wrong one
COMMANDS = ("reference", "speed_reference", "current_reference", "voltage_reference", "current")


@dataclass(frozen=True, kw_only=True)
class FrequencyResult(Identified):
    """What a frequency response (and a record for the play) told of a two-mass drive."""

    record: Record
    play_record: Record | None
    lines: Lines = field(repr=False)
    period_s: float
    fit: TwoMass
    play: Play | None
    used: Mapping[str, str]
    findings: Mapping[str, tuple[Finding, ...]]

    @property
    def found(self) -> Fit:
        """Everything that was found: the parameters, both resonances, the play."""
        fit, play = self.fit, self.play
        found = fit.beside("antiresonance", *fit.antiresonance_rad_s)
        found = found.beside("resonance", *fit.resonance_rad_s)
        return found.beside("play", 2.0 * play.half_rad, 2.0 * play.half_std_rad) if play else found

    @property
    def inputs(self) -> tuple[InputUse, ...]:
        """The record's columns, and what each was used for."""
        return account(self.record, self.used)


def identify_frequency(
    design: Design,
    record: Record,
    *,
    play_record: Record | None = None,
    period_s: float | None = None,
    fixed: Mapping[str, float] | None = None,
) -> FrequencyResult:
    """Identify a compliant two-mass drive.

    The design's coupling (or, without one, its last gear) is where the compliance is; its inertias beside
    the rotor's and the load's are kept. ``record`` is of a periodic excitation: current and motor angle,
    the output angle too where there is one; with play, under a torque that keeps one flank. ``play_record``
    is of a torque that reverses, with the angles of both sides. ``period_s`` is found from the command
    otherwise.
    """
    refuse_linear(design, "a frequency response")
    record = prepared(record)
    play_record = None if play_record is None else prepared(play_record)
    if "angle" not in record.signals:
        raise InputError("the motor angle is needed for a frequency response", where=record.name)
    torque, source, origin, back_emf = drive_of(design, record)
    if back_emf:
        raise InputError("a frequency response needs the current, not the voltage", where=record.name)
    command = next((name for name in COMMANDS if name in record.signals), "current")
    period = two_mass.period_of_excitation(record, command) if period_s is None else period_s
    signals, used = {**record.signals, "torque_at_motor": torque}, {source: f"drive: {origin}"}
    names = ["torque_at_motor", "angle"]
    if "output_angle" in record.signals:
        names.append("load_angle")
        signals["load_angle"] = design.ratio_behind_coupling * record["output_angle"]
        used["output_angle"] = "load's angle"
    used |= {"angle": "motor angle", command: used.get(command, "its period")}
    lines = two_mass.excited_lines(replace(record, signals=signals), tuple(names), period)
    lines = _between_ticks(design, record, lines)
    reaction = _reaction(design, torque, record["angle"])
    held = held_by_name(fixed or {}, two_mass.NAMES)
    for name, (others, slope) in _besides(design).items():
        held |= {name: held[name] / slope + others} if name in held else {}
    fit = _fitted(lines, design.ratio_to_coupling, held, reaction)
    fit = replace(fit, fixed={**fit.fixed, **_given(design, record, lines, held, fit)})
    play = None if play_record is None else play_of(design, play_record, fit)
    made = _made(design, fit, play, record.name)
    findings = {one.name: check_record(design, one) for one in (record, play_record) if one is not None}
    items = [verdict.inputs_item(name, result) for name, result in findings.items()]
    why = "play, friction or another resonance: excite on one flank, in motion"
    misfit = f"misfit {fit.misfit:.2f} of its noise, {MISFIT_LIMIT:g} allowed"
    label = f"The two-mass model explains the lines ({misfit})"
    items.append(Item.of("misfit", label, "" if fit.misfit <= MISFIT_LIMIT else why))
    items += verdict.kept_items(fit, held)
    if play is not None:
        dry = (design.load.friction or LoadFriction()).dry_torque_Nm
        why = f"the play is that at the design's load.friction.dry_torque, {dry:g} N m; more adds to it"
        items.append(Item.unproven("kept-load_dry", "Dry friction of the load", why))
    items.append(_written_item(read_design_text(write_design(made)), lines, record.name, fit.reaction))
    return FrequencyResult(
        record=record,
        play_record=play_record,
        lines=lines,
        period_s=period,
        fit=fit,
        play=play,
        design=made,
        used=used,
        findings=findings,
        items=tuple(items),
    )


def _given(
    design: Design, record: Record, lines: Lines, held: Mapping[str, float], fit: TwoMass
) -> dict[str, Fixed]:
    """What makes torques, and the load friction: what an error of each moves, found by another fit."""
    name, scale, made = constant_of(design, record), np.ones(len(lines.names)), dict[str, Fixed]()
    scale[0] += STEP
    larger = replace(lines, means=lines.means * scale[:, None], noise=lines.noise * np.outer(scale, scale))
    more = fit.reaction + STEP * (fit.reaction - 1.0 / fit.reduction)
    for one, tried, reaction in ((name, larger, fit.reaction), ("load_coefficient", lines, more)):
        if one is not None:
            again = _fitted(tried, fit.reduction, held, reaction)
            shares = np.array([again[n] / fit[n] - 1.0 for n in fit.names]) / STEP
            made |= kept_constant(design, one, fit, shares)
    return made


def _between_ticks(design: Design, record: Record, lines: Lines) -> Lines:
    """The lines of the torque that acts, from those of the current sampled at the ticks and of the angle.

    What the voltage drives goes in steps, ``F`` of its samples; what the back-EMF drives, ``i_e = -kE j w
    th/(R + j w L)``, does not: the torque is ``F (T - kM i_e) + kM i_e``.
    """
    held, motor = held_voltage(design, record), design.effective_motor
    if held is None or motor.torque_constant_Nm_A is None:
        return lines
    s = 1j * lines.omega_rad_s
    factor = held.mean_over_sample(lines.omega_rad_s)
    own = -motor.torque_constant_Nm_A * held.back_emf_A_per_rad_s * s / (1.0 + s / held.rate_1_s)
    mix = np.zeros((len(s), len(lines.names), len(lines.names)), dtype=complex)
    mix[:] = np.eye(len(lines.names))
    mix[:, 0, 0] = factor
    mix[:, 0, lines.names.index("angle")] += (1.0 - factor) * own
    means = np.einsum("kab,bk->ak", mix, lines.means)
    noise = np.einsum("kab,kbc,kdc->kad", mix, lines.noise, mix.conj())
    return replace(lines, means=means, noise=noise)


def _reaction(design: Design, torque: Floats, angle: Floats) -> float:
    """Torque on the motor by that in the coupling: 1/N_c, and CM N_r by the sign of the power to the load."""
    turned = float(angle[-1] - angle[0])
    side = np.sign(float(np.mean(torque)) * turned) if abs(turned) > 1.0 else 0.0
    own = design.friction.load_coefficient * design.ratio_behind_coupling
    return float(1.0 / design.ratio_to_coupling + side * own)


def _fitted(lines: Lines, reduction: float, held: Mapping[str, float], reaction: float) -> TwoMass:
    """The fit; a damping or friction that comes out negative (not merely small) is held at zero."""
    start = {**two_mass.start_of(lines, reduction), **held}
    fit = two_mass.fit_two_mass(lines, start, reduction, fixed=held, reaction=reaction)
    for other in two_mass.other_starts(start, lines, reduction):
        if fit.misfit <= MISFIT_DOUBTED:
            break
        with suppress(NumericalError, np.linalg.LinAlgError):
            tried = two_mass.fit_two_mass(lines, {**other, **held}, reduction, fixed=held, reaction=reaction)
            fit = min(fit, tried, key=lambda one: one.misfit)
    return _held_at_zero(fit)


def _held_at_zero(fit: TwoMass) -> TwoMass:
    """The fit where what came out negative is zero: the rest moves as its covariance with that has it."""
    below = [name for name in two_mass.FLOORS if name in fit.names and fit[name] < 0.0]
    if not below:
        return fit
    zero = Fixed(value=0.0, reason="would come out negative")
    found = {**vars(fit.at(dict.fromkeys(below, 0.0))), "fixed": {**fit.fixed, **dict.fromkeys(below, zero)}}
    return _held_at_zero(replace(fit, **found))


def _besides(design: Design) -> dict[str, tuple[float, float]]:
    """Of each side: its inertias beside the rotor's or the load's, and what takes the load's to its shaft."""
    behind = design.ratio_behind_coupling**2
    motor = design.motor_side_inertia_kgm2 - design.motor.rotor_inertia_kgm2
    load = design.load_side_inertia_kgm2 - design.load.inertia_kgm2 / behind
    return {"motor_inertia": (motor, 1.0), "load_inertia": (load, behind)}


def _written_item(written: Design, lines: Lines, record: str, reaction: float) -> Item:
    """The response of the design as it was written against the measured lines."""
    named = {name: parameter_value(written, parameter(name).key) for name in two_mass.NAMES}
    named["motor_inertia"] = written.motor_side_inertia_kgm2
    named["load_inertia"] = written.load_side_inertia_kgm2
    model, _ = two_mass.angle_responses(lines.omega_rad_s, named, written.ratio_to_coupling, reaction)
    measured, relative = two_mass.response(lines)
    weight = 1.0 / np.maximum(relative, 1e-3)
    error = float(np.linalg.norm(weight * (model / measured - 1.0)) / np.linalg.norm(weight))
    return verdict.simulated_item(record, error, verdict.RESIDUAL_LIMIT, "response, line by line")


def _made(design: Design, fit: TwoMass, play: Play | None, record: str) -> Design:
    old = design.coupling or Coupling(stiffness_Nm_rad=fit["stiffness"])
    coupling = replace(old, stiffness_Nm_rad=fit["stiffness"], damping_Nms_rad=fit["damping"])
    if play is not None:
        coupling = replace(coupling, play_rad=max(2.0 * play.half_rad, 0.0) if play.determined else 0.0)
    friction = replace(design.load.friction or LoadFriction(), viscous_Nms_rad=fit["load_viscous"])
    base = replace(design, coupling=coupling, load=replace(design.load, friction=friction))
    slopes, values, sides = {}, {}, _besides(base)
    for name in (name for name in fit.names if fit[name] > 0.0):
        key, (others, slope) = parameter(name).key, sides.get(name, (0.0, 1.0))
        slopes[key], values[key] = {name: slope}, slope * (fit[name] - others)
    made = fit.mapped(slopes, values)
    if play is not None and play.determined:
        made = made.beside("coupling.play", 2.0 * play.half_rad, 2.0 * play.half_std_rad)
    return design_with_fit(base, made, f"frequency response of {record}{at_constant(fit, design)}")
