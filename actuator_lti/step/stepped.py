"""The first part of a step response, stepped: polynomials of fourth degree one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PPoly

from actuator_lti.margins.loop import Real
from actuator_lti.step.motion import BAND


@dataclass(frozen=True)
class Stepped:
    """Deviation from the final value, relative to it."""

    e: PPoly

    @classmethod
    def through(cls, values: Real, h: float) -> Stepped:
        """From the values at the start, at each quarter and at the end of each step, shape (steps, 5)."""
        t = np.linspace(0.0, h, values.shape[1])
        return cls(PPoly((values @ np.linalg.inv(np.vander(t)).T).T, h * np.arange(len(values) + 1)))

    @property
    def end(self) -> float:
        """The end of the last step."""
        return float(self.e.x[-1])

    def first_at_least(self, level: float) -> float | None:
        """First time at or above a level; ``None``: not in this part."""
        hit = _finite(self.e.solve(level - 1.0, extrapolate=False))
        if self.e(0.0) >= level - 1.0:
            return 0.0
        return float(hit[0]) if hit.size else None

    def last_outside(self) -> float:
        """Last time at which it is outside of the band."""
        if abs(self.e(self.end)) > BAND:
            return self.end
        return max(
            float(_finite(self.e.solve(side, extrapolate=False)).max(initial=0.0)) for side in (-BAND, BAND)
        )

    def greatest(self) -> tuple[float, float]:
        """Largest value and its time."""
        inside = _finite(self.e.derivative().roots(extrapolate=False))
        ends = np.nextafter(self.e.x[1:], 0.0)
        time = np.sort(np.concatenate((self.e.x[:-1], inside, ends)))
        value = self.e(time)
        return float(value.max()), float(time[value.argmax()])


def _finite(roots: Real) -> Real:
    """Without the marks of polynomials that are the level everywhere."""
    return np.sort(roots[np.isfinite(roots)])
