"""A loop by its factors on the stability boundary, with the range of gain and phase over whole intervals.

On s = j w every factor (s - r) moves steadily between few places: its gain falls to w = Im r and rises from
there, its phase turns one way, and both rates have one peak. Between these places the sum of what the factors
change by bounds what L does: gain, phase and their rates are known over whole intervals, but for rounding.
A sampled loop is held in s = (z - 1)/(z + 1), w = tan(angle/2); there a delay of q samples, e^(-j q angle),
is the factor ((1 - s)/(1 + s))^q.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from actuator_lti.axis._factors import slot
from actuator_lti.axis.library import LIBRARY
from actuator_lti.margins.loop import Complex, Real

_NEXT_TO_AXIS = 1e-14  # relative: a root on the axis itself is held this far from it


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
        turning: Real = np.where(self.roots.real > 0.0, -self.weights, self.weights)
        return turning

    @cached_property
    def table(self) -> Real:
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
        """The same at one frequency."""
        parts = np.empty(slot(self.roots.size))
        LIBRARY.functions.evaluated(self.roots.size, self.table, w, parts, 0)
        gain, phase = parts[-5:-3].tolist()
        return gain, phase


def half_turn(phase: float) -> float:
    """The constant phase where L is real at w = 0: what its factors turn by cancels there."""
    return float(np.pi * round(phase / np.pi))
