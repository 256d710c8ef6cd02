"""The ledger: every linear prediction beside the value that the nonlinear simulator shows.

A prediction is judged where it claims to hold: small signals on a constant speed.  From rest, with dry
friction and at the amplitudes that the design names, it is shown as well, with the reason why it need not
hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, log10

import numpy as np

from analyses.loop_figures import LoopFigures
from analyses.validation.borders import LONGEST_DELAY_SAMPLES
from analyses.validation.confirm import Confirmation
from analyses.validation.figures import Measured, hertz, most_frequent

SMALL = "feedback loop, small signal, on a constant speed"
LOCKED = "feedback loop, small signal, rotor held at a constant speed"
RELATIVE = 1e-3
GAIN_DB = 0.01
PHASE_DEG = 0.1
NO_DC_DB = 100.0  # so far above its value at zero frequency: that is none
NEIGHBOURS = 3  # points on either side of a figure's frequency that it is read from
MARGIN_DB = 20.0 * log10(1.0 + RELATIVE)
OVERSHOOT_PERCENT = 0.05


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
        Allowed difference, in the unit.
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
    loop: str, quantity: str, unit: str, predicted: float | None, measured: float | None, tolerance: float
) -> Entry:
    """A prediction that is judged: agreement within the tolerance, or in that there is no such value."""
    known = [None if x is None or not isfinite(x) else float(x) for x in (predicted, measured)]
    reason = ""
    if known[0] is None and known[1] is None:
        passed, reason = True, "predicted and measured: there is none"
    elif known[0] is None or known[1] is None:
        passed = False
        reason = "not predicted, but measured" if known[0] is None else "predicted, but not found"
    else:
        passed = abs(known[1] - known[0]) <= tolerance * (1.0 + 1e-9)
    return Entry(loop, quantity, unit, SMALL, known[0], known[1], tolerance, passed, reason)


def loop_entries(
    name: str, figures: LoopFigures, found: Measured, confirmed: Sequence[Confirmation]
) -> list[Entry]:
    """Everything predicted of one loop."""
    margins = figures.margins
    phase = None if margins.phase_margin is None else margins.phase_margin.deg
    rows = [
        *_band_entries(name, figures, found),
        entry(name, "phase_margin", "deg", phase, found.phase_margin_deg, PHASE_DEG),
        *(_confirmed(name, item) for item in confirmed),
    ]
    if figures.peaks is not None:
        peaks = figures.peaks
        rows.append(
            entry(
                name, "sensitivity_peak", "dB", peaks.sensitivity_db, found.sensitivity_peak_db, _peak(found)
            )
        )
        T = peaks.complementary_db
        rows.append(entry(name, "complementary_peak", "dB", T, found.complementary_peak_db, _peak(found)))
    rows = [_unless_hidden(row, figures, found) for row in rows]
    rows += _step_entries(name, figures, found)
    if name == "current":
        rows = [replace(row, condition=LOCKED) for row in rows]
    return rows


def _peak(found: Measured) -> float:
    """Tolerance of a maximum: that of a gain, and what its own last refinement still changed."""
    return GAIN_DB + 2.0 * found.peak_error_db


def _unless_hidden(row: Entry, figures: LoopFigures, found: Measured) -> Entry:
    """An entry, not judged where the frequencies that decide it could not be measured."""
    sweep = found.sweep
    if row.passed is not False or "margin_" in row.quantity or row.quantity == "delay_margin":
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
    k = int(np.searchsorted(f, at or f[-1]))
    near = bad[max(k - NEIGHBOURS, 0) : k + NEIGHBOURS]
    if not near.any():
        return row
    why = most_frequent(sweep.reason) or "beyond the frequencies measured"
    return replace(row, passed=None, tolerance=inf, reason=f"could not be measured there: {why}")


def point_entries(name: str, confirmed: Sequence[Confirmation]) -> list[Entry]:
    """Margins at a break point with all other loops closed."""
    return [_confirmed(name, item) for item in confirmed]


def _band_entries(name: str, figures: LoopFigures, found: Measured) -> list[Entry]:
    """Bandwidths and resonance."""
    band = figures.bandwidth
    if band is None:
        return [not_judged(name, "bandwidth", "Hz", None, found.bandwidth_hz, _why(figures))]
    if band.resonance_peak_db > NO_DC_DB:
        why = "the loop has no gain at zero frequency that bandwidth and resonance could be related to"
        return [not_judged(name, "bandwidth", "Hz", None, None, why)]
    fall, turn = hertz(band.minus3db_rad_s), hertz(band.minus90deg_rad_s)
    top = found.sweep.frequency_hz[-1]
    rows = [
        entry(name, "bandwidth", "Hz", _within(fall, top), found.bandwidth_hz, RELATIVE * (fall or 0.0)),
        entry(
            name, "bandwidth_90deg", "Hz", _within(turn, top), found.minus90deg_hz, RELATIVE * (turn or 0.0)
        ),
        entry(name, "resonance_peak", "dB", band.resonance_peak_db, found.resonance_db, _peak(found)),
    ]
    if band.resonance_peak_db > 0.05:
        at = band.resonance_hz
        rows.append(entry(name, "resonance", "Hz", at, found.resonance_hz, 10.0 * RELATIVE * at))
    return rows


def _within(value: float | None, top: float) -> float | None:
    """A predicted frequency, if the sweep reaches it."""
    return value if value is not None and value <= top else None


def _why(figures: LoopFigures) -> str:
    return "; ".join(figures.notes) or "no such figure"


def _step_entries(name: str, figures: LoopFigures, found: Measured) -> list[Entry]:
    """Rise, overshoot and settling; times are those of samples."""
    step, seen = figures.step, found.step
    if step is None or seen.reason:
        return [not_judged(name, "rise_time", "s", None, None, seen.reason or _why(figures))]
    sample = 1.01 * (step.period_s or 0.0)
    return [
        entry(name, "rise_time", "s", step.rise_time_s, seen.rise_time_s, sample),
        entry(name, "overshoot", "%", step.overshoot_percent, seen.overshoot_percent, OVERSHOOT_PERCENT),
        entry(name, "settling_time", "s", step.settling_time_s, seen.settling_time_s, sample),
    ]


QUANTITY = {
    "gain up": ("gain_margin_up", "dB"),
    "gain down": ("gain_margin_down", "dB"),
    "delay": ("delay_margin", "s"),
    "computing delay": ("computing_delay_margin", "s"),
}


def _confirmed(name: str, item: Confirmation) -> Entry:
    """A margin confirmed in time, in dB or s."""
    quantity, unit = QUANTITY[item.kind]
    if item.border.unknown:
        value = _in_unit(item.predicted, item)
        return not_judged(name, quantity, unit, value, None, item.border.unknown)
    values = [_in_unit(value, item) for value in (item.predicted, item.border.value)]
    if "delay" in item.kind and values[1] is None and (item.predicted or 0.0) > 0.9 * LONGEST_DELAY_SAMPLES:
        why = f"longer than the instrument's longest delay of {LONGEST_DELAY_SAMPLES:.0f} samples"
        return not_judged(name, quantity, unit, values[0], None, why)
    tolerance = MARGIN_DB
    if unit == "s":
        tolerance = (item.tolerance + item.instrument_error) * (values[0] or 0.0)
    row = entry(name, quantity, unit, values[0], values[1], tolerance)
    if row.passed and row.predicted is None:
        reach = max(item.border.bracket)
        far = max(reach, 1.0 / min(item.border.bracket)) if unit == "dB" else reach
        text = f"{20.0 * log10(far):.0f} dB" if unit == "dB" else f"{far * item.period_s:.3g} s"
        return Entry(*_fields(row), f"predicted and found: none within {text}")
    return row


def _fields(row: Entry) -> tuple[str, str, str, str, float | None, float | None, float, bool | None]:
    """All but the reason."""
    return (
        row.loop,
        row.quantity,
        row.unit,
        row.condition,
        row.predicted,
        row.measured,
        row.tolerance,
        row.passed,
    )


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
