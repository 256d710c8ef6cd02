"""Predictions of the position loop where they need not hold: from rest, at the design's own amplitudes."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from analyses.loop_figures import LoopFigures
from analyses.validation.at_rest import RestSweep
from analyses.validation.conditional import step_rows
from analyses.validation.figures import first_fall
from analyses.validation.ledger import (
    OVERSHOOT_PERCENT,
    RELATIVE,
    Entry,
    not_judged,
)
from nonlinear import LIMITERS
from nonlinear.reduced import BatchResult

Floats = npt.NDArray[np.float64]
LIMIT_NAMES = {
    "speed": "speed limit",
    "acceleration": "acceleration limit",
    "current": "peak current",
    "voltage": "voltage limit",
    "torque-command": "limit in front of the torque filters",
    "overload": "overload protection",
    "profile": "profile of the command",
}


@dataclass(frozen=True)
class RestSteps:
    """Steps of the command from rest, one entry an amplitude; NaN where a level is not reached."""

    amplitude_rad: Floats
    rise_time_s: Floats
    overshoot_percent: Floats
    settling_time_s: Floats
    reasons: tuple[str, ...]


def steps_from_rest(design: Design, settle_ticks: int) -> RestSteps:
    """Step the command to each amplitude that the design names, with friction and limits."""
    full = design.validation.full_deflection_rad
    amplitude = full * np.array(design.validation.amplitude_fractions)
    rows = step_rows(design, amplitude, settle_ticks)
    rows.step_figures(amplitude)
    result = rows.run()
    step = result.step
    return RestSteps(
        amplitude,
        step.rise_time_s,
        step.overshoot_percent,
        step.settling_time_s,
        tuple(_reason(design, result, k) for k in range(amplitude.size)),
    )


def _reason(design: Design, result: BatchResult, k: int) -> str:
    """What took part in a run that the linear loop does not know of."""
    shares = {name: 100.0 * float(result.limit_fraction(name)[k]) for name in LIMITERS}
    words = [f"{LIMIT_NAMES[name]} {share:.2g} %" for name, share in shares.items() if share > 0.0]
    if result.events[k] == 0 and result.stick_fraction[k] > 0.99:
        return "no motion: dry friction holds the rotor"
    if design.friction.dry_Nm(0.0) > 0.0:
        words.append("dry friction")
    return ", ".join(words)


def rest_entries(
    design: Design, figures: LoopFigures, steps: RestSteps, sweep: RestSweep | None
) -> list[Entry]:
    """Ledger entries from rest: judged only where neither a limit nor friction takes part."""
    rows = [] if sweep is None else _sweep_entries(figures, sweep)
    if figures.step is None:
        return rows
    sample = 1.01 * (figures.step.period_s or 0.0)
    scale, unit = (1e3, "mm") if design.axis == "linear" else (degrees(1.0), "deg")
    for k, amplitude in enumerate(steps.amplitude_rad):
        condition = f"from rest, step of {amplitude * scale:.3g} {unit} of the command (with feed-forward)"
        for quantity, of, wanted, seen, tolerance in (
            ("rise_time", "s", figures.step.rise_time_s, steps.rise_time_s[k], sample),
            ("overshoot", "%", figures.step.overshoot_percent, steps.overshoot_percent[k], OVERSHOOT_PERCENT),
            ("settling_time", "s", figures.step.settling_time_s, steps.settling_time_s[k], sample),
        ):
            measured = float(seen) if np.isfinite(seen) else None
            rows.append(_judge(quantity, of, condition, wanted, measured, tolerance, steps.reasons[k]))
    return rows


def _judge(
    quantity: str,
    unit: str,
    condition: str,
    predicted: float | None,
    measured: float | None,
    tolerance: float,
    reason: str,
) -> Entry:
    """Judge where nothing speaks against it; else show it with the reason."""
    if reason:
        return not_judged("position", quantity, unit, predicted, measured, reason, condition)
    close = predicted is not None and measured is not None and abs(measured - predicted) <= tolerance
    return Entry("position", quantity, unit, condition, predicted, measured, tolerance, close)


def _sweep_entries(figures: LoopFigures, sweep: RestSweep) -> list[Entry]:
    """Bandwidths without bias motion."""
    band = figures.bandwidth
    if band is None:
        return []
    gain, phase = np.abs(sweep.measured), np.degrees(np.unwrap(np.angle(sweep.measured)))
    acting = next((LIMIT_NAMES[name] for name in sweep.limiter if name), "")
    reason = ", ".join(word for word in ("dry friction at every reversal", acting) if word)
    if not np.isfinite(sweep.described).any():
        held = bool((sweep.stick_fraction > 0.0).any())
        reason = ", ".join(word for word in ("dry friction holds the rotor" if held else "", acting) if word)
    condition = "from rest, sine of the command (with feed-forward), clear of every limit"
    rows = []
    for quantity, predicted, values, level in (
        ("bandwidth", band.minus3db_hz, gain, np.sqrt(0.5)),
        ("bandwidth_90deg", band.minus90deg_hz, phase, -90.0),
    ):
        measured = first_fall(sweep.frequency_hz, values, level)
        tolerance = 10.0 * RELATIVE * (predicted or 0.0)
        rows.append(_judge(quantity, "Hz", condition, predicted, measured, tolerance, reason))
    return rows
