"""Static figures of many drives at once: output rate, motor current, acceleration at a hinge moment."""

from __future__ import annotations

from math import inf

import numpy as np

from actuator_lti.batch.parameters import Population
from actuator_lti.errors import InputError

DRIVE_QUANTITIES = ("output_rate", "motor_current", "acceleration")


def drive_figures(population: Population, quantity: str, load_Nm: float = 0.0) -> np.ndarray:
    """One static figure of every design, shape (count,): deg/s, A or deg/s^2 (linear axis: m/s, A, m/s^2).

    - ``output_rate``: largest steady rate of the output moving against the load: the smallest of the
      speed limit, of what the supply allows (U = R i + kE w) and of what the peak current allows, with
      kM i = Tc + Cv w (plus \\|M_ext\\|/N on a back-drivable path). 0 where the drive does not move.
    - ``motor_current``: the current at that rate.
    - ``acceleration``: largest acceleration of the output from rest, kM i - Tc over J, with i the smaller
      of the peak current and U/R, and not above the acceleration limit.

    Raises
    ------
    InputError
        For another quantity, or the current of an ideal torque source.
    """
    if quantity not in DRIVE_QUANTITIES:
        raise InputError(f"quantity {quantity!r}: one of {', '.join(DRIVE_QUANTITIES)}")
    design = population.design
    electrical = design.motor.has_electrical_dynamics
    if quantity == "motor_current" and not electrical:
        raise InputError("motor_current: an ideal torque source has no current")
    opposing, viscous = _opposing(population, load_Nm), population.viscous()
    shown = np.rad2deg(1.0) if design.axis == "rotary" else 1.0
    if quantity == "acceleration":
        torque = _standing_torque(population) - opposing
        acceleration = np.minimum(torque / population.inertia_kgm2, population.get("limits.acceleration"))
        return _filled(population, np.maximum(acceleration, 0.0) / population.total_ratio * shown)
    speed = _top_speed(population, opposing, viscous)
    if quantity == "output_rate":
        return _filled(population, speed / population.total_ratio * shown)
    return _filled(population, (opposing + viscous * speed) / population.get("motor.torque_constant"))


def _opposing(population: Population, load_Nm: float) -> np.ndarray | float:
    """Torque at the motor that opposes motion at any speed."""
    opposing = population.dry_Nm(load_Nm) + population.get("friction.offset_torque")
    if population.design.load.path == "back-drivable":
        opposing = opposing + abs(load_Nm) / population.total_ratio
    return opposing


def _standing_torque(population: Population) -> np.ndarray | float:
    """Largest torque at zero speed."""
    voltage = population.get("limits.voltage")
    if not population.design.motor.has_electrical_dynamics:
        return population.get("motor.source_gain") * voltage
    current = np.minimum(population.get("limits.peak_current"), voltage / population.get("motor.resistance"))
    return population.get("motor.torque_constant") * current


def _top_speed(
    population: Population, opposing: np.ndarray | float, viscous: np.ndarray | float
) -> np.ndarray:
    """Largest steady motor speed."""
    voltage = population.get("limits.voltage")
    limit = population.get("limits.speed", inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        if not population.design.motor.has_electrical_dynamics:
            driven = population.get("motor.source_gain") * voltage - opposing
            return np.maximum(np.minimum(limit, np.divide(driven, viscous)), 0.0)
        resistance, torque = population.get("motor.resistance"), population.get("motor.torque_constant")
        emf = population.get("motor.back_emf_constant")
        by_supply = (voltage * torque - resistance * opposing) / (resistance * viscous + emf * torque)
        spare = torque * population.get("limits.peak_current", inf) - opposing
        by_current = np.where(np.asarray(spare) > 0.0, np.divide(spare, viscous), 0.0)
    return np.maximum(np.minimum(np.minimum(limit, by_supply), by_current), 0.0)


def _filled(population: Population, values: np.ndarray | float) -> np.ndarray:
    return np.broadcast_to(np.asarray(values, dtype=float), (population.count,)).copy()
