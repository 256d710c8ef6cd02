"""The error of a position loop with dry friction about a slow triangle of the command, in its periodic state.

The loops are fast beside the triangle, their integrals may be slow. With e the error besides what a ramp lags
by, z its first and second integral, the motor's torque over the stiffness is e + k.z. After a reversal the
output stands, and e grows at the rate of the command, until that overcomes breakaway; then the output slides,
and e + k.z is what friction asks for. Half a period later all is the same with the other sign.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from actuator_lti.systems.root import root
from actuator_lti.types import Floats

TRIED = 32  # lengths of a stand, of which the first that is long enough is closed in


@dataclass(frozen=True)
class Orbit:
    """Errors and levels in rad at the output, in the direction of the motion."""

    level_rad: float  # of e + k.z that slides, as the command passes zero
    breakaway_rad: float  # of e + k.z that ends the stand
    growth_rad_s: float  # of both, as the command goes on
    rate_rad_s: float  # of the command
    half_s: float  # half a period
    gains: Floats  # k: 1/T + 1/U and 1/(T U) of integral times T and U, 0 of what does not integrate

    @property
    def at_zero_rad(self) -> float:
        """The error as the command passes zero; 0 where the output never moves."""
        stand, middle = self._stand_s(), 0.5 * self.half_s
        if stand is None:
            return 0.0
        before = self._before(stand)
        if stand >= middle:
            return self._error(before, middle)
        z = _transition(np.zeros(2), stand) @ [*before, self._error(before, 0.0), self.rate_rad_s]
        z = _transition(self.gains, middle - stand) @ [*z, self._level(stand), self.growth_rad_s]
        return float(self.level_rad - self.gains @ z)

    def _stand_s(self) -> float | None:
        """How long the output stands after a reversal; None: half a period is not enough."""
        low = 0.0
        for time in np.linspace(0.0, self.half_s, TRIED):
            if self._surplus(time) >= 0.0:
                return root(self._surplus, low, time, 1e-14 * time) if time else 0.0
            low = time
        return None

    def _surplus(self, stand_s: float) -> float:
        """By how much e + k.z is beyond breakaway after so long a stand."""
        before = self._before(stand_s)
        z = _transition(np.zeros(2), stand_s) @ [*before, self._error(before, 0.0), self.rate_rad_s]
        beyond = self._level(stand_s) - self.level_rad + self.breakaway_rad
        return float(self._error(before, stand_s) + self.gains @ z - beyond)

    def _before(self, stand_s: float) -> Floats:
        """The integrals at a reversal, which have the other sign at the next one."""
        stand, slide = _transition(np.zeros(2), stand_s), _transition(self.gains, self.half_s - stand_s)
        over = slide[:, :2] @ (stand[:, :2] - np.outer(stand[:, 2], self.gains))
        moved = slide[:, :2] @ stand[:, 2:] @ [-self._level(self.half_s), self.rate_rad_s]
        moved += slide[:, 2:] @ [self._level(stand_s), self.growth_rad_s]
        return np.asarray(np.linalg.solve(-np.eye(2) - over, moved))

    def _error(self, before: Floats, time_s: float) -> float:
        """The error so long after a reversal, up to which it slid the other way, in a stand."""
        return float(-self._level(self.half_s) - self.gains @ before + self.rate_rad_s * time_s)

    def _level(self, time_s: float) -> float:
        """What friction asks for, so long after a reversal."""
        return self.level_rad + self.growth_rad_s * (time_s - 0.5 * self.half_s)


def _transition(gains: Floats, time_s: float) -> Floats:
    """From z, x and the slope of x to z after a time of dz1/dt = x - gains.z, dz2/dt = z1; shape (2, 4)."""
    rates = np.array([[*-gains, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    return np.asarray(expm(rates * time_s)[:2])
