"""Load torques at the output shaft: constant, a time series, or proportional to the output angle.

The moment is held over each tick at its value at the tick.  Through a self-locking gear it only adds
friction ``CM |M|``; through a back-drivable one it also turns the motor shaft with ``M/N``.
"""

from dataclasses import dataclass

import numpy.typing as npt

from actuator_lti.errors import finite_number
from actuator_lti.start.public_arguments import asked, guard
from nonlinear.commands import Command, on_its_clock

__all__ = ["LoadTorque", "constant", "proportional", "series"]


@asked
@dataclass(frozen=True)
class LoadTorque:
    """``M = constant + slope * output angle + series(t)`` in N m (N on a linear axis)."""

    constant_Nm: float = 0.0
    slope_Nm_rad: float = 0.0
    series: Command | None = None

    def __post_init__(self) -> None:
        for name in ("constant_Nm", "slope_Nm_rad"):
            finite_number(name, getattr(self, name))


def constant(moment_Nm: float) -> LoadTorque:
    """The same moment all the time."""
    return LoadTorque(constant_Nm=finite_number("load_Nm", moment_Nm))


def proportional(slope_Nm_rad: float, offset_Nm: float = 0.0) -> LoadTorque:
    """Load torque ``offset + slope * output angle``; a negative slope pulls the canard back."""
    return LoadTorque(constant_Nm=finite_number("offset_Nm", offset_Nm), slope_Nm_rad=slope_Nm_rad)


def series(time_s: npt.ArrayLike, moment_Nm: npt.ArrayLike, where: str = "load series") -> LoadTorque:
    """Recorded or given moments, linear between their times, the last held; holes are refused.

    Times count from the beginning of the run: before the first of them there is no load.
    """
    return LoadTorque(series=on_its_clock(time_s, moment_Nm, where=where))


guard(__name__)
