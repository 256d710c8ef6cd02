"""Steps of the command from rest at the design's own amplitudes, with friction and limits: a finding."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.drive.signals import LIMITERS
from analyses.validation.conditional import step_rows
from analyses.validation.settling import carried_on
from nonlinear.reduced import BatchResult

Floats = npt.NDArray[np.float64]
SETTLED = 0.02  # band of the settling time: what moves by more in the last window does not settle
AT_TARGET = 1e-6  # of a step: so near its end is the target


@dataclass(frozen=True)
class RestSteps:
    """Steps of the command from rest, one entry an amplitude; NaN where a level is not reached.

    ``final_ratio`` is where each ends, over its command: a P controller against a load that changes with the
    angle does not end at 1.  ``error`` is what it is off by, relative: what its last window moves, carried on
    to the end of the slowest mode.
    """

    amplitude_rad: Floats
    rise_time_s: Floats
    overshoot_percent: Floats
    settling_time_s: Floats
    final_ratio: Floats
    error: Floats
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
