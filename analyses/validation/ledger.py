"""The ledger: every linear prediction beside the value that the nonlinear simulator shows.

A prediction is judged where it claims to hold: small signals on a constant speed.  From rest, with dry
friction and at the amplitudes that the design names, it is shown as well, with the reason why it need not
hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, log, log10
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from analyses.loop_figures import LoopFigures
from analyses.validation.borders import LONGEST_DELAY_SAMPLES
from analyses.validation.coherent import coherent
from analyses.validation.confirm import Confirmation
from analyses.validation.figures import Measured, hertz, most_frequent
from analyses.validation.own_error import ROUNDING, carried_on
from analyses.validation.reading import Reading
from analyses.validation.response import Sweep, SweepErrors, linear_response
from analyses.validation.tolerance import PREDICTED, allowed

SMALL = "feedback loop, small signal"
NO_DC_DB = 100.0  # so far above its value at zero frequency: that is none
NEIGHBOURS = 3  # points on either side of a figure's frequency that it is read from
DECIBEL = 20.0 / log(10.0)  # dB per unit of a small relative change
COARSE = {"%": 20.0, "dB": 3.0, "deg": 10.0}  # a measurement that is off by more judges nothing
COARSE_SHARE = 0.2  # of the prediction, in any other unit
ROUND = 1e-9  # of a tolerance: the rounding of its own sum


@dataclass(frozen=True)
class Entry:
    """One prediction and one measurement of it.

    Attributes
    ----------
    loop : str
    quantity : str
        As `reports.sections.names` spells them: ``"bandwidth"``, ``"gain_margin"``, ...
    unit : str
    condition : str
        Under which it was measured.
    predicted, measured : float or None
        ``None``: there is no such value (no crossing, no motion).
    tolerance : float
        Allowed difference, in the unit: from the error that the measurement itself has (`tolerance`).
    passed : bool or None
        ``None``: not judged, see ``reason``.
    reason : str
        Why it is not judged, or what has to be known.
    """

    loop: str
    quantity: str
    unit: str
    condition: str
    predicted: float | None
    measured: float | None
    tolerance: float
    passed: bool | None
    reason: str = ""

    @property
    def difference(self) -> float | None:
        """Measured less predicted."""
        if self.predicted is None or self.measured is None:
            return None
        return self.measured - self.predicted


def entry(
    loop: str,
    quantity: str,
    unit: str,
    predicted: float | None,
    reading: Reading,
    condition: str = SMALL,
    least: float = 0.0,
) -> Entry:
    """A prediction that is judged: agreement within the tolerance, or in that there is no such value.

    ``least`` is the resolution of the figure: a sample of the time, say.
    """
    known = [None if x is None or not isfinite(x) else float(x) for x in (predicted, reading.value)]
    reason = ""
    own = allowed(reading.error, 0.0)
    if not own <= COARSE.get(unit, COARSE_SHARE * abs(known[0] or inf)):
        why = f"the measurement's own error, {own:.2g} {unit}, is too large to judge by"
        return not_judged(loop, quantity, unit, known[0], known[1], why, condition)
    tolerance = float(least + allowed(reading.error, known[0] or 0.0))
    if known[0] is None and known[1] is None:
        passed, reason = True, "predicted and measured: there is none"
    elif known[0] is None or known[1] is None:
        passed = False
        reason = "not predicted, but measured" if known[0] is None else "predicted, but not found"
    else:
        passed = abs(known[1] - known[0]) <= tolerance * (1.0 + ROUND)
    return Entry(loop, quantity, unit, condition, known[0], known[1], tolerance, passed, reason)


def loop_entries(
    name: str,
    figures: LoopFigures,
    measured: Measured,
    confirmed: Sequence[Confirmation],
    errors: Sequence[SweepErrors],
    condition: str,
) -> list[Entry]:
    """Everything predicted of one loop; ``errors`` are those of open and closed loop, point by point."""
    margins, words = figures.margins, f"{SMALL}, {condition}"
    phase = None if margins.phase_margin is None else margins.phase_margin.deg
    rows = [
        *response_entries(name, errors, measured, words),
        *_band_entries(name, figures, measured),
        entry(name, "phase_margin", "deg", phase, measured.phase_margin),
        *(_confirmed(name, item) for item in confirmed),
    ]
    if figures.peaks is not None:
        peaks = figures.peaks
        rows.append(entry(name, "sensitivity_peak", "dB", peaks.sensitivity_db, measured.sensitivity_peak))
        T = peaks.complementary_db
        if measured.no_dc:
            rows.append(not_judged(name, "complementary_peak", "dB", T, None, measured.no_dc))
        else:
            rows.append(entry(name, "complementary_peak", "dB", T, measured.complementary_peak))
    rows = [_unless_hidden(row, figures, measured) for row in rows]
    rows += _step_entries(name, figures, measured)
    return [replace(row, condition=words) if row.condition == SMALL else row for row in rows]


RESPONSES = {"response_open": "open_loop", "response_closed": "closed_loop"}


def response_entries(
    name: str, errors: Sequence[SweepErrors], measured: Measured, condition: str
) -> list[Entry]:
    """The worst point of each response: its distance from the linear one, over what that point may be off."""
    rows = []
    valid = measured.sweep.valid
    for (quantity, response), error in zip(RESPONSES.items(), errors, strict=False):
        off = np.hypot(error.gain_db / DECIBEL, np.radians(error.phase_deg))
        may = allowed(measured.point_error[response], 1.0)
        fine = valid & (may < COARSE["%"] / 100.0)
        if not fine.any():
            if valid.any():
                why = "no point is measured better than to its own rounding"
                rows.append(not_judged(name, quantity, "%", 0.0, None, why, condition))
            continue
        off, may = off[fine], may[fine]
        k = int(np.argmax(off / may))
        hertz = measured.sweep.frequency_hz[fine][k]
        passed = bool(off[k] <= may[k])
        where = f"worst at {hertz:.3g} Hz, of {off.size} frequencies"
        rows.append(Entry(name, quantity, "%", condition, 0.0, 100.0 * off[k], 100.0 * may[k], passed, where))
    return rows


def _unless_hidden(row: Entry, figures: LoopFigures, measured: Measured) -> Entry:
    """An entry, not judged where the frequencies that decide it could not be measured."""
    sweep = measured.sweep
    if row.passed is None or "margin_" in row.quantity or row.quantity in ("delay_margin", *RESPONSES):
        return row
    if measured.cut:
        return replace(row, passed=None, tolerance=inf, reason=f"{measured.cut}: no time left to measure it")
    if row.passed:
        return row
    band, peaks, margins = figures.bandwidth, figures.peaks, figures.margins
    at = {
        "bandwidth": hertz(band.minus3db_rad_s) if band else None,
        "bandwidth_90deg": hertz(band.minus90deg_rad_s) if band else None,
        "resonance_peak": band.resonance_hz if band else None,
        "resonance": band.resonance_hz if band else None,
        "phase_margin": None if margins.phase_margin is None else margins.phase_margin.frequency_hz,
        "sensitivity_peak": hertz(peaks.sensitivity_rad_s) if peaks else None,
        "complementary_peak": hertz(peaks.complementary_rad_s) if peaks else None,
    }[row.quantity]
    f, bad = sweep.frequency_hz, ~sweep.valid
    if at is not None and at < f[0]:
        return replace(
            row, passed=None, tolerance=inf, reason=f"below the lowest frequency measured, {f[0]:.3g} Hz"
        )
    if at is not None and at > f[-1]:
        why = f"above the highest frequency measured, {f[-1]:.4g} Hz"
        return replace(row, passed=None, tolerance=inf, reason=why)
    k = int(np.searchsorted(f, at or f[-1]))
    near = bad[max(k - NEIGHBOURS, 0) : k + NEIGHBOURS]
    if not near.any():
        return row
    why = most_frequent(sweep.reason) or "beyond the frequencies measured"
    return replace(row, passed=None, tolerance=inf, reason=f"could not be measured there: {why}")


def point_entries(name: str, confirmed: Sequence[Confirmation]) -> list[Entry]:
    """Margins at a break point with all other loops closed."""
    return [_confirmed(name, item) for item in confirmed]


def _band_entries(name: str, figures: LoopFigures, measured: Measured) -> list[Entry]:
    """Bandwidths and resonance."""
    band = figures.bandwidth
    if band is None:
        return [not_judged(name, "bandwidth", "Hz", None, measured.bandwidth.value, _why(figures))]
    if measured.no_dc:
        return [not_judged(name, "bandwidth", "Hz", hertz(band.minus3db_rad_s), None, measured.no_dc)]
    if band.resonance_peak_db > NO_DC_DB:
        why = "the loop has no gain at zero frequency that bandwidth and resonance could be related to"
        return [not_judged(name, "bandwidth", "Hz", None, None, why)]
    fall, turn = hertz(band.minus3db_rad_s), hertz(band.minus90deg_rad_s)
    top = measured.sweep.frequency_hz[-1]
    rows = [
        entry(name, "bandwidth", "Hz", _within(fall, top), measured.bandwidth),
        entry(name, "bandwidth_90deg", "Hz", _within(turn, top), measured.minus90deg),
        entry(name, "resonance_peak", "dB", band.resonance_peak_db, measured.resonance_peak),
    ]
    if band.resonance_peak_db > 0.05:
        rows.append(entry(name, "resonance", "Hz", band.resonance_hz, measured.resonance))
    return rows


def _within(value: float | None, top: float) -> float | None:
    """A predicted frequency, if the sweep reaches it."""
    return value if value is not None and value <= top else None


def _why(figures: LoopFigures) -> str:
    return "; ".join(figures.notes) or "no such figure"


def _step_entries(name: str, figures: LoopFigures, measured: Measured) -> list[Entry]:
    """Rise, overshoot and settling; times are those of samples."""
    step, seen = figures.step, measured.step
    if step is None or seen.reason:
        return [not_judged(name, "rise_time", "s", None, None, seen.reason or _why(figures))]
    sample = step.period_s or 0.0  # both are read at samples: a level met at one may be met at the next
    over = Reading(seen.overshoot_percent, 100.0 * seen.error)
    return [
        entry(
            name,
            "rise_time",
            "s",
            step.rise_time_s,
            Reading(seen.rise_time_s, seen.rise_error_s),
            least=sample,
        ),
        entry(name, "overshoot", "%", step.overshoot_percent, over, least=100.0 * PREDICTED),
        entry(
            name,
            "settling_time",
            "s",
            step.settling_time_s,
            Reading(seen.settling_time_s, seen.settling_error_s),
            least=sample,
        ),
    ]


def to_the_command(design: Design) -> str:
    """What a response to the command holds beside the loop, in words."""
    place = design.controller.position
    shares = (
        ()
        if place is None
        else (place.feedforward, place.acceleration_feedforward, place.friction_feedforward)
    )
    return "the command (with feed-forward)" if any(shares) else "the command"


def command_entry(design: Design, sweep: Sweep, system: Any, slowest_ticks: float) -> Entry:
    """The response to the command, with feed-forward and filters, at its worst point.

    ``slowest_ticks`` is the time constant of the slowest mode: what the last window still holds of it.
    """
    loop = design.controller.outermost
    words = f"response to {to_the_command(design)}, small signal"
    valid = sweep.valid
    if not valid.any():
        why = f"no frequency could be measured: {most_frequent(sweep.reason)}"
        return not_judged(loop, "response_command", "%", 0.0, None, why, words)
    off = np.abs(sweep.closed_loop[valid] / linear_response(system, sweep.frequency_hz[valid]) - 1.0)
    if sweep.error is not None:
        own = sweep.error[valid]
    else:
        tick_s = design.controller.period_s
        window = coherent(sweep.frequency_hz[valid], tick_s, round(sweep.period_s / tick_s)).ticks
        own = carried_on(sweep.unsteadiness[valid], window, max(slowest_ticks, 1.0))
    may = allowed(own + ROUNDING, 1.0)
    k = int(np.argmax(off / may))
    hertz = sweep.frequency_hz[valid][k]
    where = f"worst at {hertz:.3g} Hz, of {off.size} frequencies"
    passed = bool(off[k] <= may[k])
    row = (100.0 * float(off[k]), 100.0 * float(may[k]))
    return Entry(loop, "response_command", "%", words, 0.0, *row, passed, where)


QUANTITY = {
    "gain up": ("gain_margin_up", "dB"),
    "gain down": ("gain_margin_down", "dB"),
    "delay": ("delay_margin", "s"),
    "computing delay": ("computing_delay_margin", "s"),
}


def _confirmed(name: str, item: Confirmation) -> Entry:
    """A margin confirmed in time, in dB or s."""
    quantity, unit = QUANTITY[item.kind]
    words = f"{SMALL}, {item.condition}"
    if item.border.unknown:
        value = _in_unit(item.predicted, item)
        return not_judged(name, quantity, unit, value, None, item.border.unknown, words)
    values = [_in_unit(value, item) for value in (item.predicted, item.border.value)]
    if "delay" in item.kind and values[1] is None and (item.predicted or 0.0) > 0.9 * LONGEST_DELAY_SAMPLES:
        why = f"longer than the instrument's longest delay of {LONGEST_DELAY_SAMPLES:.0f} samples"
        return not_judged(name, quantity, unit, values[0], None, why, words)
    error = item.error * (DECIBEL if unit == "dB" else values[0] or 0.0)
    least = DECIBEL * PREDICTED if unit == "dB" else 0.0
    row = entry(name, quantity, unit, values[0], Reading(values[1], error), words, least)
    if row.passed and row.predicted is None:
        furthest = max(item.border.bracket)
        far = max(furthest, 1.0 / min(item.border.bracket)) if unit == "dB" else furthest
        text = f"{20.0 * log10(far):.0f} dB" if unit == "dB" else f"{far * item.period_s:.3g} s"
        return replace(row, reason=f"predicted and found: none within {text}")
    return row


def _in_unit(value: float | None, item: Confirmation) -> float | None:
    if value is None or value <= 0.0:
        return None
    return 20.0 * log10(value) if item.kind.startswith("gain") else value * item.period_s


def not_judged(
    loop: str,
    quantity: str,
    unit: str,
    predicted: float | None,
    measured: float | None,
    reason: str,
    condition: str = SMALL,
) -> Entry:
    """A prediction that cannot be held to, with the reason."""
    return Entry(loop, quantity, unit, condition, predicted, measured, inf, None, reason)
