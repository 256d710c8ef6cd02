"""What the drive can do at a load, in words and numbers (`actuator_lti.drive.facts` has the closed forms)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import RATE_LIMITS, capability


@dataclass(frozen=True)
class DriveFigures:
    """Figures of the whole drive at one load torque; output side in rad (linear axis: m)."""

    load_Nm: float  # load torque at the output shaft
    # Largest steady speed of the output within the speed, voltage and peak current limits; 0 if it cannot
    # move; ``inf`` without any limit
    output_rate_rad_s: float
    rate_limit: str  # what sets it: one of `RATE_LIMITS`
    # Current needed at that speed; ``None`` without a motor current (ideal source) or where the speed has no
    # bound
    motor_current_A: float | None
    # Largest acceleration of the output from rest, within the acceleration limit; 0 if it cannot move
    acceleration_rad_s2: float


def drive_figures(design: Design, load_Nm: float = 0.0) -> DriveFigures:
    """Rate, current and acceleration of a drive at a load at the output, N m (linear axis: N), either sign.

    Raises
    ------
    InputError
        If the load is not finite.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> result = drive_figures(load_design("ilr33-amber"), load_Nm=8.0)
    >>> round(result.motor_current_A, 3), result.rate_limit
    (3.037, 'speed limit')
    """
    capacity = capability(design, load_Nm)
    current = float(capacity.motor_current_A)
    return DriveFigures(
        load_Nm=load_Nm,
        output_rate_rad_s=float(capacity.output_rate_rad_s),
        rate_limit=RATE_LIMITS[int(capacity.rate_limit)],
        motor_current_A=None if math.isnan(current) else current,
        acceleration_rad_s2=float(capacity.acceleration_rad_s2),
    )
