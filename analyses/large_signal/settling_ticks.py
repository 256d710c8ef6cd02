"""What runs with friction and limits are given: counted ticks to settle, and a full range to move in."""

from __future__ import annotations

from math import ceil, isfinite, log
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError

TIME_CONSTANTS = 14.0  # of the slowest pole
LONGEST_TICKS = 400_000


def settling_ticks_of(closed_loop: Any, hold_ticks: int, where: str, longest: int = LONGEST_TICKS) -> int:
    """Ticks after which the slowest pole of a sampled closed loop is forgotten."""
    size = np.abs(closed_loop.poles())
    if (size > 1.0 + 1e-9).any():
        raise InputError("the loop is not stable: nothing settles in it", where=where)
    slowest = size[size < 1.0 - 1e-9].max(initial=0.0)
    if slowest <= 0.0:
        return 20 * hold_ticks
    return int(min(ceil(TIME_CONSTANTS / -log(slowest) + 20.0) * hold_ticks, longest))


def full_range(design: Design) -> dict[str, float]:
    """Full deflection (output), motor speed and motor current that a drive can reach."""
    limits, motor = design.limits, design.effective_motor
    speed, current = limits.speed_rad_s, limits.peak_current_A
    if motor.resistance_ohm is not None and motor.back_emf_constant_Vs_rad is not None:
        speed = min(speed, limits.voltage_V / motor.back_emf_constant_Vs_rad)
        current = min(current, limits.voltage_V / motor.resistance_ohm)
    elif motor.source_gain_Nm_V is not None and design.friction.viscous() > 0.0:
        speed = min(speed, limits.voltage_V * motor.source_gain_Nm_V / design.friction.viscous())
    if not isfinite(speed):
        place = design.controller.position  # a gain of 0: a law of one's own
        gain = 1.0 if place is None or place.gain == 0.0 else place.gain
        speed = design.validation.full_deflection_rad * design.total_ratio * gain
    return {"position": design.validation.full_deflection_rad, "velocity": speed, "current": current}
