"""Two recorders with clocks of their own, put on one: by a shared event, or by correlation."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.series import best_lag, correlation_time, without_noise
from analyses.records.campaign_file import Join
from analyses.records.factors import named_factor
from analyses.records.record import Record
from analyses.records.single_rows import NORMAL

RATE_SPREAD = 0.01  # two clocks are taken to differ by less than 1 % in rate; anything else is no clock error
GRID = 4000
MIN_QUALITY = 0.5
RATE_STD_MAX = 1e-3
ROUNDS = 50
NEAR = 1e-4  # steps of the grid


class Mismatch(InputError):
    """Two records that do not show one happening."""


@dataclass(frozen=True, kw_only=True)
class ClockJoin:
    """How the second recorder's time was put on the first one's: ``t_first = offset_s + rate * t_second``."""

    offset_s: float
    offset_std_s: float = 0.0  # at the middle of the second record
    rate: float = 1.0
    rate_std: float | None = None  # None: the records do not tell the rate (a single event)
    quality: float = 1.0  # correlation reached
    method: str = "given"
    first_signal: str = ""  # by which it was done
    second_signal: str = ""

    def __str__(self) -> str:
        if self.method == "given":
            return f"second clock by the given offset {self.offset_s:.6g} s"
        rate = "rate not estimable, taken as 1"
        if self.rate_std is not None:
            rate = f"rate {(self.rate - 1.0) * 1e6:+.1f} ppm (std {self.rate_std * 1e6:.1f})"
        both = self.first_signal, self.second_signal
        taken = "" if self.first_signal == "current" else " where the {1} comes with the {0}".format(*both)
        return (
            f"second clock by {self.method} of {' and '.join(both)}: offset {self.offset_s:.6f} s "
            f"(std {self.offset_std_s:.1g}{taken}), {rate}, correlation {self.quality:.4f}"
        )


class Series(NamedTuple):
    """The magnitude of a signal over its recorder's time."""

    time_s: Floats
    values: Floats


def clock_join(first: Record, second: Record, how: Join, offset_s: float | None = None) -> ClockJoin:
    """How a second recorder's time goes on that of the first (`joined_by` puts its signals there).

    Of the signals that show the shared happening, such as the motor's speed and the clutch's torque, only
    the magnitude is used, and their scale does not matter. By ``event``: the moment when the magnitude
    first passes half of its plateau, and the last moment when it falls below again, which gives the ratio
    of the clock rates too. By ``correlation``: the offset at which the magnitudes fit best (FFT), refined
    together with the rate by least squares. As ``given``: ``offset_s``, the first clock's time at the
    second clock's zero.
    """
    names = how.drive_signal, how.sensor_signal
    if how.method == "given":
        if offset_s is None:
            raise InputError('join method "given": needs an offset', where=second.name)
        join = ClockJoin(offset_s=offset_s)
    else:
        a, b = (Series(one.time_s, np.abs(one[n])) for one, n in zip((first, second), names, strict=True))
        where = f"{first.name} with {second.name}"
        _check_durations(a, b, names, where)
        join = (_by_event if how.method == "event" else _by_correlation)(a, b, where)
    return replace(join, method=how.method, first_signal=names[0], second_signal=names[1])


def joined_by(first: Record, second: Record, join: ClockJoin) -> Record:
    """The first record with the second one's signals (linear interpolation), cut to the time both cover."""
    time = join.offset_s + join.rate * second.time_s
    start = int(np.searchsorted(first.time_s, time[0]))
    stop = int(np.searchsorted(first.time_s, time[-1], side="right"))
    if stop - start < 2:
        raise InputError(f"the two records do not overlap in time ({join})", where=second.name)
    clash = set(first.signals) & set(second.signals)
    if clash:
        raise InputError(f'both records hold a signal "{min(clash)}"', where=second.name)
    cut = first.slice(start, stop)
    added = {name: np.interp(cut.time_s, time, values) for name, values in second.signals.items()}
    return replace(
        cut,
        signals={**cut.signals, **added},
        units={**first.units, **second.units},
        notes=(*first.notes, *second.notes, str(join)),
    )


def motion_events(time_s: Floats, magnitude: Floats) -> tuple[float, float] | None:
    """First rise through half of the plateau, and how much later the last fall below it is (0: not shown).

    The plateau is the 95 % point of the magnitude, its floor the 1 % point. None where there is no rise: a
    flat signal, or one that is up from the beginning.

    >>> t = np.arange(0.0, 10.0, 0.1)
    >>> start, lasts = motion_events(t, np.clip(t - 2.0, 0.0, 1.0))
    >>> round(start, 6), lasts
    (2.5, 0.0)
    """
    floor, plateau = np.quantile(magnitude, [0.01, 0.95])
    level = 0.5 * (floor + plateau)
    noise = NORMAL * float(np.median(np.abs(np.diff(magnitude)))) / np.sqrt(2.0)
    up = np.flatnonzero(magnitude >= level)
    if plateau - floor <= max(6.0 * noise, 1e-12 * abs(plateau)) or up[0] == 0:
        return None

    def crossing(k: int) -> float:
        share = (level - magnitude[k]) / (magnitude[k + 1] - magnitude[k])
        return float(time_s[k] + share * (time_s[k + 1] - time_s[k]))

    start = crossing(int(up[0]) - 1)
    return start, 0.0 if up[-1] == len(magnitude) - 1 else crossing(int(up[-1])) - start


def _check_durations(a: Series, b: Series, names: tuple[str, str], where: str) -> None:
    """Refuse two records in which one happening lasts differently long: no clock is off by so much."""
    first, second = spans = np.array([(motion_events(*one) or (0.0, 0.0))[1] for one in (a, b)])
    steps = np.array([np.median(np.diff(one.time_s)) for one in (a, b)])
    if not np.all(spans) or abs(first / second - 1.0) <= RATE_SPREAD + 3.0 * np.max(steps / spans):
        return
    why = f"the {names[1]} came or went at another time than the {names[0]}, a clock is off, or the records "
    why += 'are of two runs; allowed: join.method = "given" with run.offset'
    lasts = f"the {names[0]} lasts {first:.4g} s, the {names[1]} in the other record {second:.4g} s"
    why = f"factor {factor}" if (factor := named_factor(first / second)) else why
    raise Mismatch(f"{lasts}, {first / second:.4f} times as long: {why}", where=where)


def _by_event(a: Series, b: Series, where: str) -> ClockJoin:
    first, second = motion_events(*a), motion_events(*b)
    if first is None or second is None:
        why = "no event: neither signal may be flat, and each must start below half of its plateau"
        raise InputError(why, where=where)
    (start_a, span_a), (start_b, span_b) = first, second
    step = np.hypot(np.median(np.diff(a.time_s)), np.median(np.diff(b.time_s))) / np.sqrt(12.0)
    rate, rate_std = 1.0, None
    if span_a and span_b and step / span_b < RATE_SPREAD / 10.0:
        rate, rate_std = span_a / span_b, float(np.sqrt(2.0) * step / span_b)
    offset = start_a - rate * start_b
    moved = np.interp(a.time_s, offset + rate * b.time_s, b.values)
    quality = float(np.corrcoef(a.values, moved)[0, 1])
    return ClockJoin(offset_s=offset, offset_std_s=float(step), rate=rate, rate_std=rate_std, quality=quality)


def _by_correlation(a: Series, b: Series, where: str) -> ClockJoin:
    """The best offset on a common grid by FFT, then offset and rate by least squares.

    The rate is kept only where its standard deviation is below 1e-3: a steady signal with one edge does not
    tell it.
    """
    step = max(np.ptp(a.time_s), np.ptp(b.time_s)) / GRID
    a, b = _gridded(a, step), _gridded(b, step)
    b = b._replace(values=without_noise(b.values))  # its noise has slopes, which tell no time
    if any(np.std(one.values) <= 1e-12 * np.max(np.abs(one.values)) for one in (a, b)):
        raise InputError("a flat signal cannot be aligned by correlation", where=where)
    lag = best_lag(a.values - a.values.mean(), b.values - b.values.mean())
    pair = _Pair(a, b, a.time_s[0] - b.time_s[0] + step * lag, step)
    p, covariance = _gauss_newton(pair, 2)
    rate_std = float(np.sqrt(covariance[1, 1]) * step / pair.half)
    estimable = 0.0 < rate_std < RATE_STD_MAX and abs(p[1] * step / pair.half) < 0.01
    if not estimable:
        p, covariance = _gauss_newton(pair, 1)
    rate, quality = pair.rate(p), pair.quality(p)
    if not quality >= MIN_QUALITY:
        why = f"the two records are not alike: correlation {quality:.2f}, {MIN_QUALITY} wanted"
        raise Mismatch(why, where=where)
    return ClockJoin(
        offset_s=float(pair.start + p[0] * step + pair.middle - rate * pair.middle),
        offset_std_s=float(np.sqrt(covariance[0, 0]) * step),
        rate=rate,
        rate_std=rate_std if estimable else None,
        quality=quality,
    )


def _gridded(one: Series, step: float) -> Series:
    """Means over bins of one step, at the mean time of each bin; empty bins by interpolation."""
    time, values = one
    place = np.floor((time - time[0]) / step).astype(np.int64)
    counts = np.bincount(place)
    centres = time[0] + (np.arange(len(counts)) + 0.5) * step
    filled = counts > 0
    means, times = (np.bincount(place, column)[filled] / counts[filled] for column in (values, time))
    return Series(centres, np.interp(centres, times, means))


class _Pair:
    """Both gridded signals, and how well they fit for a shift and a stretch (in grid steps at the ends)."""

    def __init__(self, a: Series, b: Series, start: float, step: float) -> None:
        self.a, self.b, self.start, self.step = a, b, start, step
        self.middle = 0.5 * (b.time_s[0] + b.time_s[-1])
        self.half = 0.5 * (b.time_s[-1] - b.time_s[0])

    def rate(self, p: Floats) -> float:
        """That of the clocks; 1 where no stretch is among the parameters."""
        return 1.0 + float(p[1]) * self.step / self.half if len(p) > 1 else 1.0

    def both(self, p: Floats) -> tuple[Floats, Floats]:
        """The samples of the first signal inside the second, and the second there."""
        ga, gb = self.a.time_s, self.b.time_s
        moved = self.start + p[0] * self.step + self.middle + self.rate(p) * (gb - self.middle)
        inside = (ga >= moved[0]) & (ga <= moved[-1])
        return self.a.values[inside], np.interp(ga[inside], moved, self.b.values)

    def residual(self, p: Floats) -> Floats:
        """What a straight line from the second to the first leaves, zero outside the overlap."""
        x, y = self.both(p)
        out = np.zeros(len(self.a.values))
        if len(x) < 10 or np.ptp(y) <= 0.0:
            return out + np.std(self.a.values)
        dy = y - y.mean()
        out[: len(x)] = x - x.mean() - dy * (dy @ x) / (dy @ dy)
        return out

    def quality(self, p: Floats) -> float:
        x, y = self.both(p)
        return float(np.corrcoef(x, y)[0, 1]) if len(x) >= 10 and np.std(y) * np.std(x) > 0.0 else 0.0


def _gauss_newton(pair: _Pair, parameters: int) -> tuple[Floats, Floats]:
    """Parameters and covariance; differences over half a grid step, past the kinks of interpolation.

    To the noise is added how far apart in time the edges remain on the mean: two instruments do not
    see the same happening in quite the same shape, and no fit can tell that from a shift.
    """
    p, steps = np.zeros(parameters), 0.5 * np.eye(parameters)
    rest = pair.residual(p)
    for _ in range(ROUNDS):
        jac = np.column_stack([pair.residual(p + h) - pair.residual(p - h) for h in steps])
        change = np.clip(np.linalg.lstsq(jac, rest, rcond=None)[0], -5.0, 5.0)
        while (left := pair.residual(p - change)) @ left > rest @ rest and np.max(np.abs(change)) >= NEAR:
            change *= 0.5  # a whole step would go to and fro over a kink
        p, rest = p - change, left
        if np.max(np.abs(change)) < NEAR:
            break
    variance = float(rest @ rest) / max(len(rest) - 2 - parameters, 1) * correlation_time(rest)
    covariance = np.asarray(variance * np.linalg.pinv(jac.T @ jac))
    steep = np.abs(jac[:, 0]) > 0.05 * np.max(np.abs(jac[:, 0]))
    apart = float(np.sum(np.abs(rest[steep])) / max(np.sum(np.abs(jac[steep, 0])), 1e-300))
    return p, covariance + apart**2 * np.eye(parameters)
