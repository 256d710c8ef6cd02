"""Static figures of many drives at once: output rate, motor current, acceleration at a hinge moment."""

from __future__ import annotations

from math import inf

import numpy as np

from actuator_lti.batch.parameters import Population
from actuator_lti.errors import InputError

DRIVE_QUANTITIES = ("output_rate", "motor_current", "acceleration")
Floats = np.ndarray


def drive_figures(population: Population, quantity: str, load_Nm: float = 0.0) -> Floats:
    """One static figure of every design, shape (count,): deg/s, A or deg/s^2 (linear axis: m/s, A, m/s^2).

    Of the two directions of motion the slower counts (then the weaker, then the one that needs more
    current), with the hinge moment against the motion on a back-drivable path.

    - ``output_rate``: largest steady rate of the output within the speed limit, what the supply allows
      (U = R i + kE w) and what the largest torque allows, with kM i = Tc + Cv w; 0 where it does not move.
    - ``motor_current``: the current at that rate.
    - ``acceleration``: largest acceleration of the output from rest, within the acceleration limit.

    Raises
    ------
    InputError
        For another quantity, or the current of an ideal torque source.
    """
    if quantity not in DRIVE_QUANTITIES:
        raise InputError(f"quantity {quantity!r}: one of {', '.join(DRIVE_QUANTITIES)}")
    if quantity == "motor_current" and not population.design.motor.has_electrical_dynamics:
        raise InputError("motor_current: an ideal torque source has no current")
    forward, backward = (_one_way(population, load_Nm, direction) for direction in (1, -1))
    worse = _later(forward, backward)
    place = DRIVE_QUANTITIES.index(quantity)
    values = np.where(worse, backward[place], forward[place])
    if quantity == "motor_current" or population.design.axis == "linear":
        return values
    return np.rad2deg(values)


def _later(forward: tuple[Floats, ...], backward: tuple[Floats, ...]) -> Floats:
    """Where backward motion is the worse: slower, then weaker, then with more current."""
    rate, current, acceleration = (b - f for f, b in zip(forward, backward, strict=True))
    with np.errstate(invalid="ignore"):
        by_current = (acceleration == 0.0) & (current > 0.0)
        return (rate < 0.0) | ((rate == 0.0) & ((acceleration < 0.0) | by_current))


def _one_way(population: Population, load_Nm: float, direction: int) -> tuple[Floats, Floats, Floats]:
    """Rate (rad/s), current (A) and acceleration (rad/s^2) of one direction."""
    ratio = population.total_ratio
    against = _against(population, load_Nm, direction)
    viscous = population.viscous(direction)
    torque = _stall_torque(population)
    speed = _top_speed(population, against, viscous, torque)
    constant = population.get("motor.torque_constant", np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        current = np.where(np.isfinite(speed), (against + viscous * speed) / constant, np.nan)
        breaks_away = torque > against * population.get("friction.breakaway_ratio")
        gain = np.where(breaks_away, np.maximum(torque - against, 0.0) / population.inertia_kgm2, 0.0)
    acceleration = np.minimum(gain, population.get("limits.acceleration"))
    shape = (population.count,)
    return tuple(  # type: ignore[return-value]
        np.broadcast_to(np.asarray(v, dtype=float), shape)
        for v in (speed / ratio, current, acceleration / ratio)
    )


def _against(population: Population, load_Nm: float, direction: int) -> Floats | float:
    """Constant torque at the motor against motion: dry friction, offset, load where it passes."""
    total = population.dry_Nm(load_Nm, direction) + direction * population.get("friction.offset_torque")
    if population.design.load.path == "back-drivable":
        total = total + abs(load_Nm) / population.total_ratio
    return total


def _stall_torque(population: Population) -> Floats | float:
    """Largest motor torque at rest."""
    voltage = population.get("limits.voltage")
    if not population.design.motor.has_electrical_dynamics:
        return population.get("motor.source_gain") * voltage
    current = voltage / population.get("motor.resistance")
    if population.design.controller.current is not None:
        current = np.minimum(current, population.get("limits.peak_current"))
    return population.get("motor.torque_constant") * current


def _top_speed(
    population: Population, against: Floats | float, viscous: Floats | float, torque: Floats | float
) -> Floats:
    """Largest steady motor speed."""
    has_limit = population.design.controller.velocity is not None
    speed: Floats | float = population.get("limits.speed", inf) if has_limit else inf
    with np.errstate(divide="ignore", invalid="ignore"):
        by_torque = np.where(np.asarray(viscous) > 0.0, np.divide(torque - against, viscous), inf)
        speed = np.minimum(speed, by_torque)
        if population.design.motor.has_electrical_dynamics:
            drop = population.get("motor.resistance") / population.get("motor.torque_constant")
            slope = population.get("motor.back_emf_constant") + drop * viscous
            speed = np.minimum(speed, (population.get("limits.voltage") - drop * against) / slope)
    return np.where(np.asarray(torque) > against, speed, 0.0)
