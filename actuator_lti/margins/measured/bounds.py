"""Between which values a measured response lies, point by point and between the points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.margins.loop import Complex, Mask, Real

_LARGE_TURN = np.radians(60.0)
_LARGE_STEP = np.log(10.0) / 2.0  # 10 dB
_JUMP = np.radians(25.0)
_STANDS_OUT = 4.0  # a turn this many times that of both neighbours is no smooth curve's
_FLIP = np.radians(140.0)  # a turn that may as well be its complement the other way round
_CURVATURE = 3.0  # times the largest second difference nearby


@dataclass(frozen=True)
class Strip:
    """A real function of log frequency, between a lower and an upper chord in each interval.

    Attributes
    ----------
    middle, down, up : arrays (m,)
        Value at the points, and how far below and above the true one may lie.
    low, high : array (m - 1, 2)
        At both ends of each interval; straight in between.
    """

    middle: Real
    down: Real
    up: Real
    low: Real
    high: Real

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
        t = np.array([t0, t1])
        low, high = (side[k, 0] if side[k, 0] == side[k, 1] else side[k, 0] + t * (side[k, 1] - side[k, 0])
                     for side in (self.low, self.high))  # fmt: skip
        return float(np.min(low)), float(np.max(high))


@dataclass(frozen=True)
class Bounds:
    """What is known of a measured response.

    Between two points it is taken as no more curved, over log frequency, than three times what the second
    differences of the points about them say. Where the phase turns in one interval as no smooth curve does,
    a resonance (turn < 0) or an antiresonance lies in it: the gain in between is not known at all.

    Attributes
    ----------
    log_gain, phase : Strip
        ln |L|, and the phase in rad, followed from point to point.
    unresolved : array (m - 1,), bool
        Intervals that hide a resonance or change by more than 60 deg or 10 dB.
    turn : array (m - 1,)
        Measured phase from point to point, rad, without the extra delay.
    lost : array (m,), bool
        Points whose phase is lost in noise.
    """

    log_gain: Strip
    phase: Strip
    unresolved: Mask
    turn: Real
    lost: Mask


def bounds(omega: Real, L: Complex, radius: Real, delay_s: float) -> Bounds:
    """Bounds of L exp(-j omega delay_s), all arrays (m,), m >= 2."""
    size = np.abs(L)
    gain = np.log(size)
    lost = radius >= size
    ratio = np.minimum(radius / size, 1.0)
    up, down = np.log1p(radius / size), -np.log1p(-np.minimum(ratio, 1.0 - 1e-12))
    wobble = np.where(lost, np.pi, np.arcsin(ratio))
    turn = np.angle(L[1:] / L[:-1])
    unresolved = _unresolved(gain, turn, wobble)
    phase = np.angle(L[0]) + np.concatenate(([0.0], np.cumsum(turn))) - omega * delay_s
    u = np.log(omega)
    bend_gain, bend_phase = _bend(u, gain), _bend(u, phase)
    log_gain = _strip(gain, down, up, bend_gain)
    angle = _strip(phase, wobble, wobble, bend_phase)
    _open_gain(log_gain, unresolved, turn)
    _open_phase(angle, unresolved, turn)
    return Bounds(log_gain, angle, unresolved, turn, lost)


def _unresolved(gain: Real, turn: Real, wobble: Real) -> Mask:
    around = np.abs(turn)
    padded = np.concatenate(([0.0], around, [0.0]))
    beside = np.maximum(padded[:-2], padded[2:])
    noise = 2.0 * (wobble[1:] + wobble[:-1])
    jump = (around > _JUMP + noise) & (around > _STANDS_OUT * beside)
    large = (around > _LARGE_TURN + noise) | (np.abs(np.diff(gain)) > _LARGE_STEP + noise)
    return np.asarray(jump | large)


def _bend(u: Real, y: Real) -> Real:
    """How far y may leave its chord in each interval, from the second differences nearby."""
    h = np.diff(u)
    slope = np.diff(y) / h
    second = 2.0 * np.abs(np.diff(slope)) / (h[1:] + h[:-1])
    padded = np.concatenate(([0.0, 0.0], second, [0.0, 0.0]))
    nearby = np.max([padded[k : k + h.size] for k in range(4)], axis=0)
    return _CURVATURE * nearby * h**2 / 8.0


def _strip(y: Real, down: Real, up: Real, bend: Real) -> Strip:
    low, high = y - down, y + up
    return Strip(
        y,
        down,
        up,
        np.stack((low[:-1], low[1:]), axis=1) - bend[:, None],
        np.stack((high[:-1], high[1:]), axis=1) + bend[:, None],
    )


def _open_gain(strip: Strip, unresolved: Mask, turn: Real) -> None:
    """Inside an unresolved interval the gain may rise without limit, or fall where the phase leads."""
    either = _ambiguous(turn) | (np.abs(turn) < _JUMP)
    peak, dip = unresolved & ((turn < 0.0) | either), unresolved & ((turn > 0.0) | either)
    strip.low[unresolved] = strip.low[unresolved].min(axis=1, keepdims=True)
    strip.high[unresolved] = strip.high[unresolved].max(axis=1, keepdims=True)
    strip.high[peak] = np.inf
    strip.low[dip] = -np.inf


def _open_phase(strip: Strip, unresolved: Mask, turn: Real) -> None:
    strip.low[unresolved] = strip.low[unresolved].min(axis=1, keepdims=True)
    strip.high[unresolved] = strip.high[unresolved].max(axis=1, keepdims=True)
    either = unresolved & _ambiguous(turn)
    strip.low[either] -= 2.0 * np.pi - np.abs(turn[either])[:, None]
    strip.high[either] += 2.0 * np.pi - np.abs(turn[either])[:, None]


def _ambiguous(turn: Real) -> Mask:
    return np.asarray(np.abs(turn) > _FLIP)
