"""Does a record agree with itself and with the drive it is said to come from?"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, isfinite

import numpy as np
from scipy.signal import sosfiltfilt

from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Mask
from analyses.estimation.least_squares import solve
from analyses.estimation.parameters import own_share
from analyses.records.differentiation import butterworth
from analyses.records.driven_motion import COSINE, ratio_of, turned_current, wrong_time, wrong_time_of_speed
from analyses.records.factors import explaining, named_factor, with_factor
from analyses.records.naming import LOADS, RATES
from analyses.records.record import DISORDER, HELD, Record, stretches
from analyses.records.single_rows import (
    NORMAL,
    count_of,
    impossible_steps,
    named_rows,
    noise_bound,
    place_in_file,
)

RATE_TOLERANCE = 0.02  # of speed over rate: above, no design is made; below, it widens the intervals
NO_CHANCE = 1e-3  # level at which chance is rejected
SURE = 4.0  # standard errors beyond which noise explains no difference: by chance in one look of 16 000
TICK_TOLERANCE = 1e-3
ONE_PHASE = (
    "not told: every sample is at the same tick of a loop that runs every so many, or of a command held from "
    "row to row, where the voltage kicks; between them it is not known, nor whether R or the scale of the "
    "current is off"
)
OVER = 1.2
ROWS = "rows of the file"
FEW_ROWS = 1e-3  # of a record: single ones; of more the unit is wrong, not the row
BAD_ROW = "bad rows, take them out of the file"
SMOOTH_HZ = 20.0
IN_MOTION = 0.05
LEAST_ROWS = 10  # smoothed and thinned, of a comparison
STEADY = 0.1  # relative difference of steps of the position beside a row that is missing or filled in
COPPER_1_K = 3.93e-3
WINDING_K = (-75.0, 160.0)  # from 20 deg C, the coldest and hottest winding: -55 to 180 deg C, class H
FOLLOWED = (
    ("position_reference", "position"),
    ("reference", "output_angle"),
    ("reference", "angle"),
    ("output_speed_reference", "speed"),
    ("speed_reference", "speed"),
    ("velocity_reference", "velocity"),
    ("current_reference", "current"),
    ("voltage_reference", "voltage"),
)


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    passed: bool | None  # whether it agrees; None: not determined
    text: str
    unproven: bool = field(default=False, repr=False)  # not determined, so that it is open whether it agrees
    done: str = ""  # what was done about it where it does not agree: put right, or held by the intervals


def wrong_of(findings: Sequence[Finding]) -> str:
    """What contradicts, in words; empty where nothing does."""
    return "; ".join(f"{one.subject}: {one.text}" for one in findings if one.passed is False)


def left_out_of(findings: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Sentences on rows that no result rests on, by record."""
    return [f"{name}: {one.text}." for name, each in findings.items() for one in each if one.subject == ROWS]


@contextmanager
def because(findings: Mapping[str, Sequence[Finding]]) -> Iterator[None]:
    """What is wrong with the records comes before what is refused inside."""
    try:
        yield
    except InputError as error:
        said = "; ".join(f"{name}: {why}" for name, one in findings.items() if (why := wrong_of(one)))
        raise InputError(f"{said}; so {error}") if said else error from None


def check_record(design: Design, record: Record) -> tuple[Finding, ...]:
    """Hold a record against itself and against the limits of the design.

    Looked at, where recorded: the speed against the rate of the angle (this also tells a clock that is off),
    angle and output angle against the reduction, voltage against ``R i + kE w``, the command against what
    followed it, and current, speed, voltage, supply and load against the design's limits. A ratio that a
    known factor explains is named.
    """
    design, as_read = record.drive(design), record.as_read or record
    ratio = rate_ratio(design, record)
    rate, electrical = partial(_rate, ratio), partial(_electrical, abs(clock_doubt(design, record, ratio)))
    checks = (rate, _still, _time, _clock, _reduction, electrical, _sign, _load, _command, _supply)
    steps = _steps(design, record)  # a row that is lost at full speed looks like a jump
    steps = steps if steps and steps.passed is False else _jumps(design, as_read) or steps
    found = (
        _rows(as_read),
        steps,
        _frozen(design, as_read),
        *(check(design, record) for check in checks),
        *_limits(design, as_read),
    )
    return tuple(result for result in found if result is not None)


def place_of(design: Design, record: Record) -> tuple[str, Floats] | None:
    """The position at the motor and the signal that it comes from; None where none is recorded."""
    for name in ("position",) if design.axis == "linear" else ("angle", "output_angle"):
        if name in record.signals:
            return name, record[name] * (design.total_ratio if name == "output_angle" else 1.0)
    return None


def _smooth(record: Record, values: Floats) -> Floats:
    """A signal without its fast part, no phase; the same filter for all signals that are compared."""
    share = 2.0 * SMOOTH_HZ * record.period_s
    if share >= 0.5 or len(values) < 60:
        return values
    return np.asarray(sosfiltfilt(butterworth(2, share, output="sos"), values, padtype="even"))


def _inner(record: Record) -> slice:
    """Without the twentieth part at both ends, where a filter starts and stops."""
    return slice(len(record) // 20, len(record) - len(record) // 20)


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
    rate = _smooth(record, np.diff(place[1]) / np.diff(record.time_s))
    if not np.any(rate):
        return None
    first, last = (_smooth(record, values) for values in (record[name][:-1], record[name][1:]))
    speed = 0.5 * (first + last)
    # in a long rest there is nothing but noise
    moves = np.any([np.abs(one) > IN_MOTION * np.max(np.abs(one)) for one in (rate, speed)], axis=0)
    found, cosine = ratio_of(speed[moves], rate[moves])
    low, high = -inf, inf
    x, y = (_thinned(record, values) for values in (rate, speed))
    if abs(cosine) >= COSINE and found > 0.0 and len(x) >= LEAST_ROWS:
        bent = np.gradient(np.gradient(rate)) / 12.0  # what a straight line between two samples leaves out
        between = sum(abs(ratio_of(off[moves], rate[moves])[0]) for off in (0.5 * (last - first), bent))
        low, high = _bounds(y, x, np.gradient(x), np.gradient(y))
        low, high = low - between, high + between
    return RateRatio(place[0], found, cosine, low, high, rate, moves)


def _thinned(record: Record, values: Floats) -> Floats:
    """As many rows of a smoothed signal as the filter leaves."""
    return values[:: max(1, round(0.25 / (SMOOTH_HZ * record.period_s)))]


def _bounds(y: Floats, x: Floats, beside_x: Floats, beside_y: Floats) -> tuple[float, float]:
    """What y may be over x with noise in either: each regressed on the other, `SURE` errors wide (Frisch).

    Another signal stands beside the regressor: its own slope takes up a delay between the two.
    """

    def ends(of: Floats, over: Floats, beside: Floats) -> tuple[float, float]:
        w = np.column_stack([over, beside])
        size = np.linalg.norm(w, axis=0)
        result = solve(w / size, of)
        slope, error = result.values[0] / size[0], np.sqrt(result.correlated[0, 0]) / size[0]
        return float(slope - SURE * error), float(slope + SURE * error)

    low, high = ends(x, y, beside_y)
    if low <= 0.0 <= high:
        return -inf, inf
    all_ends = (*ends(y, x, beside_x), 1.0 / low, 1.0 / high)
    return min(all_ends), max(all_ends)


def _rate(ratio: RateRatio | None, design: Design, record: Record) -> Finding | None:
    name = RATES[design.axis]
    if ratio is None:
        return None
    subject, off = f"{name} against the rate of the {ratio.place}", ratio.found - 1.0
    if abs(ratio.cosine) < COSINE:
        why = f"they are not alike (cosine {ratio.cosine:.2f})"
        rest = [other for other in record.signals if other not in (name, "angle", "output_angle", "position")]
        likes = {other: _smooth(record, record[other][1:])[ratio.moves] for other in rest}
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
    speed, unit = record[name], "m" if design.axis == "linear" else "rad"
    travel = record.period_s * float(np.ptp(np.cumsum(speed)))
    noise = record.period_s * float(np.std(np.diff(speed))) * np.sqrt(0.5 * len(record))
    if travel <= SURE * noise:
        return None
    text = f"the {place[0]} stands still, by the {name} it moves by {travel:.3g} {unit}: another column?"
    return Finding(f"{name} against the rate of the {place[0]}", False, text)


def clock_doubt(design: Design, record: Record, rate: RateRatio | None = None) -> float:
    """The share by which a record's clock may be off: of its speed, or of its period from whole ticks."""
    if (rate := rate or rate_ratio(design, record)) is not None:
        return rate.doubt
    ticks, _ = _ticks_a_row(design, record)
    off = ticks / max(round(ticks), 1) - 1.0
    return off if TICK_TOLERANCE < abs(off) <= RATE_TOLERANCE and record.averaged == 1 else 0.0


def _ticks_a_row(design: Design, record: Record) -> tuple[float, bool]:
    """Ticks of the drive from row to row, and whether they are a whole number."""
    ticks = record.period_s / design.controller.period_s
    return ticks, abs(ticks - round(ticks)) <= TICK_TOLERANCE * ticks


def _time(design: Design, record: Record) -> Finding | None:
    """A unit of the time that the lag behind the command tells, or what a current accelerates."""
    place = place_of(design, record)
    if place is not None and (why := wrong_time(design, record, place[1])):
        return Finding("time against the lag behind the command", False, why)
    why = wrong_time_of_speed(design, record)
    return Finding("time against the current", False, why) if why else None


def _sign(design: Design, record: Record) -> Finding | None:
    """A current that would drive the other way; with a voltage, that says of which signal the sign is."""
    place, rate = place_of(design, record), record.signals.get(RATES[design.axis])
    speed = rate if place is None else np.gradient(place[1], record.time_s)
    if speed is None or "current" not in record.signals or "voltage" in record.signals:
        return None
    why = turned_current(design, record, *(_smooth(record, one) for one in (record["current"], speed)))
    return Finding("current against the motion", False, why) if why else None


def _clock(design: Design, record: Record) -> Finding | None:
    """Where no speed is recorded beside the position, only the tick tells of a clock that is off."""
    if place_of(design, record) is not None and RATES[design.axis] in record.signals:
        return None
    ticks, whole = _ticks_a_row(design, record)
    if ticks < 1.0 - TICK_TOLERANCE or record.averaged > 1:
        return None
    subject = "sampling period against the drive's tick"
    if whole:
        why = f"{round(ticks)} tick(s); a clock that is off by a whole number of them is not seen here"
        return Finding(subject, True, why)
    text = f"{ticks:.5g} ticks: another recorder's clock, or one that is off"
    return Finding(subject, None, text + ": the intervals hold it" * bool(clock_doubt(design, record)))


def _rows(record: Record) -> Finding | None:
    """Rows left out as their time does not increase: more than single ones may be a run of their own."""
    lost, rows = record.counts.dropped.get(DISORDER, 0), record.counts.rows_in
    if lost <= FEW_ROWS * rows:
        return None
    why = f"{lost} of {rows} rows are left out, as their time does not increase"
    why += f" ({record.counts.first_dropped[DISORDER]}): another run? It needs a file of its own"
    return Finding(ROWS, None, why, unproven=True)


def _jumps(design: Design, record: Record) -> Finding | None:
    """Steps of the position that no speed within the limit makes in their time."""
    place, rate = place_of(design, record), OVER * reachable_speed(design)
    if place is None or not isfinite(rate) or record.averaged > 1:
        return None
    rows = impossible_steps(record, place[1], rate, SURE)
    if not len(rows):
        return None
    unit = "m" if design.axis == "linear" else "rad"
    jumps, few = named_rows(record, rows, place[0], unit, jumps=True), len(rows) <= FEW_ROWS * len(record)
    most = f"more than the speed limit, {reachable_speed(design):.4g} {unit}/s at the motor, allows"
    why = BAD_ROW if few else "is the unit of the position or of the time right?"
    turn = 2.0 * np.pi * (design.total_ratio if place[0] == "output_angle" else 1.0)
    off = np.abs(np.abs(np.diff(place[1])) - turn)[rows - 1]
    if design.axis == "rotary" and np.all(off <= rate * np.diff(record.time_s)[rows - 1]):
        why = "it begins anew with each turn: count the turns on (numpy.unwrap)"
    why = f"the {place[0]} jumps {jumps}: {most} in that time: {why}"
    return Finding(f"steps of the {place[0]} from row to row", False, why)


def _steps(design: Design, record: Record) -> Finding | None:
    """Rows that are missing though the time goes on, or filled in with the row before.

    Between steps of the position that are alike, two on either side, one is that of two rows or more; or one
    is nothing and the next that of two. Steps of less than ten counts of an encoder, or within noise, tell
    nothing. Of a number with so many digits the counts are coarser the larger it is: a count is the least
    step from there on outward.
    """
    place = place_of(design, record)
    if place is None or record.averaged > 1 or len(record) < LEAST_ROWS:
        return None
    step = np.diff(place[1]) / np.diff(record.time_s)
    rows = np.lib.stride_tricks.sliding_window_view(step, 6)
    inward = np.argsort(-np.maximum(np.abs(place[1][1:]), np.abs(place[1][:-1])), kind="stable")
    count = np.empty_like(step)
    count[inward] = np.minimum.accumulate(np.where(step == 0.0, inf, np.abs(step))[inward])

    def times_its_neighbours(at: int, beside: list[int]) -> tuple[Floats, int]:
        """A step of each row over those beside it, 0 where these are not alike; how many are."""
        mean, size = rows[:, beside].mean(axis=1), np.abs(rows[:, beside].mean(axis=1))
        cosine = np.all(np.abs(rows[:, beside] - mean[:, None]) < STEADY * size[:, None], axis=1)
        noise = NORMAL * float(np.median(np.abs(rows[:, at] - mean)))  # of a normal deviation
        cosine &= (STEADY * size > count[at : at + len(rows)]) & (0.5 * size > SURE * noise)
        share = np.divide(rows[:, at], mean, out=np.zeros(len(mean)), where=cosine)
        return share, int(np.count_nonzero(cosine))

    missing, places = times_its_neighbours(2, [0, 1, 3, 4])
    filled, _ = times_its_neighbours(3, [0, 1, 4, 5])
    lost = float(np.sum(np.round(missing[missing > 1.5]) - 1.0))
    copied = int(np.count_nonzero((rows[:, 2] == 0.0) & (filled > 1.5)))
    if not places:
        return None
    kinds = [f"{lost:.0f} rows are missing where the time goes on, or time stamps jitter"] if lost else []
    kinds += [f"{copied} rows repeat the one before"] if copied else []
    words = f"{' and '.join(kinds) or 'none is of two rows'}, of {places} places where the motion tells"
    words += ": take the record again, or give the times at which rows were taken" if kinds else ""
    return Finding(f"steps of the {place[0]} from row to row", not kinds, words)


def _reduction(design: Design, record: Record) -> Finding | None:
    if not {"angle", "output_angle"} <= set(record.signals) or design.axis == "linear":
        return None
    if not any(np.ptp(record[name]) > 0.0 for name in ("angle", "output_angle")):
        return None
    a, b = (record[name] - record[name].mean() for name in ("angle", "output_angle"))
    ratio, cosine = ratio_of(a, design.total_ratio * b)
    subject = "angle against output angle"
    if abs(cosine) < COSINE:
        return Finding(subject, False, "they are not alike")
    passed = abs(ratio - 1.0) <= RATE_TOLERANCE + _twist_share(design, record)
    text = f"the motor angle is {ratio:.4g} times the output angle and the reduction"
    if not passed:
        other = design.total_ratio * b
        slip = _slip(record, a - other, float(np.sum((a - ratio * other) ** 2)))
        text = slip or with_factor(text, ratio, {design.total_ratio: "the reduction, counted twice"})
    return Finding(subject, passed, text)


def _slip(record: Record, off: Floats, left: float) -> str:
    """One slip of an angle that is ``off`` another, where it leaves less squared than is ``left`` without."""
    rows = np.arange(1, len(off))
    before = np.cumsum(off)[:-1]
    taken = before**2 * len(off) / (rows * (len(off) - rows))
    k = int(np.argmax(taken))
    if float(off @ off) - taken[k] >= left:
        return ""
    by = -before[k] * len(off) / (rows[k] * (len(off) - rows[k]))
    where = place_in_file(record, k + 1)
    return f"the motor angle slips by {by:.3g} rad against the output angle, about {where}"


def _frozen(design: Design, record: Record) -> Finding | None:
    """A current that keeps a value longer than chance makes it, while the motion turns back.

    Not 0, as of a power stage that is off, nor at either end of its range, where a limit holds it.
    """
    at = record.signals.get("current")
    runs = [] if at is None or record.averaged > 1 else list(stretches(np.diff(at) == 0.0))
    if at is None or not runs:
        return None
    start, stop = max(runs, key=lambda run: run[1] - run[0])
    length, count = stop - start, len(at) - 1
    repeats = sum(end - begin for begin, end in runs) - length
    chance = count * ((repeats + 1.0) / (count - length + 2.0)) ** length  # Laplace's rule of succession
    held = np.ptp(at) > 0.0 and at[start] in (at.min(), at.max())
    if chance >= NO_CHANCE or at[start] == 0.0 or held or not _turns_back(design, record, start, stop + 1):
        return None
    why = f"the current is {at[start]:.4g} A in {length + 1} rows, from {place_in_file(record, start)} on"
    return Finding("current from row to row", False, f"{why}, while the motion turns back: frozen?")


def _turns_back(design: Design, record: Record, start: int, stop: int) -> bool:
    """Whether a record moves to and fro within some rows, by more than its noise and counts."""
    place, speed = place_of(design, record), record.signals.get(RATES[design.axis])
    if place is not None:
        part, bound = place[1][start:stop], 2.0 * noise_bound(place[1], SURE) + count_of(place[1])
        ends = part[[0, -1]]
        return bool(max(part.max() - ends.max(), ends.min() - part.min()) > bound)
    if speed is None:
        return False
    bound = noise_bound(speed, SURE)
    return bool(speed[start:stop].min() < -bound and speed[start:stop].max() > bound)


def _twist_share(design: Design, record: Record) -> float:
    """What play, largest moment and load's inertia twist the coupling by, over the output's motion, rms."""
    if design.coupling is None:
        return 0.0
    own = record["output_angle"]
    moment = float(np.max(np.abs(record["torque"]))) if "torque" in record.signals else 0.0
    moment = max(moment, float(np.max(np.abs(design.load.moment_Nm(own)))))
    slope = np.gradient(np.gradient(_smooth(record, own), record.time_s), record.time_s)
    moment += design.load.inertia_kgm2 * float(np.sqrt(np.mean(slope[_inner(record)] ** 2)))
    behind = design.ratio_behind_coupling
    twist = 0.5 * design.coupling.play_rad + design.coupling.stretch_rad(moment / behind)
    return twist / behind / max(float(np.std(own)), 1e-300)


def _electrical_parts(design: Design, record: Record) -> dict[str, tuple[float, float]]:
    """What R i and kE w count in a recorded voltage, each by its least and largest ratio to the design's.

    Where the record does not tell one from the other, their sum; empty without voltage, current and motion.
    """
    motor = design.effective_motor
    ohm, back = motor.resistance_ohm, motor.back_emf_constant_Vs_rad
    speed, place = record.signals.get("speed"), place_of(design, record)
    if speed is None and place is not None:
        speed = np.gradient(place[1], record.time_s)
    if ohm is None or back is None or speed is None or not {"voltage", "current"} <= record.signals.keys():
        return {}
    u, i, w = (_smooth(record, values) for values in (record["voltage"], record["current"], speed))
    if motor.inductance_H is not None:  # of a direct drive as large as the rest
        u = u - motor.inductance_H * np.gradient(i, record.period_s)
    u, i, w, late = (_thinned(record, one[_inner(record)]) for one in (u, i, w, np.gradient(w)))
    parts = np.column_stack([ohm * i, back * w])
    size, total = np.linalg.norm(parts, axis=0), parts.sum(axis=1)
    if len(u) < LEAST_ROWS or not np.any(total):
        return {}
    if np.all(size > 0.03 * np.linalg.norm(u)) and np.linalg.cond(parts / size) < 100.0:
        r, e = parts.T
        moved = np.column_stack([e, late])  # a filtered speed lacks what goes with the current's torque
        return {"R i": _bounds(u, r, moved, moved), "kE w": _bounds(u, e, r, r)}
    return {"R i + kE w": _bounds(u, total, np.gradient(total), np.gradient(u))}


def _electrical(doubt: float, design: Design, record: Record) -> Finding | None:
    """Voltage, current and motion through R, L and kE, at the accuracy of the signals and of the design.

    ``doubt`` is the share by which the clock may be off.
    """
    if not (finding := _voltage_says(design, record, doubt)):
        return None
    (passed, words), u, i = finding, record["voltage"], record["current"]
    for cause, changed in (
        ("the sign of the current is reversed", {"current": -i}),
        ("the sign of the voltage is reversed", {"voltage": -u}),
        ("the sign of the speed is reversed", {"voltage": -u, "current": -i}),
        ("the columns of current and voltage are swapped", {"voltage": i, "current": u}),
    ):
        other = replace(record, signals={**record.signals, **changed})
        if passed is False and (instead := _voltage_says(design, other, doubt)) and instead[0] is not False:
            return Finding("voltage against R i + kE w", False, f"{words}: {cause}")
    if passed is None and (stands := _standing_current(design, record)):
        passed, words = False, stands
    elif passed is not True and one_phase(design, record):
        return Finding("voltage against R i + kE w", None, f"{words}; {ONE_PHASE}", unproven=True)
    return Finding("voltage against R i + kE w", passed, words)


def _voltage_says(design: Design, record: Record, doubt: float) -> tuple[bool | None, str] | None:
    """Whether each part of the voltage counts once, and in words; None where nothing tells."""
    parts = _electrical_parts(design, record).items()
    findings = [_counted(design, name, *ends, doubt if name == "kE w" else 0.0) for name, ends in parts]
    each = [one for one, _ in findings]
    passed = False if False in each else None if None in each else True
    return (passed, "; ".join(words for _, words in findings)) if findings else None


def one_phase(design: Design, record: Record) -> bool:
    """Whether all samples are at one phase of a loop that runs every so many ticks, where the voltage kicks.

    Or of a command that is held from row to row. What the winding had between two samples is then not the
    voltage at them.
    """
    ticks, whole = _ticks_a_row(design, record)
    loops = design.controller.velocity, design.controller.position
    rates = [loop.every for loop in loops if loop is not None and loop.every > 1]
    held = record.between == HELD or any(round(ticks) % n == 0 for n in rates)
    return whole and ticks > 1.5 and record.averaged <= 1 and held


def _standing_current(design: Design, record: Record) -> str:
    """A current of one value throughout, where the voltage less kE w says that it moves as much; or empty."""
    at, speed = record["current"], record.signals.get("speed")
    if np.ptp(at) or not at[0] or speed is None or not np.any(speed) or design.motor.resistance_ohm is None:
        return ""
    u, w = (_smooth(record, values - values.mean()) for values in (record["voltage"], speed))
    moves = float(np.std(u - ratio_of(u, w)[0] * w)) / design.motor.resistance_ohm
    why = f"the current is {at[0]:.4g} A throughout, the voltage says that it moves by {moves:.2g} A rms"
    return why if moves > 0.5 * abs(at[0]) else ""


def resistance_doubt(design: Design, record: Record) -> float:
    """The share by which a current may be too small, where R counts other than the design's tolerance allows.

    A warmer winding or a wrong scale of the current: the record cannot tell.
    """
    if one_phase(design, record):
        return 0.0
    low, high = _electrical_parts(design, record).get("R i", (1.0, 1.0))
    agrees = not isfinite(low) or _counted(design, "R i", low, high)[0] is True
    return 0.0 if agrees else 0.5 * (low + high) - 1.0


def _counted(
    design: Design, name: str, low: float, high: float, doubt: float = 0.0
) -> tuple[bool | None, str]:
    """Whether a part of the voltage counts once, within what its data and the design's tolerance leave.

    ``doubt`` is the share by which the clock may be off.
    """
    if not isfinite(low):
        return None, f"{name} is not determined"
    key = "motor.back_emf_constant" if name == "kE w" else "motor.resistance"
    allowed, motor = SURE * own_share(design, key) + doubt, design.effective_motor
    if low <= 1.0 + allowed and high >= 1.0 - allowed:
        return True, f"{name} is {low:.3g} to {high:.3g} times as the design has it"
    ohm, back = motor.resistance_ohm or 0.0, motor.back_emf_constant_Vs_rad or 0.0
    held = {"R i": f" that of R = {ohm:.4g} ohm", "kE w": f" that of kE = {back:.4g} V s/rad"}
    text = f"{name} counts {low:.3g} to {high:.3g} times{held.get(name, '')}"
    ratio = 0.5 * (low + high)
    kelvin = (ratio - 1.0) / COPPER_1_K
    warm = name == "R i" and WINDING_K[0] < kelvin < WINDING_K[1]
    if warm:
        text += f": a winding {kelvin:+.0f} K from the design's, "
        text += f"or a current {1.0 / ratio:.3g} times the real"
    return (None if warm else False), with_factor(text, 1.0 / ratio if ratio > 0.0 else 0.0)


def _load(design: Design, record: Record) -> Finding | None:
    """A recorded load that goes with the current as its own torque: what the drive moves is against it."""
    name, constant = LOADS[design.axis], design.effective_motor.torque_constant_Nm_A
    if not {name, "current"} <= record.signals.keys() or not constant or not np.ptp(record[name]):
        return None
    load, torque = (_smooth(record, values) for values in (record[name], constant * record["current"]))
    for ratio in {1.0, design.total_ratio}:
        share, cosine = ratio_of(load, ratio * torque)
        if cosine > COSINE and abs(share - 1.0) <= SURE * own_share(design, "motor.torque_constant"):
            words = "kM i" if ratio == 1.0 else "kM i and the reduction"
            why = f"the {name} is {share:.4g} times {words}: the drive's own (leave the column out), "
            why += "or a load of turned sign: positive drives forward"
            return Finding("load against the current", False, why)
    return None


def _command(design: Design, record: Record) -> Finding | None:
    """A command that is followed at all is followed about one to one, unless a factor is wrong.

    Whether it is followed as the design's loops follow it, the simulation of the record tells.
    """
    for command, answer in FOLLOWED:
        # a step that begins with the record tells no ratio
        if not {command, answer} <= record.signals.keys() or not np.ptp(record[command]):
            continue
        output = (command, answer) in (("reference", "angle"), ("output_speed_reference", "speed"))
        values = record[answer] / (design.total_ratio if output else 1.0)
        ratio, cosine = ratio_of(*(part - part.mean() for part in (values, record[command])))
        subject = f"{answer} against its command"
        if abs(cosine) < 0.7:
            return Finding(subject, None, f"cosine {cosine:.2f}: not followed")
        factor = named_factor(ratio, {design.total_ratio: f"the reduction {design.total_ratio:g}"})
        followed = 0.5 < ratio < 1.5
        wrong = factor is not None and not followed
        text = f"{answer} is {ratio:.4g} times {command}" + f": factor {factor}" * wrong
        return Finding(subject, False if wrong else followed or None, text)
    return None


def _within(subject: str, record: Record, what: str, limit: float, unit: str) -> Finding | None:
    """The largest value of a signal against a limit of the design."""
    if what not in record.signals or not isfinite(limit) or limit <= 0.0:
        return None
    size = np.abs(record[what])
    most, usual = float(np.max(size)), float(np.quantile(size, 1.0 - FEW_ROWS))
    rows = np.flatnonzero(size > OVER * limit + noise_bound(record[what], SURE))
    passed, allowed = usual <= OVER * limit, f"the design's limit is {limit:.4g} {unit}"
    if passed and len(rows):
        return Finding(subject, False, f"{named_rows(record, rows, what, unit)}, {allowed}: {BAD_ROW}")
    text = f"{subject.partition(' ')[0]} up to {most if passed else usual:.4g} {unit}, {allowed}"
    if passed and most > limit:
        text += f", {most / limit:.3g} times; {OVER:g} times are allowed"
    if not passed:
        factor = explaining(usual / limit, unit)
        text += f", {usual / limit:.3g} times" + (f": factor {factor}" if factor else "; is the unit right?")
    return Finding(subject, passed, text)


def _supply(design: Design, record: Record) -> Finding | None:
    if "supply" not in record.signals:
        return None
    level, nominal = float(np.median(record["supply"])), design.limits.voltage_V
    ratio = level / nominal if isfinite(nominal) else 1.0
    passed, text = 0.4 < ratio < 1.6, f"supply {level:.4g} V, the design's {nominal:.4g} V"
    return Finding("supply", passed, text if passed else with_factor(text, ratio))


def _limits(design: Design, record: Record) -> Iterator[Finding | None]:
    motor, limits, linear = design.effective_motor, design.limits, design.axis == "linear"
    current = limits.peak_current_A if design.controller.current is not None else inf
    if not isfinite(current) and motor.resistance_ohm is not None:
        current = 2.0 * limits.voltage_V / motor.resistance_ohm
    yield _within("current against its limit", record, "current", current, "A")
    name, unit = ("velocity", "m/s") if linear else ("speed", "rad/s")
    yield _within(f"{name} against its limit", record, name, reachable_speed(design), unit)
    voltage = float(np.max(record["supply"])) if "supply" in record.signals else limits.voltage_V
    yield _within("voltage against the supply", record, "voltage", voltage, "V")
    name, unit = ("load_force", "N") if linear else ("torque", "N m")
    yield _within("load", record, name, design.load.moment_max_Nm, unit)
