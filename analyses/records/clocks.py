"""Two recorders with clocks of their own, put on one: by a shared event, or by correlation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.records.campaign_file import Method
from analyses.records.correlate_clocks import Fit, fit_by_correlation
from analyses.records.factors import named_factor
from analyses.records.record import Record

RATE_SPREAD = 0.01
"""Two clocks are taken to differ by less than 1 % in rate; anything else is no clock error."""


@dataclass(frozen=True, kw_only=True)
class ClockJoin(Fit):
    """How the second recorder's time was put on the first one's, by which of their signals."""

    method: str
    first_signal: str
    second_signal: str

    def __str__(self) -> str:
        if self.method == "given":
            return f"second clock by the given offset {self.offset_s:.6g} s"
        if self.rate_std is None:
            rate = "rate not estimable, taken as 1"
        else:
            rate = f"rate {(self.rate - 1.0) * 1e6:+.1f} ppm (std {self.rate_std * 1e6:.1f})"
        return (
            f"second clock by {self.method} of {self.first_signal} and {self.second_signal}: offset "
            f"{self.offset_s:.6f} s (std {self.offset_std_s:.1g}), {rate}, correlation {self.quality:.4f}"
        )


def join_records(
    first: Record,
    second: Record,
    *,
    first_signal: str,
    second_signal: str,
    method: Method = "correlation",
    offset_s: float | None = None,
) -> tuple[Record, ClockJoin]:
    """Put the signals of a second recorder on the time of the first, whose times are kept.

    Of the signals that show the shared happening, such as the motor's speed and the clutch's torque, only
    the magnitude is used, and their scale does not matter. By ``event``: the moment when the magnitude
    first passes half of its plateau, and the last moment when it falls below again, which gives the ratio
    of the clock rates too. By ``correlation``: the offset at which the magnitudes fit best (FFT), refined
    together with the rate by least squares. As ``given``: ``offset_s``, the first clock's time at the
    second clock's zero.

    Returns
    -------
    Record, ClockJoin
        The first record with the second one's signals added (linear interpolation), cut to the time both
        cover; and how it was done.
    """
    if method == "given":
        if offset_s is None:
            raise InputError('join method "given": needs an offset', where=second.name)
        fit = Fit(offset_s, 0.0, 1.0, None, 1.0)
    elif method in ("event", "correlation"):
        a, b = np.abs(first[first_signal]), np.abs(second[second_signal])
        find = _by_event if method == "event" else fit_by_correlation
        where = f"{first.name} with {second.name}"
        _check_durations(first.time_s, a, second.time_s, b, where)
        fit = find(first.time_s, a, second.time_s, b, where)
    else:
        raise InputError(f'join method "{method}": "event", "correlation" or "given"')
    join = ClockJoin(method=method, first_signal=first_signal, second_signal=second_signal, **vars(fit))
    return _joined(first, second, join), join


def _joined(first: Record, second: Record, join: ClockJoin) -> Record:
    time = join.offset_s + join.rate * second.time_s
    start, stop = np.searchsorted(first.time_s, [time[0], time[-1]], side="left")
    stop = (
        min(int(stop) + 1, len(first)) if stop < len(first) and first.time_s[stop] == time[-1] else int(stop)
    )
    if stop - int(start) < 2:
        raise InputError(f"the two records do not overlap in time ({join})", where=second.name)
    clash = set(first.signals) & set(second.signals)
    if clash:
        raise InputError(f'both records hold a signal "{min(clash)}"', where=second.name)
    cut = first.slice(int(start), stop)
    added = {name: np.interp(cut.time_s, time, values) for name, values in second.signals.items()}
    return replace(
        cut,
        signals=MappingProxyType({**cut.signals, **added}),
        units=MappingProxyType({**first.units, **second.units}),
        notes=(*first.notes, *second.notes, str(join)),
    )


def _check_durations(t_a: FloatArray, a: FloatArray, t_b: FloatArray, b: FloatArray, where: str) -> None:
    """Refuse two records in which one motion lasts differently long: no clock is off by so much."""
    events_a, events_b = motion_events(t_a, a), motion_events(t_b, b)
    if events_a is None or events_b is None or events_a.stop_s is None or events_b.stop_s is None:
        return
    span_a, span_b = events_a.stop_s - events_a.start_s, events_b.stop_s - events_b.start_s
    if not (span_a > 0.0 and span_b > 0.0):
        return
    ratio = span_a / span_b
    step = max(float(np.median(np.diff(t_a))) / span_a, float(np.median(np.diff(t_b))) / span_b)
    if abs(ratio - 1.0) > RATE_SPREAD + 3.0 * step:
        factor = named_factor(ratio)
        told = f"factor {factor}" if factor else "a clock is off, or the records are of two runs"
        raise InputError(
            f"the motion lasts {span_a:.4g} s in one record and {span_b:.4g} s in the other, "
            f"{ratio:.4f} times as long: {told}",
            where=where,
        )


def _by_event(t_a: FloatArray, a: FloatArray, t_b: FloatArray, b: FloatArray, where: str) -> Fit:
    events_a, events_b = motion_events(t_a, a), motion_events(t_b, b)
    if events_a is None or events_b is None:
        raise InputError(
            "no event: neither signal may be flat, and each must start below half of its plateau", where=where
        )
    step = np.hypot(np.median(np.diff(t_a)), np.median(np.diff(t_b))) / np.sqrt(12.0)
    rate, rate_std, std = 1.0, None, float(step)
    if events_a.stop_s is not None and events_b.stop_s is not None:
        span = events_b.stop_s - events_b.start_s
        estimate = (events_a.stop_s - events_a.start_s) / span
        if step / span < RATE_SPREAD / 10.0:
            rate, rate_std = estimate, float(np.sqrt(2.0) * step / span)
    offset = events_a.start_s - rate * events_b.start_s
    moved = np.interp(t_a, offset + rate * t_b, b)
    return Fit(offset, std, rate, rate_std, float(np.corrcoef(a, moved)[0, 1]))


@dataclass(frozen=True)
class MotionEvents:
    """Start of a motion, and its end where the record shows it."""

    start_s: float
    stop_s: float | None


def motion_events(time_s: FloatArray, magnitude: FloatArray) -> MotionEvents | None:
    """First rise through half of the plateau, and last fall below it, by linear interpolation.

    The plateau is the 95 % point of the magnitude, its floor the 1 % point. None where there is no rise: a
    flat signal, or one that is up from the beginning.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0.0, 10.0, 0.1)
    >>> e = motion_events(t, np.clip(t - 2.0, 0.0, 1.0))
    >>> round(e.start_s, 6), e.stop_s
    (2.5, None)
    """
    floor, plateau = np.quantile(magnitude, [0.01, 0.95])
    level = 0.5 * (floor + plateau)
    noise = 1.4826 * float(np.median(np.abs(np.diff(magnitude)))) / np.sqrt(2.0)
    if plateau - floor <= max(6.0 * noise, 1e-12 * abs(plateau)):
        return None
    up = magnitude >= level
    if up[0]:
        return None
    rise = int(np.argmax(up))
    fall = len(up) - 1 - int(np.argmax(up[::-1]))
    start = _crossing(time_s, magnitude, rise - 1, level)
    stop = None if fall == len(up) - 1 else _crossing(time_s, magnitude, fall, level)
    return MotionEvents(start, stop)


def _crossing(time_s: FloatArray, values: FloatArray, k: int, level: float) -> float:
    share = (level - values[k]) / (values[k + 1] - values[k])
    return float(time_s[k] + share * (time_s[k + 1] - time_s[k]))
