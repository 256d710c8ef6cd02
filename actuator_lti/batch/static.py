"""Static figures of many drives at once: output rate, motor current, acceleration at a hinge moment."""

from __future__ import annotations

import numpy as np

from actuator_lti.batch.parameters import Population
from actuator_lti.drive.facts import capability
from actuator_lti.errors import InputError
from actuator_lti.quantities import DRIVE_QUANTITIES


def drive_figures(population: Population, quantity: str, load_Nm: float = 0.0) -> np.ndarray:
    """One static figure of every design, shape (count,), in its unit (see `actuator_lti.drive.facts`).

    Raises
    ------
    InputError
        For another quantity, or the current of an ideal torque source.
    """
    if quantity not in DRIVE_QUANTITIES:
        raise InputError(f"quantity {quantity!r}: one of {', '.join(DRIVE_QUANTITIES)}")
    if quantity == "motor_current" and not population.design.motor.has_electrical_dynamics:
        raise InputError("motor_current: an ideal torque source has no current")
    found = DRIVE_QUANTITIES[quantity].read(capability(population.stacked, load_Nm), population.design.axis)
    return np.broadcast_to(np.asarray(found, dtype=float), (population.count,))
