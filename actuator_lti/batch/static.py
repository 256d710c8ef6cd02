"""Figures of the whole drive for many drives at once, at a load torque."""

import numpy as np

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import DRIVE_QUANTITIES
from actuator_lti.batch.parameters import Population
from actuator_lti.errors import InputError

_CHUNK = 64  # designs at once: a stiffness takes a matrix for each of its frequencies


def drive_figures(population: Population, quantity: str, load_Nm: float = 0.0) -> np.ndarray:
    """One static figure of every design, shape (count,), in its unit (see `actuator_lti.asked.drive_figure`).

    Raises `InputError`: for another quantity, or the current of an ideal torque source.
    """
    if quantity not in DRIVE_QUANTITIES:
        raise InputError(f"quantity {quantity!r}: one of {', '.join(DRIVE_QUANTITIES)}")
    if quantity == "motor_current" and not population.design.motor.has_electrical_dynamics:
        raise InputError("motor_current: an ideal torque source has no current")
    if DRIVE_QUANTITIES[quantity].source == "capability":
        figure = drive_figure(population.stacked, quantity, load_Nm)
        return np.broadcast_to(np.asarray(figure, dtype=float), (population.count,))
    out = np.empty(population.count)
    for group in population.alike():
        for first in range(0, len(group), _CHUNK):
            chosen = group[first : first + _CHUNK]
            out[chosen] = drive_figure(population.part(chosen).stacked, quantity, load_Nm)
    return out
