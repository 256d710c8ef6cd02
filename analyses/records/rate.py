"""The recorded speed against the rate of the recorded position, and the clock that these or the tick tell."""

from dataclasses import dataclass
from math import inf

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.types import Floats, Mask
from analyses.records.compared import COSINE, LEAST_ROWS, bounds, place_of, ratio_of, smooth, thinned
from analyses.records.factors import with_factor
from analyses.records.finding import RATE_TOLERANCE, SURE, Finding
from analyses.records.naming import KNOWN_UNITS, PLACES, RATES
from analyses.records.record import HELD, Record

TICK_TOLERANCE = 1e-3
IN_MOTION = 0.05


@dataclass(frozen=True)
class RateRatio:
    """A recorded speed over the rate of the recorded position, and the interval that noise of both leaves."""

    place: str  # the position's signal
    found: float  # the ratio
    cosine: float  # the cosine
    low: float  # Frisch's bounds: each regressed on the other, with the error of each
    high: float
    rate: Floats
    moves: Mask

    @property
    def doubt(self) -> float:
        """The share by which they disagree, 0 where noise explains it."""
        return 0.0 if self.low <= 1.0 <= self.high else self.found - 1.0


def rate_ratio(design: Design, record: Record) -> RateRatio | None:
    """Speed against the rate of the position; None where one of them is not recorded, or nothing moves."""
    place, name = place_of(design, record), RATES[design.axis]
    if place is None or name not in record.signals:
        return None
    # over each interval the same filter on both, the slope first: they agree up to the ends, and a motion
    # that begins with the record counts; a speed that jumps inside an interval lies between its two samples
    rate = smooth(record, np.diff(place[1]) / np.diff(record.time_s))
    if not np.any(rate):
        return None
    first, last = (smooth(record, values) for values in (record[name][:-1], record[name][1:]))
    speed = 0.5 * (first + last)
    # in a long rest there is nothing but noise
    moves = np.any([np.abs(one) > IN_MOTION * np.max(np.abs(one)) for one in (rate, speed)], axis=0)
    found, cosine = ratio_of(speed[moves], rate[moves])
    low, high = -inf, inf
    x, y = (thinned(record, values) for values in (rate, speed))
    if abs(cosine) >= COSINE and found > 0.0 and len(x) >= LEAST_ROWS:
        bent = np.gradient(np.gradient(rate)) / 12.0  # what a straight line between two samples leaves out
        between = sum(abs(ratio_of(off[moves], rate[moves])[0]) for off in (0.5 * (last - first), bent))
        low, high = bounds(y, x, np.gradient(x), np.gradient(y))
        low, high = low - between, high + between
    return RateRatio(place[0], found, cosine, low, high, rate, moves)


def rate_finding(ratio: RateRatio | None, design: Design, record: Record) -> Finding | None:
    name = RATES[design.axis]
    if ratio is None:
        return _still(design, record)
    subject, off = f"{name} against the rate of the {ratio.place}", ratio.found - 1.0
    if abs(ratio.cosine) < COSINE:
        why = f"they are not alike (cosine {ratio.cosine:.2f})"
        rest = [other for other in record.signals if other not in (name, *PLACES)]
        likes = {other: smooth(record, record[other][1:])[ratio.moves] for other in rest}
        swapped = (n for n, one in likes.items() if abs(ratio_of(one, ratio.rate[ratio.moves])[1]) > 0.97)
        if other := next(swapped, ""):
            why += f"; {other} is: are the columns of {name} and {other} swapped?"
        return Finding(subject, False, why)
    said = f"the {name} is {ratio.found:.4g} times the rate of the {ratio.place}"
    if not ratio.doubt and abs(off) <= 0.5:
        return Finding(subject, True, f"{said}: one clock, one scale")
    clock = f"{said}: a clock {100.0 * off:+.2g} % off, or the scale of one of them"
    if abs(off) <= RATE_TOLERANCE:
        noise = f"beyond their noise ({ratio.low:.4f} to {ratio.high:.4f})"
        return Finding(subject, None, f"{clock}, {noise}: the intervals hold it", done="widened")
    named = with_factor(said, ratio.found, {design.total_ratio: f"the reduction {design.total_ratio:g}"})
    return Finding(subject, False, clock if named == said else named)


def _still(design: Design, record: Record) -> Finding | None:
    """A position that stands still while the speed says, beyond its noise, that it moves."""
    place, name = place_of(design, record), RATES[design.axis]
    if place is None or name not in record.signals or np.ptp(place[1]):
        return None
    speed = record[name]
    travel = record.period_s * float(np.ptp(np.cumsum(speed)))
    noise = record.period_s * float(np.std(np.diff(speed))) * np.sqrt(0.5 * len(record))
    if travel <= SURE * noise:
        return None
    moved = f"{travel:.3g} {KNOWN_UNITS[place[0]]}"
    text = f"the {place[0]} stands still, by the {name} it moves by {moved}: another column?"
    return Finding(f"{name} against the rate of the {place[0]}", False, text)


def clock_doubt(design: Design, record: Record, rate: RateRatio | None = None) -> float:
    """The share by which a record's clock may be off: of its speed, or of its period from whole ticks."""
    if (rate := rate or rate_ratio(design, record)) is not None:
        return rate.doubt
    ticks, _ = ticks_a_row(design, record)
    off = ticks / max(round(ticks), 1) - 1.0
    return off if TICK_TOLERANCE < abs(off) <= RATE_TOLERANCE and record.averaged == 1 else 0.0


def clock_finding(design: Design, record: Record) -> Finding | None:
    """Where no speed is recorded beside the position, only the tick tells of a clock that is off."""
    if place_of(design, record) is not None and RATES[design.axis] in record.signals:
        return None
    ticks, whole = ticks_a_row(design, record)
    if ticks < 1.0 - TICK_TOLERANCE or record.averaged > 1:
        return None
    subject = "sampling period against the drive's tick"
    if whole:
        why = f"{round(ticks)} tick(s); a clock that is off by a whole number of them is not seen here"
        return Finding(subject, True, why)
    text = f"{ticks:.5g} ticks: another recorder's clock, or one that is off"
    return Finding(subject, None, text + ": the intervals hold it" * bool(clock_doubt(design, record)))


def ticks_a_row(design: Design, record: Record) -> tuple[float, bool]:
    """Ticks of the drive from row to row, and whether they are a whole number."""
    ticks = record.period_s / design.controller.period_s
    return ticks, abs(ticks - round(ticks)) <= TICK_TOLERANCE * ticks


def one_phase(design: Design, record: Record) -> bool:
    """Whether all samples are at one phase of a loop that runs every so many ticks, where the voltage kicks.

    Or of a command that is held from row to row. What the winding had between two samples is then not the
    voltage at them.
    """
    ticks, whole = ticks_a_row(design, record)
    loops = design.controller.velocity, design.controller.position
    rates = [loop.every for loop in loops if loop is not None and loop.every > 1]
    held = record.between == HELD or any(round(ticks) % n == 0 for n in rates)
    return whole and ticks > 1.5 and record.averaged <= 1 and held
