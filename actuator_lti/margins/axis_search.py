"""A loop by its factors on the stability boundary, with the range of gain and phase over whole intervals.

On s = j w every factor (s - r) moves steadily between few places: its gain falls to w = Im r and rises from
there, its phase turns one way, and both rates have one peak. Between these places the sum of what the factors
change by bounds what L does: gain, phase and their rates are known over whole intervals, but for rounding.
A sampled loop is held in s = (z - 1)/(z + 1), w = tan(angle/2); there a delay of q samples, e^(-j q angle),
is the factor ((1 - s)/(1 + s))^q.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from actuator_lti.axis import _nearest, _search
from actuator_lti.axis._factors import BOUNDS, STEP, slot
from actuator_lti.axis.library import LIBRARY
from actuator_lti.margins.distances import Distance, Place
from actuator_lti.margins.trust import Doubtful
from actuator_lti.types import Complex, Mask, Real

_NEAR = 2.0 * STEP
_NEXT_TO_AXIS = 1e-14  # relative: a root on the axis itself is held this far from it
_ROOM, _MORE, _MOST = 1 << 11, 8, 1 << 17  # intervals: asked for first, each time more, and no more than that


@dataclass(frozen=True)
class Found:
    """Where a factored loop meets the unit circle and the negative real axis."""

    gain_w: Real  # in order
    real_w: Real
    rising: Mask  # whether the phase rises at each of ``real_w``
    far: int  # crossings of the negative real axis beyond 200 dB, up or down, which are not looked for
    turns: int  # rising less falling ones among those not listed where the gain is above one
    rate: float  # of the phase, at the beginning
    # (intervals + 1, 7): for each interval where it begins, log gain and phase there, and inside their least,
    # then their most; the last row is the end
    known: Real


@dataclass(frozen=True)
class Factored:
    """log L = constant + sum of weights log(s - roots) - delay s."""

    roots: Complex  # (m,): zeros count positive, poles negative; conjugates are both there
    weights: Real
    delay: float  # in the unit 1/w (continuous loops only)
    log_gain: float = 0.0  # the constant, so that gain and phase are those of L; the phase modulo a full turn
    phase: float = 0.0
    slack: float = 0.0  # how far the factors may be from the loop: log gain, and phase in rad
    one_at_rest: bool = False  # whether a gain of one at zero frequency, within `TOUCH`, is no crossing

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
        other = replace(
            self,
            roots=roots,
            weights=weights,
            log_gain=self.log_gain + constant,
            phase=0.0,
            one_at_rest=False,
        )
        one = np.ones(1)
        phase = -float(self.log_value(one)[1][0] + other.log_value(one)[1][0])
        whole = (self.weights == np.round(self.weights)).all()  # behind part of a sample L is not real there
        return replace(other, phase=half_turn(phase) if whole else phase)

    @cached_property
    def _off_axis(self) -> Real:
        off: Real = np.maximum(np.abs(self.roots.real), _NEXT_TO_AXIS * np.abs(self.roots.imag))
        return off

    @cached_property
    def _turning(self) -> Real:
        turning: Real = np.where(self.roots.real > 0.0, -self.weights, self.weights)
        return turning

    @cached_property
    def _table(self) -> Real:
        """What the compiled search knows of each factor, then of the loop, see `actuator_lti.axis`."""
        roots = (self.roots.real, self.roots.imag, self._off_axis, self.weights, self._turning)
        return np.concatenate((*roots, (self.log_gain, self.phase, self.delay, self.slack)))

    @cached_property
    def places(self) -> Real:
        """Frequencies w > 0 between which every factor is monotone, in order; some twice."""
        im = self.roots.imag
        w = np.concatenate((im - self._off_axis, im, im + self._off_axis))
        return np.sort(w[w > 0.0])

    def log_value(self, w: Real) -> Real:
        """Log gain and phase (continuous, less whole turns), shape (2, points)."""
        y, a = w[:, None] - self.roots.imag, self._off_axis
        gain = 0.5 * np.log(y * y + a * a) @ self.weights + self.log_gain
        return np.array((gain, np.arctan2(y, a) @ self._turning - self.delay * w + self.phase))

    def log_at(self, w: float) -> tuple[float, float]:
        parts = np.empty(slot(self.roots.size))
        LIBRARY.functions.evaluated(*self._row, w, parts, 0)
        gain, phase = parts[-5:-3].tolist()
        return gain, phase

    def onto_axis(self, w: float) -> float:
        """The crossing of the negative real axis that the search left near w, to rounding."""
        level = np.pi + 2.0 * np.pi * round((self.log_at(w)[1] - np.pi) / (2.0 * np.pi))
        low, high = w * (1.0 - _NEAR), w * (1.0 + _NEAR)
        first, last = (self.log_at(end)[1] > level for end in (low, high))
        if first == last:
            raise Doubtful("a crossing beyond 200 dB is not told from another")
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (middle, high) if (self.log_at(middle)[1] > level) == first else (low, middle)
        return middle

    def search(self, low: float, high: float, listed_to: float = math.inf) -> Found:
        """Find all crossings with low < w < high; of the real axis only those up to ``listed_to``.

        A crossing at w = 0 itself, where low is 0, is not listed. `Doubtful`: its side of a line is not told.
        """
        ends = [low, *([listed_to] if low < listed_to < high else []), high]
        return self._searched(ends, _search.CIRCLE, 0.0, listed_to)

    def along(self, low: float, high: float) -> Found:
        """The intervals between two frequencies alone."""
        return self._searched([low, high], _search.GAIN_LEVEL, math.inf, math.inf)

    def passages(self, low: float, high: float, level: float, kind: int = _search.GAIN_LEVEL) -> Real:
        """Every w between two at which the log gain (0) or the phase (1) passes a level, in order."""
        return self._searched([low, high], kind, level, math.inf).gain_w

    def _searched(self, ends: list[float], kind: int, level: float, listed_to: float) -> Found:
        places, room = self.places, _ROOM
        edges = np.sort(np.concatenate((ends, places[(places > ends[0]) & (places < ends[-1])])))
        while True:
            known, gains, reals = np.empty((room + 1, _search.KNOWN)), np.empty(room), np.empty((room, 2))
            found = np.zeros(_search.FOUND)
            status = LIBRARY.functions.search(
                *self._row, kind, level, listed_to, edges.size, edges, room, known.reshape(-1), gains,
                reals.reshape(-1), found, *self._lent(),
            )  # fmt: skip
            if status != _search.FULL or room > _MOST:
                break
            room *= _MORE
        if status != _search.DONE:
            where = f"{found[_search.WHERE]:.6g}"
            raise Doubtful(f"the loop comes too near to a line at {where} to tell its side")
        intervals, crossed, turned, far, turns = found[: _search.RATE].astype(int).tolist()
        return Found(gains[:crossed], reals[:turned, 0], reals[:turned, 1] > 0.0, far, turns,
                     float(found[_search.RATE]), known[: intervals + 1])  # fmt: skip

    def nearest(self, found: Found, distances: Sequence[Distance], start: Sequence[Place]) -> list[Place]:
        """Smallest values of distances, each with its w, beside ``start``: a place for each that stands for
        what the intervals of ``found`` leave out.
        """
        out, known, lent = [], found.known.reshape(-1), self._lent()
        for d, place in zip(distances, start, strict=True):
            best = np.array(place)
            status = LIBRARY.functions.nearest(*self._row, len(found.known) - 1, known, d.form, best, *lent)
            if status == _nearest.MEETS:
                raise Doubtful("the loop all but meets -1")
            if status != _search.DONE:
                raise Doubtful("the smallest distance to -1 was not settled")
            out.append((float(best[0]), float(best[1])))
        return out

    @property
    def _row(self) -> tuple[int, Real]:
        return self.roots.size, self._table

    def _lent(self) -> tuple[Real, Real]:
        return np.empty((_search.DEEPEST + 2) * slot(self.roots.size)), np.empty(BOUNDS)


def half_turn(phase: float) -> float:
    """The constant phase where L is real at w = 0: what its factors turn by cancels there."""
    return float(np.pi * round(phase / np.pi))
