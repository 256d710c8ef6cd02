"""A torque that depends on an angle: a straight line, and waves about it, which bend."""

from dataclasses import dataclass
from typing import Any

import numpy as np

ROUNDED = 1e-15  # a slope of so small a part of its terms, and of the angle's own rounding, is none


@dataclass(frozen=True)
class Wave:
    """``peak sin(order angle + phase)``; numbers, or arrays of shape (K,) of stacked designs."""

    peak_Nm: Any
    order: Any
    phase_rad: Any
    averages: bool = False  # whether a drive in motion passes its periods so fast that it feels their mean, 0


@dataclass(frozen=True)
class OverAngle:
    """``slope angle`` plus `Wave` terms, in N m; the one answer to what a torque is over its angle.

    >>> pendulum = OverAngle(waves=(Wave(2.0, 1.0, 0.0),))
    >>> pendulum.bends, float(pendulum.at(0.0)), float(pendulum.slope_at(0.0))
    (True, 0.0, 2.0)
    """

    slope_Nm_rad: Any = 0.0
    waves: tuple[Wave, ...] = ()

    @property
    def follows(self) -> bool:
        return self.bends or bool(np.any(self.slope_Nm_rad))

    @property
    def bends(self) -> bool:
        """Whether it is no straight line over the angle, so that its slope is another at another angle."""
        return any(bool(np.any(wave.peak_Nm)) for wave in self.waves)

    @property
    def ripple_Nm(self) -> Any:
        """The most that the waves have that average: what starting costs at the worst angle."""
        return sum(wave.peak_Nm for wave in self.waves if wave.averages)

    def at(self, angle_rad: Any, *, moving: bool = False) -> Any:
        """The torque at an angle; floats or arrays. ``moving``: of a drive in motion, see `slope_at`."""
        torque = self.slope_Nm_rad * angle_rad
        for wave in self._acting(moving):
            torque = torque + wave.peak_Nm * np.sin(wave.order * angle_rad + wave.phase_rad)
        return torque

    def slope_at(self, angle_rad: Any, *, moving: bool = False) -> Any:
        """0 where rounding leaves no more, as at a quarter turn; ``moving``: waves that average have none."""
        acting = self._acting(moving)
        slope, size = self.slope_Nm_rad, abs(self.slope_Nm_rad)
        for wave in acting:
            steepest, phase = wave.peak_Nm * wave.order, wave.order * angle_rad + wave.phase_rad
            slope = slope + steepest * np.cos(phase)
            size = size + abs(steepest) * (abs(np.cos(phase)) + abs(phase))
        return slope * (abs(slope) > ROUNDED * size) if acting else slope

    def _acting(self, moving: bool) -> list[Wave]:
        return [w for w in self.waves if np.any(w.peak_Nm) and not (moving and w.averages)]
