"""Does a record agree with itself and with the drive it is said to come from?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from actuator_lti.design.model import Design
from analyses.estimation.arrays import BoolArray, FloatArray
from analyses.estimation.least_squares import solve
from analyses.records.factors import explaining, named_factor
from analyses.records.record import Record

RATE_TOLERANCE = 0.02
"""Disagreement of speed and rate above which no design is made; below it, it widens the intervals."""
SURE = 4.0
"""Standard errors beyond which noise explains no difference: by chance in one record of 16 000."""
TICK_TOLERANCE = 1e-3
ALIKE = 0.9
OVER = 1.2
ELECTRICAL_FACTOR = 2.0
SMOOTH_HZ = 20.0
IN_MOTION = 0.05
CLOSELY = 0.95
"""Cosine above which a command is followed within 18 deg: no loop has another gain there than about one."""
LARGEST_GAIN = 1.5


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing that was looked at: what, whether it agrees (None: not determined), and in words."""

    subject: str
    passed: bool | None
    text: str


def check_record(design: Design, record: Record) -> tuple[Finding, ...]:
    """Hold a record against itself and against the limits of the design.

    Looked at, where recorded: the speed against the rate of the angle (this also tells a clock that is off),
    angle and output angle against the reduction, voltage against ``R i + kE w``, the command against what
    followed it, and current, speed, voltage, supply and load against the design's limits. A ratio that a
    known factor explains is named.
    """
    checks: tuple[Callable[[Design, Record], Finding | None], ...] = (
        _rate,
        _clock,
        _reduction,
        _electrical,
        _command,
        _kind_of_current,
        _current_limit,
        _speed_limit,
        _voltage_limit,
        _supply,
        _load,
    )
    design = record.drive(design)
    return tuple(result for check in checks if (result := check(design, record)) is not None)


def place_of(design: Design, record: Record) -> tuple[str, FloatArray] | None:
    """The position at the motor and the signal that it comes from; None where none is recorded."""
    if design.axis == "linear":
        return ("position", record["position"]) if "position" in record.signals else None
    if "angle" in record.signals:
        return "angle", record["angle"]
    if "output_angle" in record.signals:
        return "output_angle", design.total_ratio * record["output_angle"]
    return None


def _smooth(record: Record, values: FloatArray) -> FloatArray:
    """A signal without its fast part, no phase; the same filter for all signals that are compared."""
    from scipy.signal import butter, sosfiltfilt

    share = 2.0 * SMOOTH_HZ * record.period_s
    if share >= 0.5 or len(values) < 60:
        return values
    return np.asarray(sosfiltfilt(butter(2, share, output="sos"), values, padtype="even"), dtype=np.float64)


def _moving(*signals: FloatArray) -> BoolArray:
    """Where one of some signals is not small: in a long rest there is nothing but noise."""
    return np.any([np.abs(values) > IN_MOTION * np.max(np.abs(values)) for values in signals], axis=0)


def _inner(values: FloatArray) -> FloatArray:
    """Without the twentieth part at both ends, where a filter starts and stops."""
    cut = len(values) // 20
    return values[cut : len(values) - cut] if cut else values


def _ratio(y: FloatArray, x: FloatArray) -> tuple[float, float]:
    """Slope of y over x through zero, and how alike they are (cosine); zeros for a flat signal."""
    xx, yy = float(x @ x), float(y @ y)
    if xx == 0.0 or yy == 0.0:
        return 0.0, 0.0
    return float(x @ y) / xx, float(x @ y) / np.sqrt(xx * yy)


@dataclass(frozen=True, kw_only=True)
class RateRatio:
    """A recorded speed over the rate of the recorded position, and the interval that noise of both leaves.

    ``found`` is the ratio, ``alike`` the cosine; ``low`` and ``high`` hold it with noise in either (Frisch's
    bounds: regressed one on the other and the other on the one, each with its error).
    """

    found: float
    alike: float
    low: float
    high: float
    rate: FloatArray
    moves: BoolArray

    @property
    def doubt(self) -> float:
        """The share by which they disagree, 0 where noise explains it."""
        return 0.0 if self.low <= 1.0 <= self.high else self.found - 1.0


def rate_ratio(design: Design, record: Record) -> RateRatio | None:
    """Speed against the rate of the position; None where one of them is not recorded, or nothing moves."""
    place = place_of(design, record)
    name = "velocity" if design.axis == "linear" else "speed"
    if place is None or name not in record.signals:
        return None
    # over each interval the same filter on both, the slope first: they agree up to the ends, and a motion
    # that begins with the record counts; a speed that jumps inside an interval lies between its two samples
    rate = _smooth(record, np.diff(place[1]) / np.diff(record.time_s))
    if not np.any(rate):
        return None
    first, last = (_smooth(record, values) for values in (record[name][:-1], record[name][1:]))
    speed = 0.5 * (first + last)
    moves = _moving(rate, speed)
    found, alike = _ratio(speed[moves], rate[moves])
    low, high = -inf, inf
    if abs(alike) >= ALIKE and found > 0.0 and len(rate) > 60:
        bent = np.gradient(np.gradient(rate)) / 12.0  # what a straight line between two samples leaves out
        between = sum(abs(_ratio(off[moves], rate[moves])[0]) for off in (0.5 * (last - first), bent))
        step = max(1, round(0.25 / (SMOOTH_HZ * record.period_s)))  # the filter leaves no more
        x, y = rate[::step], speed[::step]
        (a, a_error), (b, b_error) = _regressed(y, x), _regressed(x, y)
        ends = [a + side * a_error for side in (-SURE, SURE)]
        ends += [1.0 / (b + side * b_error) for side in (-SURE, SURE)]
        low, high = min(ends) - between, max(ends) + between
    return RateRatio(found=found, alike=alike, low=low, high=high, rate=rate, moves=moves)


def _regressed(y: FloatArray, x: FloatArray) -> tuple[float, float]:
    """Slope of y over x and its error; x's own slope beside it takes up a delay between the two."""
    w = np.column_stack([x, np.gradient(x)])
    size = np.linalg.norm(w, axis=0)
    result = solve(w / size, y)
    return float(result.values[0] / size[0]), float(np.sqrt(result.correlated[0, 0]) / size[0])


def _rate(design: Design, record: Record) -> Finding | None:
    ratio = rate_ratio(design, record)
    place = place_of(design, record)
    if ratio is None or place is None:
        return None
    name = "velocity" if design.axis == "linear" else "speed"
    subject = f"{name} against the rate of the {place[0]}"
    if abs(ratio.alike) < ALIKE:
        other = _other(record, name, ratio.rate, ratio.moves)
        told = f"they are not alike (cosine {ratio.alike:.2f}){other}"
        return Finding(subject=subject, passed=False, text=told)
    said = f"the {name} is {ratio.found:.4g} times the rate of the {place[0]}"
    if not ratio.doubt and abs(ratio.found - 1.0) <= 0.5:
        return Finding(subject=subject, passed=True, text=f"{said}: one clock, one scale")
    clock = f"{said}: a clock {100.0 * (ratio.found - 1.0):+.2g} % off, or the scale of one of them"
    if abs(ratio.found - 1.0) <= RATE_TOLERANCE:
        told = f"{clock}, beyond their noise ({ratio.low:.4f} to {ratio.high:.4f}): the intervals hold it"
        return Finding(subject=subject, passed=None, text=told)
    factor = named_factor(ratio.found, {design.total_ratio: f"the reduction {design.total_ratio:g}"})
    return Finding(subject=subject, passed=False, text=f"{said}: factor {factor}" if factor else clock)


def _clock(design: Design, record: Record) -> Finding | None:
    """Where no speed is recorded beside the position, only the tick tells of a clock that is off."""
    rate = "velocity" if design.axis == "linear" else "speed"
    if place_of(design, record) is not None and rate in record.signals:
        return None
    ticks = record.period_s / design.controller.period_s
    if ticks < 1.0 - TICK_TOLERANCE or record.averaged > 1:
        return None
    off = abs(ticks - round(ticks))
    subject = "sampling period against the drive's tick"
    if off <= TICK_TOLERANCE * ticks:
        whole = f"{round(ticks)} ticks; a clock that is off by a whole number of them is not seen here"
        return Finding(subject=subject, passed=True, text=whole)
    text = f"{ticks:.5g} ticks: another recorder's clock, or one that is off; nothing else here tells"
    return Finding(subject=subject, passed=None, text=text)


def _other(record: Record, name: str, rate: FloatArray, moves: BoolArray) -> str:
    """The signal that is more like the rate, if there is one: two columns are swapped."""
    for other, values in record.signals.items():
        if other in (name, "angle", "output_angle", "position"):
            continue
        if abs(_ratio(_smooth(record, values[1:])[moves], rate[moves])[1]) > 0.97:
            return f"; {other} is: are the columns of {name} and {other} swapped?"
    return ""


def _reduction(design: Design, record: Record) -> Finding | None:
    if not {"angle", "output_angle"} <= set(record.signals) or design.axis == "linear":
        return None
    if not any(np.ptp(record[name]) > 0.0 for name in ("angle", "output_angle")):
        return None
    a, b = (record[name] - record[name].mean() for name in ("angle", "output_angle"))
    ratio, alike = _ratio(a, design.total_ratio * b)
    if abs(alike) < ALIKE:
        return Finding(subject="angle against output angle", passed=False, text="they are not alike")
    passed = abs(ratio - 1.0) <= RATE_TOLERANCE + _twist_share(design, record)
    factor = None if passed else named_factor(ratio, {design.total_ratio: "the reduction, counted twice"})
    text = f"the motor angle is {ratio:.4g} times the output angle and the reduction" + (
        f": factor {factor}" if factor else ""
    )
    return Finding(subject="angle against output angle", passed=passed, text=text)


def _twist_share(design: Design, record: Record) -> float:
    """What play, the largest moment and the load's inertia (rms) twist the coupling by.

    A share of the output's motion (rms).
    """
    if design.coupling is None:
        return 0.0
    own = record["output_angle"]
    moment = float(np.max(np.abs(record["torque"]))) if "torque" in record.signals else 0.0
    moment = max(moment, float(np.max(np.abs(design.load.moment_Nm(own)))))
    slope = np.gradient(np.gradient(_smooth(record, own), record.time_s), record.time_s)
    moment += design.load.inertia_kgm2 * float(np.sqrt(np.mean(_inner(slope) ** 2)))
    behind = design.ratio_behind_coupling
    twist = 0.5 * design.coupling.play_rad + design.coupling.stretch_rad(moment / behind)
    return twist / behind / max(float(np.std(own)), 1e-300)


def _electrical(design: Design, record: Record) -> Finding | None:
    motor = design.effective_motor
    if motor.resistance_ohm is None or motor.back_emf_constant_Vs_rad is None:
        return None
    if not {"voltage", "current", "speed"} <= set(record.signals):
        return None
    u, i, w = (_smooth(record, record[name]) for name in ("voltage", "current", "speed"))
    if motor.inductance_H is not None:  # of a direct drive as large as the rest
        u = u - motor.inductance_H * np.gradient(i, record.period_s)
    u, i, w = (_inner(values) for values in (u, i, w))
    table = np.column_stack([motor.resistance_ohm * i, motor.back_emf_constant_Vs_rad * w])
    size = np.linalg.norm(table, axis=0)
    if not np.all(size > 0.03 * np.linalg.norm(u)) or np.linalg.cond(table / size) > 100.0:
        return _electrical_size(u, table)
    result = np.linalg.lstsq(table, u, rcond=None)[0]
    parts = []
    for name, ratio in zip(("R i", "kE w"), result, strict=True):
        if not 1.0 / ELECTRICAL_FACTOR < ratio < ELECTRICAL_FACTOR:
            factor = named_factor(1.0 / ratio) if ratio else None
            parts.append(f"{name} counts {ratio:.3g} times" + (f": factor {factor}" if factor else ""))
    told = "; ".join(parts) or f"R counts {result[0]:.3g} times, kE {result[1]:.3g} times"
    return Finding(subject="voltage against R i + kE w", passed=not parts, text=told)


def _electrical_size(u: FloatArray, table: FloatArray) -> Finding | None:
    """Where the record does not tell R from kE: whether their sum is of the size of the voltage."""
    ratio, alike = _ratio(table.sum(axis=1), u)
    if not abs(alike) > 0.5:
        return None
    passed = 1.0 / 3.0 < ratio < 3.0
    factor = None if passed else named_factor(ratio)
    text = f"R i + kE w is {ratio:.3g} times the voltage" + (f": factor {factor}" if factor else "")
    return Finding(subject="voltage against R i + kE w", passed=passed, text=text)


def _command(design: Design, record: Record) -> Finding | None:
    """A command that is followed at all is followed about one to one, unless a factor is wrong."""
    followed = (
        ("position_reference", "position"),
        ("reference", "output_angle"),
        ("reference", "angle"),
        ("output_speed_reference", "speed"),
        ("speed_reference", "speed"),
        ("velocity_reference", "velocity"),
        ("current_reference", "current"),
        ("voltage_reference", "voltage"),
    )
    for command, answer in followed:
        if command not in record.signals or answer not in record.signals:
            continue
        values = record[answer]
        if (command, answer) in (("reference", "angle"), ("output_speed_reference", "speed")):
            values = values / design.total_ratio
        a, b = (part - part[0] for part in (values, record[command]))
        if not np.any(b):  # a step that begins with the record tells no ratio
            continue
        ratio, alike = _ratio(a, b)
        if abs(alike) < 0.7:
            return Finding(
                subject=f"{answer} against its command", passed=None, text=f"cosine {alike:.2f}: not followed"
            )
        factor = named_factor(ratio, {design.total_ratio: f"the reduction {design.total_ratio:g}"})
        follows = abs(alike) > CLOSELY and not 1.0 / LARGEST_GAIN < ratio < LARGEST_GAIN
        wrong = follows or (factor is not None and not 0.5 < ratio < 1.5)
        why = f"factor {factor}" if factor else "the reduction, or the scale of one of them"
        text = f"{answer} is {ratio:.4g} times {command}" + (f": {why}" if wrong else "")
        return Finding(subject=f"{answer} against its command", passed=not wrong, text=text)
    return None


def _within(subject: str, record: Record, what: str, limit: float, unit: str) -> Finding | None:
    """The largest value of a signal against a limit of the design."""
    if what not in record.signals or not isfinite(limit) or limit <= 0.0:
        return None
    result = float(np.quantile(np.abs(record[what]), 0.999))
    passed = result <= OVER * limit
    text = f"{subject.partition(' ')[0]} up to {result:.4g} {unit}, the design's limit is {limit:.4g} {unit}"
    if not passed:
        factor = explaining(result / limit, unit)
        times = f", {result / limit:.3g} times"
        text += times + (f": factor {factor}" if factor else "; is the unit right?")
    return Finding(subject=subject, passed=passed, text=text)


def _kind_of_current(design: Design, record: Record) -> Finding | None:
    """What a current is whose scale nothing else in the record tells."""
    if "current" not in record.signals or "voltage" in record.signals:
        return None
    if record.signals.keys() & {"force", "torque_reference", "current_reference"}:
        return None
    text = (
        "without a voltage, a current or torque command nothing in this record tells its scale (rms read as "
        "DC: 0.82 times): inertia and friction come out in proportion to it"
    )
    return Finding(subject="scale of the current", passed=None, text=text)


def _current_limit(design: Design, record: Record) -> Finding | None:
    motor, limits = design.effective_motor, design.limits
    limit = limits.peak_current_A if design.controller.current is not None else inf
    if not isfinite(limit) and motor.resistance_ohm is not None:
        limit = 2.0 * limits.voltage_V / motor.resistance_ohm
    return _within("current against its limit", record, "current", limit, "A")


def _speed_limit(design: Design, record: Record) -> Finding | None:
    name, unit = ("velocity", "m/s") if design.axis == "linear" else ("speed", "rad/s")
    kE = design.effective_motor.back_emf_constant_Vs_rad
    limit = min(design.limits.speed_rad_s, inf if kE is None else design.limits.voltage_V / kE)
    return _within(f"{name} against its limit", record, name, limit, unit)


def _voltage_limit(design: Design, record: Record) -> Finding | None:
    limit = float(np.max(record["supply"])) if "supply" in record.signals else design.limits.voltage_V
    return _within("voltage against the supply", record, "voltage", limit, "V")


def _supply(design: Design, record: Record) -> Finding | None:
    if "supply" not in record.signals:
        return None
    level, nominal = float(np.median(record["supply"])), design.limits.voltage_V
    ratio = level / nominal if isfinite(nominal) else 1.0
    passed = 0.4 < ratio < 1.6
    factor = None if passed else named_factor(ratio)
    text = f"supply {level:.4g} V, the design's {nominal:.4g} V" + (f": factor {factor}" if factor else "")
    return Finding(subject="supply", passed=passed, text=text)


def _load(design: Design, record: Record) -> Finding | None:
    name, unit = ("load_force", "N") if design.axis == "linear" else ("torque", "N m")
    return _within("load", record, name, design.load.moment_max_Nm, unit)
