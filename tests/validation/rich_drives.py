"""Random drives with what `random_drives` leaves out: waves over the angle, bent springs, one's own laws."""

from itertools import count
from math import sqrt
from typing import Any

import numpy as np

from actuator_lti.design import model
from tests.changed import changed
from tests.loops.own_laws import random_law
from tests.validation import random_drives
from tests.validation.random_drives import DAMPED, Dice, Parts, full_drive, full_torque, is_allowed


def rich_drive(seed: int, own_law: bool = True) -> model.Design:
    """A drive with any features that a design file may hold, stable or not."""
    return next(filter(is_allowed, (_rich(n, own_law) for n in count(DAMPED + 1000 * seed))))


def _rich(seed: int, own_law: bool) -> model.Design:
    design, dice = full_drive(seed), Dice(3 * 10**6 + seed)
    for change in (_springy, _bent, _waves, _rubbing, _timed, _filtering, _limited, _measuring):
        design = changed(design, **change(dice, design))
    return _with_law(dice, design) if own_law and dice.chance(0.3) and is_allowed(design) else design


def _springy(dice: Dice, design: model.Design) -> Parts:
    plain = design.coupling is None and design.controller.position is not None
    return random_drives.elastic(dice, design) if plain else {}


def _bent(dice: Dice, design: model.Design) -> Parts:
    """A spring of several pieces between any two gears, friction of every kind behind it."""
    if design.coupling is None:
        return {}
    k, torque = design.coupling.stiffness_Nm_rad, full_torque(design) * design.total_ratio
    spring: Parts = {"after": dice.one_of(None, *(gear.name for gear in design.gears))}
    for number in range(dice.one_of(0, 1, 2)):
        spring[f"torque_{number + 1}_Nm"] = torque * dice.decades(0.02, 0.1) * 10.0**number
        spring[f"stiffness_{number + 2}_Nm_rad"] = k * dice.decades(0.4, 4.0)
    behind = {"viscous_Nms_rad": 0.01 * sqrt(k * design.inertia_kgm2) * design.total_ratio}
    behind |= {"offset_torque_Nm": 1e-3 * torque, "breakaway_ratio": dice.one_of(1.0, 1.4)}
    parts: Parts = {"coupling": spring}
    return parts | ({"load": {"friction": behind}} if design.load.friction else {})


def _waves(dice: Dice, design: model.Design) -> Parts:
    """Cogging and gear error, whose slopes a tick is short against."""
    J, T, waves = design.inertia_kgm2, design.controller.period_s, {}
    fastest = design.limits.voltage_V / design.effective_motor.back_emf_constant_Vs_rad
    for part, key, N in (("motor", "cogging", 1.0), ("load", "gear_error", design.total_ratio)):
        if dice.chance(0.3):
            order = min(dice.one_of(1.0, 3.0, 12.0), 0.4 / T / fastest)  # in a turn of the motor
            peak = min(dice.decades(1e-5, 1e-3) * J / T**2 / order, 0.02 * full_torque(design)) * N
            phase = {f"{key}_phase_rad": dice.rng.uniform(0.0, 3.0)}
            waves[part] = phase | {f"{key}_Nm": peak, f"{key}_periods": order * N}
    return waves


def _rubbing(dice: Dice, design: model.Design) -> Parts:
    """Friction of its own in each direction, as a map or not, with an offset."""
    friction, share, dry = design.friction, dice.decades(0.5, 2.0), design.friction.dry_torque_Nm
    if not dice.chance(0.5):
        return {}
    own: Parts = {"breakaway_ratio": dice.one_of(1.0, 1.6), "offset_torque_Nm": 0.1 * dry}
    mapped = friction.law == "coulomb" and dry > 0.0 and friction.dry_torque_reverse_Nm is None
    own |= random_drives.friction_map(design) if mapped and dice.chance(0.5) else {}
    points = own.get("points", friction.points)
    if points and dice.chance(0.5):
        back = tuple(changed(one, direction="reverse", torque_Nm=share * one.torque_Nm) for one in points)
        own["points"] = (*(changed(one, direction="forward") for one in points), *back)
    return {"friction": own if points else own | {"dry_torque_reverse_Nm": share * dry}}


def _timed(dice: Dice, design: model.Design) -> Parts:
    """Any delay, times by which integrals are tracked."""
    control, T = design.controller, design.controller.period_s
    ticks = dice.one_of(control.computing_delay_s / T, dice.rng.uniform(0, 3))
    parts: Parts = {"computing_delay_s": T * ticks}
    for stage in ("current", "velocity"):
        loop = getattr(control, stage)
        if loop is not None and loop.anti_windup == "back-calculation" and dice.chance(0.5):
            parts[stage] = {"tracking_time_s": dice.decades(5.0, 50.0) * T}
    if control.current is not None:
        parts.setdefault("current", {})["resistance_feedforward"] = dice.one_of(0.0, 0.0, 0.5)
    return {"controller": parts}


def _filtering(dice: Dice, design: model.Design) -> Parts:
    """A skewed notch, a damping of one's own in the filter of the command."""
    velocity, damping = design.controller.velocity, {"command": {"filter_damping": dice.decades(0.4, 1.2)}}
    if velocity is None or not dice.chance(0.3):
        return damping
    at = 0.3 / (design.controller.period_s * velocity.every)
    pair = {"zero_rad_s": at * dice.decades(0.5, 2.0), "pole_rad_s": at * dice.decades(0.5, 2.0)}
    on = dice.one_of("torque", "speed")
    notch = model.Filter(kind="skewed-notch", on=on, **pair, width_rad_s=0.5 * at, depth=0.1)
    return damping | {"controller": {"velocity": {"filters": (*velocity.filters, notch)}}}


def _limited(dice: Dice, design: model.Design) -> Parts:
    """A slope of the current, an overload protection that lets go later."""
    if design.controller.current is None or not dice.chance(0.3):
        return {}
    peak = min(design.limits.peak_current_A, design.limits.voltage_V / design.motor.resistance_ohm)
    slope = dice.decades(0.01, 1.0) * peak / design.controller.period_s
    return {"limits": {"current_rate_A_s": slope, "release": dice.rng.uniform(0.5, 1.0)}}


def _measuring(dice: Dice, design: model.Design) -> Parts:
    """Differences over several samples, noise of every signal."""
    noise: Parts = {}
    if design.instruments.jitter_s:
        amperes = 1e-3 * design.limits.voltage_V / design.motor.resistance_ohm
        full = design.validation.full_deflection_rad
        noise = {"current_noise_A": amperes, "output_angle_noise_rad": 1e-5 * full}
    samples = dice.one_of(1, 3) if design.encoder.speed == "difference" else 1
    return {"encoder": {"difference_samples": samples}, "instruments": noise}


def _with_law(dice: Dice, design: model.Design) -> model.Design:
    """With a law of one's own in any stage, beside which the speed is not filtered."""
    velocity = design.controller.velocity and {"filters": design.controller.velocity.filters_on("torque")}
    plain = changed(design, controller={"velocity": velocity}, encoder={"filter_time_s": 0.0})
    return random_law(dice.rng, plain, dice.one_of(*design.controller.stages))


def random_inputs(
    design: model.Design, rng: np.random.Generator, ticks: int
) -> tuple[np.ndarray, np.ndarray]:
    """Commands and moments at the load, one a tick: waves and a step that reach limits now and then."""
    size, load = sizes(design)
    phase = 2.0 * np.pi * np.arange(ticks) / ticks
    command = size * (np.sin(rng.uniform(0.5, 3.0) * phase) + rng.uniform(-1.0, 1.0) * (phase > 3.0))
    return command, load * np.sin(rng.uniform(0.5, 2.0) * phase + 1.0)


def sizes(design: model.Design) -> tuple[float, float]:
    """Of the command, in the unit of the outermost stage, and of a moment that the motor can hold."""
    limits, motor, N = design.limits, design.effective_motor, design.total_ratio
    top = min(limits.speed_rad_s, limits.voltage_V / motor.back_emf_constant_Vs_rad) / N
    amperes = min(limits.peak_current_A, limits.voltage_V / motor.resistance_ohm)
    full: dict[str, Any] = {"velocity": top, "current": amperes, "voltage": limits.voltage_V}
    size = full.get(design.controller.outermost, 0.3 * design.validation.full_deflection_rad)
    return size, 0.2 * N * full_torque(design)
