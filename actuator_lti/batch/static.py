"""Figures of the whole drive for many drives at once, at a hinge moment."""

from __future__ import annotations

import numpy as np

from actuator_lti.batch.parameters import Population
from actuator_lti.drive_figure import drive_figure
from actuator_lti.errors import InputError


def drive_figures(population: Population, quantity: str, load_Nm: float = 0.0) -> np.ndarray:
    """One static figure of every design, shape (count,), in its unit (see `actuator_lti.drive_figure`).

    Raises
    ------
    InputError
        For another quantity, or the current of an ideal torque source.
    """
    if quantity == "motor_current" and not population.design.motor.has_electrical_dynamics:
        raise InputError("motor_current: an ideal torque source has no current")
    found = drive_figure(population.stacked, quantity, load_Nm)
    return np.broadcast_to(np.asarray(found, dtype=float), (population.count,))
