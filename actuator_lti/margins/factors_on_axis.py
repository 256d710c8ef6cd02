"""A loop by its factors on the border of stability, with the range of gain and phase over whole intervals.

On s = j w every factor (s - r) moves steadily between few places: its gain falls to w = Im r and rises from
there, its phase turns one way, and both rates have one peak. Between these places the sum of what the factors
change by bounds what L does: gain, phase and their rates are known over whole intervals, but for rounding.
A sampled loop is held in s = (z - 1)/(z + 1), w = tan(angle/2); there a delay of q samples, e^(-j q angle),
is the factor ((1 - s)/(1 + s))^q.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.trust import Doubtful

_NEXT_TO_AXIS = 1e-14  # relative: a root on the axis itself is held this far from it
_ROUNDS = 60
_MOST = 100_000
_NARROWEST = 1e-14
_PARTS = 6  # of an interval that is split
_MOST_PARTS = 12  # of one between neighbouring places
_FIRST = 3000  # factors times points to begin with


@dataclass(frozen=True)
class Factored:
    """log L = constant + sum of weights log(s - roots) - delay s.

    Attributes
    ----------
    roots, weights : arrays (m,)
        Zeros count positive, poles negative; conjugates are both there.
    delay : float
        In the unit 1/w (continuous loops only).
    log_gain, phase : float
        The constant, so that gain and phase are those of L; the phase modulo a full turn.
    slack : float
        How far the factors may be from the loop: log gain, and phase in rad.
    """

    roots: Complex
    weights: Real
    delay: float
    log_gain: float = 0.0
    phase: float = 0.0
    slack: float = 0.0

    @cached_property
    def at_zero(self) -> float:
        """Weight of the roots at zero frequency: negative for integrators."""
        return float(self.weights[self.roots == 0.0].sum())

    @cached_property
    def at_infinity(self) -> float:
        """Slope of the gain at infinity in powers of w."""
        return float(self.weights.sum())

    def reciprocal(self) -> Factored:
        """L(1/s), which on j/w is the conjugate of L on j w: infinity lies at zero. No delay."""
        away = self.roots != 0.0
        roots, weights = 1.0 / self.roots[away], self.weights[away]
        constant = float(-(weights * np.log(np.abs(roots))).sum())
        if self.at_infinity:
            roots, weights = np.append(roots, 0.0), np.append(weights, -self.at_infinity)
        other = replace(self, roots=roots, weights=weights, log_gain=self.log_gain + constant, phase=0.0)
        one = np.ones(1)
        phase = -float(self.log_value(one)[1][0] + other.log_value(one)[1][0])
        whole = bool(
            (self.weights == np.round(self.weights)).all()
        )  # behind part of a sample L is not real there
        return replace(other, phase=half_turn(phase) if whole else phase)

    @cached_property
    def _off_axis(self) -> Real:
        off: Real = np.maximum(np.abs(self.roots.real), _NEXT_TO_AXIS * np.abs(self.roots.imag))
        return off

    @cached_property
    def _turning(self) -> Real:
        """Weights of gain, phase, and their rates, shape (4, m, 1)."""
        turning = np.where(self.roots.real > 0.0, -self.weights, self.weights)
        return np.array((self.weights, turning, self.weights, turning))[..., None]

    @cached_property
    def places(self) -> Real:
        """Frequencies w > 0 between which every factor is monotone."""
        im = self.roots.imag
        w = np.concatenate((im - self._off_axis, im, im + self._off_axis))
        return np.unique(w[w > 0.0])

    def _rows(self, w: Real) -> tuple[Real, Real]:
        """Gain, turn and their rates of every factor (4, points, m), and those of L (4, points)."""
        y, a = w[:, None] - self.roots.imag, self._off_axis
        size = y * y + a * a
        parts = np.empty((4, *size.shape))
        parts[0], parts[1], parts[2], parts[3] = 0.5 * np.log(size), np.arctan2(y, a), y / size, a / size
        total = (parts @ self._turning)[..., 0]
        total[0] += self.log_gain
        if self.delay:
            total[1] -= self.delay * w
            total[3] -= self.delay
        total[1] += self.phase
        return parts, total

    def log_value(self, w: Real) -> Real:
        """Log gain, phase (continuous, less whole turns), and their rates; shape (4, points)."""
        return self._rows(w)[1]

    @cached_property
    def _listed(self) -> list[tuple[complex, float, float, float]]:
        turning = self._turning[:2, :, 0].tolist()
        return list(zip(self.roots.tolist(), *turning, self._off_axis.tolist(), strict=True))

    def log_at(self, w: float) -> tuple[float, float]:
        """Log gain and phase at one frequency."""
        gain, phase = self.log_gain, self.phase - self.delay * w
        for root, weight, turning, off in self._listed:
            y = w - root.imag
            gain += weight * math.log(math.hypot(y, off)) if y or off else -math.copysign(math.inf, -weight)
            phase += turning * math.atan2(y, off)
        return gain, phase

    def jet(self, w: float) -> tuple[complex, complex, complex]:
        """L at one frequency, and the first two derivatives of log L by w."""
        gain, phase, l1, l2 = self.log_gain, self.phase - self.delay * w, 0j, 0j
        for root, weight, turning, off in self._listed:
            y = w - root.imag
            gain += weight * math.log(math.hypot(y, off))
            phase += turning * math.atan2(y, off)
            over = 1.0 / complex(-root.real, y)
            l1 += weight * over
            l2 += weight * over * over
        return cmath.rect(math.exp(gain), phase), 1j * (l1 - self.delay), l2

    def jets(self, low: Real, high: Real) -> tuple[Complex, Complex, Complex, Real]:
        """Log L and its first two derivatives by w at low, middle and high; shape (3, k).

        With them a bound of the third between these, which lie between places.
        """
        w = np.array((low, 0.5 * (low + high), high))
        total = self.log_value(w.ravel()).reshape(4, *w.shape)
        over = 1.0 / (1j * w[..., None] - self.roots)
        third = 2.0 * np.maximum(np.abs(over[0]), np.abs(over[2])) ** 3 @ np.abs(self.weights)
        return total[0] + 1j * total[1], total[2] + 1j * total[3], (over * over) @ self.weights, third

    def between_neighbours(self, w: Real) -> Intervals:
        """Bounds over the intervals between neighbours in each row of points, shape (k, n)."""
        k, n = w.shape
        parts, total = self._rows(w.ravel())
        parts, total = parts.reshape(4, k, n, -1), total.reshape(4, k, n)
        changes = np.abs(parts[:, :, 1:] - parts[:, :, :-1]).reshape(4, k * (n - 1), -1)
        spread = (changes @ np.abs(self._turning))[..., 0]
        low, high = w[:, :-1].ravel(), w[:, 1:].ravel()
        spread[1] += self.delay * (high - low)
        first, last = total[:, :, :-1].reshape(4, -1), total[:, :, 1:].reshape(4, -1)
        return Intervals(low, high, first, last, 0.5 * spread)

    def covered(self, ends: list[float], clear: Callable[[Intervals], Mask]) -> Intervals:
        """Intervals from the first to the last of the ends, in order, split until ``clear`` holds in each.

        Raises
        ------
        Doubtful
            It does not, however small they are.
        """
        places = self.places
        edges = np.concatenate((ends, places[(places > ends[0]) & (places < ends[-1])]))
        edges.sort()
        parts = int(_FIRST / (edges.size * (1 + self.roots.size)))
        if parts > 1:
            inner = parted(edges[:-1], edges[1:], min(parts, _MOST_PARTS))
            edges = np.append(inner[:, :-1].ravel(), edges[-1])
        here = self.between_neighbours(edges[None])
        done: list[Intervals] = []
        for _ in range(_ROUNDS):
            good = clear(here)
            whole = bool(good.all())
            if whole and not done:
                return here
            done.append(here if whole else here.taken(good))
            if whole:
                return _joined(done)
            low, high = here.low[~good], here.high[~good]
            if low.size > _MOST or (high - low <= _NARROWEST * high).any():
                break
            here = self.between_neighbours(parted(low, high))
        raise Doubtful(f"the loop comes too near to a line at {float(low[0]):.6g} to tell its side")


@dataclass(frozen=True)
class Intervals:
    """Intervals [low, high] of w: log gain, phase and their rates at both ends, shape (4, k).

    Inside, each lies within ``spread`` of the mean of its ends.
    """

    low: Real
    high: Real
    first: Real
    last: Real
    spread: Real

    @cached_property
    def least(self) -> Real:
        """Smallest value of each."""
        return np.asarray(0.5 * (self.first + self.last) - self.spread)

    @cached_property
    def most(self) -> Real:
        """Largest value of each."""
        return np.asarray(0.5 * (self.first + self.last) + self.spread)

    @cached_property
    def bounds(self) -> tuple[Real, Real]:
        """Least and most of log gain and phase (2, k): by the factors, and by the rate of their sum."""
        width = self.high - self.low
        up, down = np.maximum(self.most[2:], 0.0) * width, np.maximum(-self.least[2:], 0.0) * width
        least = np.maximum(self.least[:2], np.maximum(self.first[:2] - down, self.last[:2] - up))
        return least, np.minimum(self.most[:2], np.minimum(self.first[:2] + up, self.last[:2] + down))

    def taken(self, which: Mask) -> Intervals:
        """Some of them."""
        return Intervals(*(getattr(self, name)[..., which] for name in _NAMES))


_NAMES = tuple(Intervals.__dataclass_fields__)


def _joined(parts: list[Intervals]) -> Intervals:
    order = np.concatenate([part.low for part in parts]).argsort()
    return Intervals(*(np.concatenate([getattr(p, n) for p in parts], axis=-1)[..., order] for n in _NAMES))


def half_turn(phase: float) -> float:
    """The constant phase where L is real at w = 0: what its factors turn by cancels there."""
    return float(np.pi * round(phase / np.pi))


def parted(low: Real, high: Real, parts: int = _PARTS) -> Real:
    """The ends of the parts into which intervals are split, shape (k, parts + 1)."""
    shares = np.arange(parts + 1) / parts
    w: Real = low[:, None] + (high - low)[:, None] * shares
    wide = (high > 4.0 * low) & (low > 0.0)
    if wide.any():
        w[wide] = low[wide, None] * (high[wide] / low[wide])[:, None] ** shares
    w[:, -1] = high
    return w


def halves(low: Real, high: Real) -> Real:
    """Where to halve intervals."""
    middle: Real = np.where((high > 4.0 * low) & (low > 0.0), np.sqrt(low * high), 0.5 * (low + high))
    return middle


def half_turns(phase: Real) -> Real:
    """How many odd multiples of pi lie below."""
    return np.floor((phase + math.pi) / (2.0 * math.pi))
