"""What a drive can do at a load, in closed form: stall, breakaway, torque gain, top speed, acceleration.

Of one design or a stacked one, arrays of shape (K,). Sources: paper, equations (1), (2), (9); model.md
sections 1, 6.
"""

import math
from dataclasses import dataclass
from typing import Any

from actuator_lti.design.model import Design
from actuator_lti.drive.choice import finite, larger, smaller, where
from actuator_lti.drive.operating import Operating, dry_torque, friction_slopes, stiffness_there, train_gain
from actuator_lti.drive.steady import (
    back_emf_Nms_rad,
    circuit_resistance_ohm,
    current_limit_torque_Nm,
    droop,
    voltage_limit_torque_Nm,
    winding,
)
from actuator_lti.drive.wiring import present
from actuator_lti.errors import InputError

NOTHING, SPEED_LIMIT, FORCE, VOLTAGE, DROOP = range(5)
RATE_LIMITS = ("nothing", "speed limit", "force", "voltage", "speed limit less droop of the P velocity loop")
"""What sets the largest speed, by the number that `Capability.rate_limit` holds."""
ROUNDING = 1e-12  # of a speed: nearer than that, two bounds are one


@dataclass(frozen=True)
class Capability:
    """Figures of the whole drive at one load torque, the worse of both directions; floats or arrays."""

    output_rate_rad_s: Any  # largest steady speed of the output within the limits, ``inf`` without any
    rate_limit: Any  # what sets it, a place in `RATE_LIMITS`
    motor_current_A: Any  # needed there; NaN for an ideal source or where the speed has no bound
    acceleration_rad_s2: Any  # largest of the output from rest, within its limit; 0 if it cannot move
    # Motor torque at rest over what friction and the load ask of it to start, the smaller of both directions;
    # ``inf`` where nothing holds it (ECSS-E-ST-33-01C: motorization factor)
    torque_margin: Any


def stall_torque_Nm(design: Design) -> Any:
    """Largest motor torque at rest; ``inf`` without a limit."""
    motor, limits = design.effective_motor, design.limits
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V * limits.voltage_V
    torque = voltage_limit_torque_Nm(design, 0.0)
    if design.controller.current is not None:
        torque = smaller(torque, current_limit_torque_Nm(design, 0.0))
    return torque


def resonance_rad_s(design: Design, load_Nm: float = 0.0) -> Any:
    """Undamped, of the spring's piece under a load: ``sqrt(k (1/J_l + 1/(J_m N_c^2)))``."""
    ratio = design.ratio_to_coupling
    inverse = 1.0 / design.load_side_inertia_kgm2 + 1.0 / (design.motor_side_inertia_kgm2 * ratio**2)
    return (stiffness_there(design, Operating(load_Nm=load_Nm)) * inverse) ** 0.5


def passed_moment_Nm(design: Design, load_Nm: float) -> Any:
    """Torque at the motor by a load torque on the output shaft; 0 where the load path locks itself."""
    return load_Nm / design.total_ratio if design.load.path == "back-drivable" else 0.0


def breakaway_torque_Nm(design: Design, load_Nm: float, direction: int) -> Any:
    """Motor torque that starts motion, 0 where the load does; the ratio is of dry friction (section 6)."""
    needed = _held_torque(design, load_Nm, direction) - direction * passed_moment_Nm(design, load_Nm)
    return larger(needed, 0.0)


def _held_torque(design: Design, load_Nm: float, direction: int) -> Any:
    """Largest static friction, offset, and ripple: what the drive torque has to exceed without a load."""
    friction, behind = design.friction, design.load.friction
    ratio = friction.breakaway_ratio if friction.law == "coulomb" else 0.0
    total = dry_torque(design, load_Nm, direction) * ratio + direction * friction.offset_torque_Nm
    ripple = design.load.over_angle.ripple_Nm / design.ratio_behind_coupling
    total = total + design.motor.over_angle.ripple_Nm + train_gain(design, ratio) * ripple
    if behind is None or design.coupling is None:
        return total
    locked = behind.dry_torque_Nm * behind.breakaway_ratio + direction * behind.offset_torque_Nm
    return total + train_gain(design, ratio) * locked


def held_moment_Nm(design: Design, torque_Nm: float) -> float:
    """Moment with which a motor torque presses on an output held fast: friction takes its part of both.

    Never more than the torque through the ratio, whatever friction by load a self-locking design leaves out.

    >>> from actuator_lti.design import load_design
    >>> fin = load_design("fin")  # (T - C0)/(1/N + CM)
    >>> round(held_moment_Nm(fin, 0.05), 6) == round((0.05 - 0.008) / (1 / 60 + 1.7e-3), 6)
    True
    """
    way = 1 if torque_Nm > 0.0 else -1
    left = abs(torque_Nm) - dry_torque(design, 0.0, way) - way * design.friction.offset_torque_Nm
    at_coupling = max(left, 0.0) / max(train_gain(design), 1.0 / design.ratio_to_coupling)
    return way * float(at_coupling) * design.ratio_behind_coupling


def driven_inertia_kgm2(design: Design) -> Any:
    """Inertia that the motor speeds up, at its shaft; a coupling's torque is carried with its friction."""
    if design.coupling is None:
        return design.inertia_kgm2
    behind = design.load_side_inertia_kgm2 / design.ratio_to_coupling
    return design.motor_side_inertia_kgm2 + train_gain(design) * behind


def resistance_Nm(design: Design, load_Nm: float, direction: int) -> Any:
    """Constant torque at the motor against motion: dry friction, offset, load where it passes."""
    friction, behind = design.friction, design.load.friction
    total = dry_torque(design, load_Nm, direction) + direction * friction.offset_torque_Nm
    total = total + passed_moment_Nm(design, abs(load_Nm))
    if behind is None or design.coupling is None:
        return total
    return total + train_gain(design) * (behind.dry_torque_Nm + direction * behind.offset_torque_Nm)


def _speed_slopes(design: Design, direction: int) -> list[tuple[float, Any]]:
    """Slope of friction over the motor's speed, piece by piece: (speed from which it holds, slope)."""
    behind, damping = design.load.friction, design.load.moment_damping_Nms_rad
    more: Any = 0.0
    if behind is not None and design.coupling is not None:
        more = train_gain(design) * behind.viscous_Nms_rad / design.ratio_to_coupling
    if present(damping):
        more = more + train_gain(design) * damping / (design.total_ratio * design.ratio_behind_coupling)
    pieces = friction_slopes(design, direction)
    return [(start, slope + more) for start, slope in pieces] if present(more) else pieces


def _top_speed(design: Design, against: Any, slopes: list[tuple[float, Any]]) -> tuple[Any, Any, Any]:
    """Largest steady motor speed, what sets it, and the torque against motion there."""
    motor, limits, stall = design.effective_motor, design.limits, stall_torque_Nm(design)
    bounds: list[tuple[int, Any]] = []
    if design.controller.velocity is not None:
        bounds.append((SPEED_LIMIT, limits.speed_rad_s))
        if (pulls := droop(design)) is not None:
            rises = _first_root(against - pulls[0], slopes, pulls[1])
            bounds.append((DROOP, where(pulls[0] > against, rises, 0.0)))
    falls = 0.0 if design.controller.current is None else back_emf_Nms_rad(design)
    bounds.append((FORCE, _first_root(against - stall, slopes, falls)))
    if motor.source_gain_Nm_V is None:
        R, (_, kM, kE) = circuit_resistance_ohm(design), winding(motor)
        bounds.append((VOLTAGE, _first_root(against - kM * limits.voltage_V / R, slopes, kM * kE / R)))
    speed: Any = math.inf
    cause: Any = NOTHING
    for kind, bound in bounds:
        nearer = bound < speed * (1.0 - ROUNDING)
        speed, cause = where(nearer, bound, speed), where(nearer, kind, cause)
    moves = stall > against
    speed, cause = where(moves, speed, 0.0), where(moves, cause, FORCE)
    return speed, cause, against + slopes_torque(slopes, speed)


def speed_torque_Nm(design: Design, speed_rad_s: Any) -> Any:
    """Torque forward of what grows with the speed: viscous friction or its map, behind too, damping."""
    return slopes_torque(_speed_slopes(design, 1), speed_rad_s)


def slopes_torque(slopes: list[tuple[float, Any]], speed: Any) -> Any:
    """Torque of the speed-dependent part at a speed (0 at an unbounded one, where it has no meaning)."""
    bounded = where(finite(speed), speed, 0.0)
    total, last = 0.0, 0.0
    for start, slope in slopes:
        total = total + (slope - last) * larger(bounded - start, 0.0)
        last = slope
    return total


def steady_torque_Nm(design: Design, load_Nm: float, speed_rad_s: Any) -> Any:
    """Motor torque for a steady motion forward against a load, friction and damping on the way."""
    return resistance_Nm(design, _with_own_Nm(design, load_Nm), 1) + speed_torque_Nm(design, speed_rad_s)


def _first_root(start_value: Any, slopes: list[tuple[float, Any]], more: Any) -> Any:
    """First speed where ``start_value + friction(w) + more w`` rises through 0; inf where it does not."""
    result: Any = math.inf
    value = start_value
    for (start, slope), end in zip(slopes, [*(start for start, _ in slopes[1:]), None], strict=True):
        rise = slope + more
        rises = rise > 0.0
        root = where(rises, start - value / where(rises, rise, 1.0), math.inf)
        hit = (root >= start) & (result == math.inf)
        if end is not None:
            hit = hit & (root <= end)
            value = value + rise * (end - start)
        result = where(hit, root, result)
    return result


def _one_way(design: Design, load_Nm: float, direction: int) -> Capability:
    against = resistance_Nm(design, load_Nm, direction)
    speed, cause, torque = _top_speed(design, against, _speed_slopes(design, direction))
    stall, kM = stall_torque_Nm(design), design.effective_motor.torque_constant_Nm_A
    needed = _held_torque(design, load_Nm, direction) + passed_moment_Nm(design, abs(load_Nm))
    gain = where((stall > needed) & (stall > against), (stall - against) / driven_inertia_kgm2(design), 0.0)
    held = larger(needed, against)
    holds = held > 0.0
    margin = where(holds, stall / where(holds, held, 1.0), math.inf)
    limit = design.limits.acceleration_rad_s2
    current = math.nan if kM is None else where(finite(speed), torque / kM, math.nan)
    return Capability(
        output_rate_rad_s=speed / design.total_ratio, rate_limit=cause, motor_current_A=current,
        acceleration_rad_s2=smaller(gain, limit) / design.total_ratio, torque_margin=margin
    )  # fmt: skip


def _with_own_Nm(design: Design, load_Nm: float) -> Any:
    """A load torque and the load's own at output angle 0 (gravity), without gear error."""
    return load_Nm + design.load.over_angle.at(0.0, moving=True)


def capability(design: Design, load_Nm: float = 0.0) -> Capability:
    """Rate, current and acceleration at a load torque (either sign): the worse of both directions.

    Worse is the slower direction, then the weaker, then the one that needs more current. On a back-drivable
    path the load torque, with the load's own at output angle 0 (gravity), is against the motion.

    Raises `InputError`: if the load is not finite.
    """
    if not math.isfinite(load_Nm):
        raise InputError(f"load_Nm = {load_Nm}: must be finite")
    whole = _with_own_Nm(design, load_Nm)
    ahead, back = (_one_way(design, whole, direction) for direction in (1, -1))
    slower = back.output_rate_rad_s < ahead.output_rate_rad_s
    weaker = back.acceleration_rad_s2 < ahead.acceleration_rad_s2
    as_strong = back.acceleration_rad_s2 == ahead.acceleration_rad_s2
    currents = (back.motor_current_A, ahead.motor_current_A)
    hungry, content = (where(each == each, each, 0.0) for each in currents)  # NaN: none
    hungrier = hungry > content
    as_fast = back.output_rate_rad_s == ahead.output_rate_rad_s
    worse = slower | (as_fast & (weaker | (as_strong & hungrier)))
    names = Capability.__dataclass_fields__
    figures = {n: where(worse, getattr(back, n), getattr(ahead, n)) for n in names}
    return Capability(**{**figures, "torque_margin": smaller(ahead.torque_margin, back.torque_margin)})
