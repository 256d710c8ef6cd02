"""Predictions of the position loop where they need not hold: from rest, at the design's own amplitudes."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, inf

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.drive.signals import LIMITERS
from analyses.loop_figures import LoopFigures
from analyses.validation.at_rest import RestSweep
from analyses.validation.conditional import step_rows
from analyses.validation.ledger import Entry, entry, not_judged, to_the_command
from analyses.validation.own_error import carried_on
from analyses.validation.reading import Reading, first_fall
from analyses.validation.step import SETTLED, UNSETTLED
from nonlinear.operating_motion import has_to_stand
from nonlinear.reduced import BatchResult

Floats = npt.NDArray[np.float64]
STEP_PERCENT = 5e-3  # of a step: its end may be so far from the target, as the run is as long as it settles
SAME_END = 1e-4  # relative: so near, two steps end at the same share of their commands
AT_TARGET = 1e-6  # of a step: so near its end is the target


@dataclass(frozen=True)
class RestSteps:
    """Steps of the command from rest, one entry an amplitude; NaN where a level is not reached.

    ``final_ratio`` is where each ends, over its command: a P controller against a load that changes with the
    angle does not end at 1.  ``error`` is what it is off by, relative: what its last window moves, carried on
    to the end of the slowest mode; the other two what that does to the times.
    """

    amplitude_rad: Floats
    rise_time_s: Floats
    overshoot_percent: Floats
    settling_time_s: Floats
    final_ratio: Floats
    error: Floats
    rise_error_s: Floats
    settling_error_s: Floats
    reasons: tuple[str, ...]


def steps_from_rest(design: Design, settle_ticks: int, slowest_ticks: float) -> RestSteps:
    """Step the command to each amplitude that the design names, with friction and limits.

    ``settle_ticks`` are waited for; ``slowest_ticks`` is the slowest time constant, which they need not hold.
    """
    full = design.validation.full_deflection_rad
    amplitude = full * np.array(design.validation.amplitude_fractions)
    rows = step_rows(design, amplitude, settle_ticks)
    rows.step_figures(amplitude)
    result = rows.run()
    final = result.step.final_ratio
    low, high = result.span("output_angle_rad")
    moved = np.abs((high - low) / (amplitude * np.where(final == 0.0, 1.0, final)))
    error = carried_on(moved, rows["window"], max(slowest_ticks, 1.0))
    if (np.isfinite(final) & (np.abs(final - 1.0) > AT_TARGET)).any():  # figures are those of the final value
        rows.step_figures(amplitude * np.where(np.isfinite(final) & (final > 0.0), final, 1.0))
        result = rows.run()
    step = result.step
    reasons = [_reason(design, result, k) for k in range(amplitude.size)]
    spread = np.zeros((2, amplitude.size))
    if not all(reasons):  # what is judged is read about a final value that is off by its error, too
        targets = rows["step_target"].copy()
        for side in (-1.0, 1.0):
            rows.step_figures(targets * (1.0 + side * np.minimum(error, UNSETTLED)))
            other = rows.run().step
            moves = [other.rise_time_s - step.rise_time_s, other.settling_time_s - step.settling_time_s]
            spread = np.maximum(spread, np.nan_to_num(np.abs(moves)))
        reasons = [
            reason or (f"not settled at the end of its run ({left:.1g} of it is to come)" if late else "")
            for reason, left, late in zip(reasons, error, error > UNSETTLED, strict=True)
        ]
    goes_on = moved > SETTLED  # such a step has no settling time and no final value
    reasons = [
        f"does not settle: it still moves by {100.0 * by:.3g} % at the end"
        + (f", {reason}" if reason else "")
        if still
        else reason
        for reason, by, still in zip(reasons, moved, goes_on, strict=True)
    ]
    return RestSteps(
        amplitude,
        np.where(goes_on, np.nan, step.rise_time_s),
        np.where(goes_on, np.nan, step.overshoot_percent),
        np.where(goes_on, np.nan, step.settling_time_s),
        final,
        error,
        spread[0],
        spread[1],
        tuple(reasons),
    )


def _reason(design: Design, result: BatchResult, k: int) -> str:
    """What took part in a run that the linear loop does not know of."""
    shares = {name: 100.0 * float(result.limit_fraction(name)[k]) for name in LIMITERS}
    words = [f"{LIMITERS[name].words} {share:.3g} %" for name, share in shares.items() if share > 0.0]
    if result.events[k] == 0 and result.stick_fraction[k] > 0.99:
        return "no motion: dry friction holds the rotor"
    named = {LIMITERS[name].words for name, share in shares.items() if share > 0.0}
    return ", ".join([*words, *(part for part in nonlinear_parts(design) if part not in named)])


def nonlinear_parts(design: Design) -> list[str]:
    """What a motion about rest meets that no linear loop holds, in words."""
    friction, load, place = design.friction, design.load, design.controller.position
    behind, coupling, profile = load.friction, design.coupling, design.command
    there = {
        "dry friction": friction.dry_Nm(0.0) > 0.0,
        "friction map": bool(friction.points),
        "offset torque": friction.offset_torque_Nm != 0.0,
        "viscous friction that differs by direction": friction.viscous(1) != friction.viscous(-1),
        "friction of the load": behind is not None
        and (behind.dry_torque_Nm, behind.offset_torque_Nm) != (0, 0),
        "friction of the coupling's torque": coupling is not None and friction.load_coefficient > 0.0,
        "friction of the load's moment": friction.load_coefficient > 0.0 and bool(load.acting()),
        "play": coupling is not None and coupling.play_rad > 0.0,
        "gravity": load.gravity is not None,
        "profile of the command": min(profile.rate_rad_s, profile.acceleration_rad_s2) < inf,
        "friction feed-forward": place is not None and place.friction_feedforward != 0.0,
        "counts of an encoder": not (design.angle_quantum_rad is None and design.output_quantum_rad is None),
        "noise of the instruments": not design.instruments.ideal,
    }
    return [word for word, yes in there.items() if yes]


def rest_entries(
    design: Design, figures: LoopFigures, steps: RestSteps, sweep: RestSweep | None
) -> list[Entry]:
    """Ledger entries from rest: judged only where neither a limit nor friction takes part."""
    rows = [] if sweep is None else _sweep_entries(design, figures, sweep, _dc(design, steps))
    if figures.step is None:
        return rows
    sample = figures.step.period_s or 0.0  # both are read at samples
    scale, unit = (1e3, "mm") if design.axis == "linear" else (degrees(1.0), "deg")
    for k, amplitude in enumerate(steps.amplitude_rad):
        condition = f"from rest, step of {amplitude * scale:.3g} {unit} of {to_the_command(design)}"
        over = 100.0 * steps.error[k]
        for quantity, of, wanted, seen, error, least in (
            ("rise_time", "s", figures.step.rise_time_s, steps.rise_time_s[k], steps.rise_error_s[k], sample),
            (
                "overshoot",
                "%",
                figures.step.overshoot_percent,
                steps.overshoot_percent[k],
                over,
                STEP_PERCENT,
            ),
            (
                "settling_time",
                "s",
                figures.step.settling_time_s,
                steps.settling_time_s[k],
                steps.settling_error_s[k],
                sample,
            ),
        ):
            reading = Reading(float(seen), float(error)) if np.isfinite(seen) else Reading(None)
            rows.append(_judge(quantity, of, condition, wanted, reading, steps.reasons[k], least))
    return rows


def _dc(design: Design, steps: RestSteps) -> Reading:
    """Response to the command at zero frequency: where steps end, whether or not a limit acted on the way.

    1 where the load does not change with the angle; else no value where the steps end differently: a limit or
    friction holds them.
    """
    if not has_to_stand(design):
        return Reading(1.0)
    ends = steps.final_ratio[:2]
    alike = np.isfinite(ends).all() and float(np.ptp(ends)) <= SAME_END * float(ends[0])
    if not alike or nonlinear_parts(design) or not steps.error[0] <= UNSETTLED:
        return Reading(None)
    return Reading(float(ends[0]), float(steps.error[0] + np.ptp(ends) / ends[0]))


def _judge(
    quantity: str,
    unit: str,
    condition: str,
    predicted: float | None,
    reading: Reading,
    reason: str,
    least: float = 0.0,
) -> Entry:
    """Judge where nothing speaks against it; else show it with the reason."""
    if reason:
        return not_judged("position", quantity, unit, predicted, reading.value, reason, condition)
    return entry("position", quantity, unit, predicted, reading, condition, least)


def _sweep_entries(design: Design, figures: LoopFigures, sweep: RestSweep, dc: Reading) -> list[Entry]:
    """Bandwidths without bias motion, of the response over its value at zero frequency."""
    band = figures.bandwidth
    if band is None:
        return []
    gain, phase = np.abs(sweep.measured) / (dc.value or 1.0), np.degrees(np.unwrap(np.angle(sweep.measured)))
    acting = next((LIMITERS[name].words for name in sweep.limiter if name), "")
    parts = nonlinear_parts(design)
    if not np.isfinite(sweep.described).any() and bool((sweep.stick_fraction > 0.0).any()):
        parts = ["dry friction holds the rotor"]
    if design.controller.position_loop.every > 1:
        parts.append("seen between the samples of the position loop as well")
    if dc.value is None:
        parts.append("the steps from rest end differently: the value at zero frequency is not known")
    reason = ", ".join(dict.fromkeys([*parts, acting] if acting else parts))
    sine = "sine that reaches a limit" if acting else "sine clear of every limit"
    condition = f"response to {to_the_command(design)}, from rest, {sine}"
    spread = float(sweep.unsteadiness.max())
    rows = []
    for quantity, predicted, values, level, error in (
        ("bandwidth", band.minus3db_hz, gain, np.sqrt(0.5), spread + dc.error),
        ("bandwidth_90deg", band.minus90deg_hz, phase, -90.0, float(np.degrees(spread))),
    ):
        result = first_fall(sweep.frequency_hz, values, level, error)
        rows.append(_judge(quantity, "Hz", condition, predicted, result, reason))
    return rows
