"""A figure of the whole drive by the name that a requirement gives it, for one design or many."""

from typing import Any

import numpy as np

from actuator_lti.asked.quantities import DRIVE_QUANTITIES
from actuator_lti.batch.parameters import Population
from actuator_lti.design.model import Design
from actuator_lti.drive.facts import capability
from actuator_lti.errors import InputError
from actuator_lti.loops.stiffness import StiffnessFigures

_SOURCES = {"capability": capability, "stiffness": StiffnessFigures}
_CHUNK = 64  # designs at once: a stiffness takes a matrix for each of its frequencies


def drive_figure(design: Design, name: str, load_Nm: float = 0.0) -> Any:
    """A figure in its unit, a float or, of stacked designs, an array; NaN where the drive has none.

    >>> from actuator_lti.design import load_design
    >>> f"{drive_figure(load_design('fin'), 'lost_motion'):.4f} deg"
    '0.1375 deg'
    """
    if name not in DRIVE_QUANTITIES:
        raise InputError(f"quantity {name!r}: one of {', '.join(DRIVE_QUANTITIES)}")
    quantity = DRIVE_QUANTITIES[name]
    return quantity.read(_SOURCES[quantity.source](design, load_Nm), design.axis)


def drive_figures(population: Population, quantity: str, load_Nm: float = 0.0) -> np.ndarray:
    """The same of every design, shape (count,); an InputError for the current of an ideal source."""
    if quantity == "motor_current" and not population.design.motor.has_electrical_dynamics:
        raise InputError("motor_current: an ideal torque source has no current")
    known = DRIVE_QUANTITIES.get(quantity)
    if known is None or known.source == "capability":
        figure = drive_figure(population.stacked, quantity, load_Nm)
        return np.broadcast_to(np.asarray(figure, dtype=float), (population.count,))
    out = np.empty(population.count)
    for group in population.kinds():
        for first in range(0, len(group), _CHUNK):
            chosen = group[first : first + _CHUNK]
            out[chosen] = drive_figure(population.part(chosen).stacked, quantity, load_Nm)
    return out
