"""Between which values a measured response lies, point by point and between the points; how near to -1."""

from dataclasses import dataclass

import numpy as np

from actuator_lti.margins.single import between_text
from actuator_lti.measured.response import at_once
from actuator_lti.types import Complex, Ints, Mask, Real

_LARGE_TURN = np.radians(60.0)
_LARGE_STEP = np.log(10.0) / 2.0  # 10 dB
_JUMP = np.radians(25.0)
_STANDS_OUT = 4.0  # a turn this many times that of both neighbours is no smooth curve's
_FLIP = np.radians(140.0)  # a turn that may as well be its complement the other way round
CURVATURE = 3.0  # times the largest second difference nearby
_PIECES = 32  # of an interval between two points
Range = tuple[float, float]


@dataclass(frozen=True)
class Strip:
    """A real function of log frequency, between a lower and an upper chord in each interval."""

    middle: Real  # (m,): value at the points, and how far below and above the true one may lie
    down: Real
    up: Real
    low: Real  # (m - 1, 2): at both ends of each interval; straight in between
    high: Real

    @property
    def range(self) -> tuple[float, float]:
        return float(self.low.min()), float(self.high.max())

    def meets(self, level: float) -> tuple[Real, Real]:
        """Part [t0, t1] of each interval, 0 to 1, in which the function may pass a level; t0 > t1: none."""
        t0, t1 = np.zeros(self.low.shape[0]), np.ones(self.low.shape[0])
        for at, sign in ((self.low - level, 1.0), (level - self.high, 1.0)):  # both have to be <= 0
            a, b = sign * at[:, 0], sign * at[:, 1]
            with np.errstate(divide="ignore", invalid="ignore"):
                root = a / (a - b)
            t0 = np.where((a > 0.0) & (b <= 0.0), np.maximum(t0, root), t0)
            t1 = np.where((a <= 0.0) & (b > 0.0), np.minimum(t1, root), t1)
            t0 = np.where((a > 0.0) & (b > 0.0), 2.0, t0)
        return t0, t1

    def side(self, k: int, end: int, level: float) -> int:
        """1 above a level, -1 below, 0 not told: at the point at an end (0 or 1) of interval k."""
        p = k + end
        low, high = self.middle[p] - self.down[p], self.middle[p] + self.up[p]
        return int(low > level) - int(high < level)

    def over(self, k: int, t0: float, t1: float) -> tuple[float, float]:
        """Smallest and largest value over a part of interval k."""
        low, high = (_along(side[k : k + 1], np.array([t0, t1])) for side in (self.low, self.high))
        return float(low.min()), float(high.max())


@dataclass(frozen=True)
class Bounds:
    """What is known of a measured response.

    Between two points it is taken as no more curved, over log frequency, than three times what the second
    differences of the points about them say. Where the phase turns in one interval as no smooth curve does,
    a resonance (turn < 0) or an antiresonance lies in it: the gain in between is not known at all.
    """

    log_gain: Strip  # ln |L|, and the phase in rad, followed from point to point
    phase: Strip
    unresolved: Mask  # (m - 1,): intervals that hide a resonance or change by more than 60 deg or 10 dB
    turn: Real  # (m - 1,): measured phase from point to point, rad, without the extra delay
    lost: Mask  # (m,): points whose phase is lost in noise

    def too_coarse(self, omega: Real) -> str:
        """Where the first of the unresolved intervals lies."""
        k = int(self.unresolved.argmax())
        return f"too coarse for the damping {between_text(omega[k], omega[k + 1])}"


def bounds(omega: Real, L: Complex, radius: Real, delay_s: float) -> Bounds:
    """Bounds of L exp(-j omega delay_s), all arrays (m,), m >= 2."""
    size = np.abs(L)
    gain = np.log(size)
    lost = radius >= size
    up, down = np.log1p(radius / size), -np.log1p(-np.minimum(radius / size, 1.0 - 1e-12))
    wobble = _wobble(L, radius)
    turn = np.angle(L[1:] / L[:-1])
    unresolved = unresolved_intervals(L, radius)
    phase = np.angle(L[0]) + np.concatenate(([0.0], np.cumsum(turn))) - omega * delay_s
    u = np.log(omega)
    log_gain = _strip(gain, down, up, bend(u, gain), unresolved)
    angle = _strip(phase, wobble, wobble, bend(u, phase), unresolved)
    # inside an unresolved interval the gain may rise without limit, or fall where the phase leads
    flips = np.abs(turn) > _FLIP
    either = flips | (np.abs(turn) < _JUMP)
    log_gain.high[unresolved & ((turn < 0.0) | either)] = np.inf
    log_gain.low[unresolved & ((turn > 0.0) | either)] = -np.inf
    more = np.where(unresolved & flips, 2.0 * np.pi - np.abs(turn), 0.0)[:, None]
    angle.low[:], angle.high[:] = angle.low - more, angle.high + more
    return Bounds(log_gain, angle, unresolved, turn, lost)


def _wobble(L: Complex, radius: Real) -> Real:
    """How far the phase of each value may be off, rad."""
    ratio = radius / np.abs(L)
    return np.asarray(np.where(ratio >= 1.0, np.pi, np.arcsin(np.minimum(ratio, 1.0))))


def unresolved_intervals(L: Complex, radius: Real) -> Mask:
    """Where a resonance hides between two points, or L changes by more than 60 deg or 10 dB; (m - 1,)."""
    gain, wobble = np.log(np.abs(L)), _wobble(L, radius)
    around = np.abs(np.angle(L[1:] / L[:-1]))
    padded = np.concatenate(([0.0], around, [0.0]))
    beside = np.maximum(padded[:-2], padded[2:])
    noise = 2.0 * (wobble[1:] + wobble[:-1])
    jump = (around > _JUMP + noise) & (around > _STANDS_OUT * beside)
    large = (around > _LARGE_TURN + noise) | (np.abs(np.diff(gain)) > _LARGE_STEP + noise)
    return np.asarray(jump | large)


def bend(u: Real, y: Real) -> Real:
    """How far y may leave its chord in each interval, from the second differences nearby.

    Their steps are as long as the interval, as near as there are points: the noise of closer ones is no
    curvature.
    """
    h, end = np.diff(u), u.size - 1
    left = np.arange(h.size)
    right = left + 1
    after = _ahead(u, right, h)
    before = end - _ahead(-u[::-1], end - left, h)
    further, last = _ahead(u, after, h), end - _ahead(-u[::-1], end - before, h)
    triples = ((last, before, left), (before, left, right), (left, right, after), (right, after, further))
    return CURVATURE * np.max([_second(u, y, *each) for each in triples], axis=0) * h**2 / 8.0


def _ahead(u: Real, at: Ints, step: Real) -> Ints:
    """The later point whose distance is nearest to a step, in ratio; m where there is none."""
    at = np.minimum(at, u.size - 1)
    far = np.maximum(np.searchsorted(u, u[at] + step), at + 1)
    near, there = far - 1, np.minimum(far, u.size - 1)
    shorter = (far > there) | ((u[near] - u[at]) * (u[there] - u[at]) >= step**2)
    return np.where((near > at) & shorter, near, far)


def _second(u: Real, y: Real, a: Ints, b: Ints, c: Ints) -> Real:
    """Size of the second derivative from three points; 0 where one of them lies beyond the ends."""
    there = (a >= 0) & (c < u.size)
    a, b, c = a[there], b[there], c[there]
    first, second = u[b] - u[a], u[c] - u[b]
    size = np.zeros(there.size)
    slopes = (y[c] - y[b]) / second - (y[b] - y[a]) / first
    size[there] = 2.0 * np.abs(slopes) / (first + second)
    return size


def _strip(y: Real, down: Real, up: Real, bend: Real, unresolved: Mask) -> Strip:
    """The strip about the chords; in an unresolved interval as wide everywhere as at its wider end."""
    low, high = (np.stack((side[:-1], side[1:]), axis=1) for side in (y - down, y + up))
    low, high = low - bend[:, None], high + bend[:, None]
    low[unresolved] = low[unresolved].min(axis=1, keepdims=True)
    high[unresolved] = high[unresolved].max(axis=1, keepdims=True)
    return Strip(y, down, up, low, high)


def distance_ranges(L: Complex, radius: Real, known: Bounds) -> tuple[Range, Range]:
    """Ranges of min |1 + L| and of min |2 (1 + L)/(1 - L)| over the measured band.

    From below: the nearest place of every strip between two points, a piece of a ring about the origin. From
    above: the circle of a measured point, which holds the true value; all of them at once, as the
    lowest is taken.
    """
    low, high = _pieces(known.log_gain)
    first, last = _pieces(known.phase)
    with np.errstate(over="ignore"):
        a, b = np.exp(low), np.exp(high)
    cos = np.cos(_from_minus_one(first, last))
    near = np.clip(cos, a, b)
    least = np.sqrt(np.maximum(near * near - 2.0 * near * cos + 1.0, 0.0))
    together = at_once(radius)
    d, e = np.abs(1.0 + L) + together, np.abs(1.0 - L) - together
    with np.errstate(divide="ignore"):
        above = np.where(e > 0.0, 2.0 * d / e, np.inf)
    return (float(least.min()), float(d.min())), (float(_least_alpha(a, b, cos).min()), float(above.min()))


def _along(side: Real, t: Real) -> Real:
    """A side of the strip at parts of each interval; it may be infinite at both ends."""
    start, end = side[:, :1], side[:, 1:]
    with np.errstate(invalid="ignore"):
        return np.where(start == end, start, start + t * (end - start))


def _pieces(strip: Strip) -> tuple[Real, Real]:
    """Smallest and largest value over each piece of each interval."""
    low, high = (_along(side, np.linspace(0.0, 1.0, _PIECES + 1)) for side in (strip.low, strip.high))
    return np.minimum(low[:, :-1], low[:, 1:]), np.maximum(high[:, :-1], high[:, 1:])


def _from_minus_one(first: Real, last: Real) -> Real:
    """Smallest angle between the negative real axis and a phase in a range."""
    turns = np.floor((last - np.pi) / (2.0 * np.pi))
    inside = first <= np.pi + 2.0 * np.pi * turns

    def off(phase: Real) -> Real:
        return np.abs(np.mod(phase, 2.0 * np.pi) - np.pi)

    return np.where(inside, 0.0, np.minimum(off(first), off(last)))


def _least_alpha(a: Real, b: Real, cos: Real) -> Real:
    """Smallest 2 sqrt((x - cos)/(x + cos)) with x = (r + 1/r)/2 over a <= r <= b."""

    def mean(r: Real) -> Real:
        with np.errstate(divide="ignore", over="ignore"):
            return 0.5 * (r + 1.0 / r)

    towards_one, away = mean(np.clip(1.0, a, b)), np.maximum(mean(a), mean(b))
    x = np.where(cos > 0.0, towards_one, away)
    with np.errstate(invalid="ignore", divide="ignore"):
        squared = np.where(np.isinf(x), 1.0, np.maximum(x - cos, 0.0) / (x + cos))
    return 2.0 * np.sqrt(squared)
