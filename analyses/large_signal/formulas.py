"""Closed forms for the far side of the border (model.md section 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

FULL_TRIANGLE = math.sqrt(1.0 + math.pi**2 / 4.0)  # x from which on the output is a whole triangle, 1.8621
TRIANGLE_THIRD, PARABOLA_THIRD = -1.0 / 9.0, 1.0 / 27.0


@dataclass(frozen=True)
class RateLimited:
    """A sine through a pure rate limit R, with ``x = w A/R``.

    ``gain``: fundamental of the output over the command.
    ``lag_deg``: positive: the output comes later.
    ``peak``: peak of the output, in the unit of R times s; ``None`` between the two regimes.
    """

    x: float
    regime: Literal["linear", "between", "triangle"]
    gain: float
    lag_deg: float
    peak: float | None


def rate_limited(amplitude: float, omega_rad_s: float, rate_limit: float) -> RateLimited:
    """Describing function of a pure rate limit (model.md section 5; between the regimes an accepted fit).

    Parameters
    ----------
    amplitude : float
        Peak of the command.
    omega_rad_s : float
    rate_limit : float
        R, in the unit of the amplitude per second.

    Examples
    --------
    >>> result = rate_limited(10.0, 2 * math.pi * 5.0, 150.0)
    >>> round(result.gain, 6), round(result.lag_deg, 4), result.peak
    (0.607927, 41.4096, 7.5)
    """
    x = omega_rad_s * amplitude / rate_limit
    if x <= 1.0:
        return RateLimited(x, "linear", 1.0, 0.0, amplitude)
    if x >= FULL_TRIANGLE:
        peak = math.pi * rate_limit / (2.0 * omega_rad_s)
        lag = math.degrees(math.acos(math.pi / (2.0 * x)))
        return RateLimited(x, "triangle", 4.0 / (math.pi * x), lag, peak)
    gain = ((0.2908 * x - 1.4396) * x + 1.9232) * x + 0.2230
    angle = ((0.5280 * x - 2.6213) * x + 3.5056) * x - 1.4171
    return RateLimited(x, "between", gain, -math.degrees(angle), None)
