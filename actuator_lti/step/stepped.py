"""The first part of a step response, stepped: on a grid, and between its points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from actuator_lti.margins.loop import Real
from actuator_lti.step.motion import BAND


@dataclass(frozen=True)
class Stepped:
    """Deviation from the final value, relative to it, on a grid; ``between(k, t)``: in interval k."""

    time: Real
    y: Real
    between: Callable[[int, float], float]

    def first_at_least(self, level: float) -> float | None:
        """First time at or above a level; ``None``: not in this part."""
        hit = np.flatnonzero(self.y >= level - 1.0)
        if not hit.size:
            return None
        return self._located(int(hit[0]) - 1, level - 1.0) if hit[0] else float(self.time[0])

    def last_outside(self) -> float:
        """Last time at which it is outside of the band."""
        hit = np.flatnonzero(np.abs(self.y) > BAND)
        if not hit.size:
            return 0.0
        k = int(hit[-1])
        if k + 1 == self.y.size:
            return float(self.time[-1])
        return self._located(k, float(np.copysign(BAND, self.y[k])))

    def greatest(self) -> tuple[float, float]:
        """Largest value and its time, located beside the largest point."""
        time, y = self.time, self.y
        k = int(y.argmax())
        best = float(y[k]), float(time[k])
        if k in (0, y.size - 1):
            return best

        def below(t: float) -> float:
            return -self.between(k - 1 if t < time[k] else k, t)

        minimum = minimize_scalar(below, bounds=(time[k - 1], time[k + 1]), method="bounded",
                                options={"xatol": 1e-10 * float(time[k + 1])})  # fmt: skip
        return max(best, (-float(minimum.fun), float(minimum.x)))

    def _located(self, k: int, level: float) -> float:
        """Where it passes a level between grid points k and k + 1."""
        a, b = float(self.time[k]), float(self.time[k + 1])
        low, high = self.between(k, a) - level, self.between(k, b) - level
        if low * high >= 0.0:
            return a if abs(low) < abs(high) else b
        return float(brentq(lambda t: self.between(k, t) - level, a, b, xtol=1e-300, rtol=1e-13))
