"""One figure of the whole drive by the name that a requirement gives it, for one design or stacked ones."""

from typing import Any

from actuator_lti.asked.quantities import DRIVE_QUANTITIES
from actuator_lti.design.model import Design
from actuator_lti.drive.facts import capability
from actuator_lti.errors import InputError
from actuator_lti.loops.stiffness import StiffnessFigures

_SOURCES = {"capability": capability, "stiffness": StiffnessFigures}


def drive_figure(design: Design, name: str, load_Nm: float = 0.0) -> Any:
    """A figure in its unit, a float or an array; NaN where the drive has none.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> f"{drive_figure(load_design('fin'), 'lost_motion'):.4f} deg"
    '0.1375 deg'
    """
    if name not in DRIVE_QUANTITIES:
        raise InputError(f"quantity {name!r}: one of {', '.join(DRIVE_QUANTITIES)}")
    quantity = DRIVE_QUANTITIES[name]
    return quantity.read(_SOURCES[quantity.source](design, load_Nm), design.axis)
