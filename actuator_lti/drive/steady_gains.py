"""Torque of the motor in steady motion, by what its controllers are asked for: gain, and droop at speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actuator_lti.design.law import Law
    from actuator_lti.design.model import Design


def stage_gain(gain: Any, law: Law | None) -> Any:
    """Gain of a stage on a command at rest: of a law of one's own at zero frequency, inf if it integrates."""
    return gain if law is None else law.steady("command")


def steady_gain(item: Any) -> Any:
    """Gain of a filter at DC: 1 but for a sampled biquad."""
    if item.kind != "biquad":
        return 1.0
    b, a = item.polynomials
    return sum(b) / sum(a)


def filtered(design: Design, place: Any) -> Any:
    """Gain at DC of the velocity loop's filters at a place."""
    velocity = design.controller.velocity
    return math.prod(steady_gain(item) for item in velocity.filters_on(place)) if velocity else 1.0


def torque_gain_Nm_rad(design: Design) -> Any:
    """Motor torque per position error at the output: rotor at rest, current settled, no speed integral."""
    control = design.controller
    gain = stage_gain(control.position_loop.gain, control.position_loop.law) * design.total_ratio
    if control.velocity is not None:
        gain = gain * stage_gain(control.velocity.gain, control.velocity.law) * filtered(design, "torque")
    return gain * drive_gain(design)


def drive_gain(design: Design) -> Any:
    """Motor torque at rest per drive signal, N m/A or N m/V: the current or voltage that is asked for."""
    motor, current = design.effective_motor, design.controller.current
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V
    assert motor.torque_constant_Nm_A is not None
    assert motor.resistance_ohm is not None
    if current is None:
        return motor.torque_constant_Nm_A / motor.resistance_ohm
    stiff = _held_ohm(design)
    if stiff is None:
        return motor.torque_constant_Nm_A
    fed = current.gain_V_A if current.law is None else current.law.steady("command")
    return motor.torque_constant_Nm_A * (fed + current.resistance_feedforward * motor.resistance_ohm) / stiff


def _held_ohm(design: Design) -> Any:
    """Volts per ampere of a settled current: R and the current loop's P gain; None behind an integral."""
    current, resistance = design.controller.current, design.effective_motor.resistance_ohm
    assert resistance is not None
    if current is None:
        return resistance
    law = current.law
    if law is None:
        return None if current.integral_time_s is not None else current.gain_V_A + resistance
    return None if law.integrates else resistance + law.steady("error") - law.steady("current")


def back_emf_Nms_rad(design: Design) -> Any:
    """Motor torque lost per speed to back-EMF that no current integral and no feed-forward makes up for."""
    motor, current = design.effective_motor, design.controller.current
    stiff = None if motor.source_gain_Nm_V is not None else _held_ohm(design)
    if stiff is None:
        return 0.0
    assert motor.torque_constant_Nm_A is not None
    assert motor.back_emf_constant_Vs_rad is not None
    left = 1.0 if current is None else 1.0 - current.back_emf_feedforward
    return motor.torque_constant_Nm_A * left * motor.back_emf_constant_Vs_rad / stiff


def droop(design: Design) -> tuple[Any, Any] | None:
    """Motor torque at speed 0 and its fall per speed, N m s/rad, the speed command at its limit.

    A P velocity loop gives torque only for an error of the speed: ``T = G (Kp (w_lim - w) + i_fr) - B w``,
    with G of `drive_gain`, B of `back_emf_Nms_rad` and the filters' gains at DC. ``None``: it has an integral
    (or a law of its own), so nothing is left of the error.
    """
    control = design.controller
    velocity, position = control.velocity, control.position
    if velocity is None or velocity.law is not None or velocity.integral_time_s is not None:
        return None
    per_signal = drive_gain(design) * filtered(design, "torque")
    fed = position.friction_feedforward if position is not None and position.law is None else 0.0
    start = per_signal * (velocity.gain * design.limits.speed_rad_s + fed)
    return start, per_signal * velocity.gain * filtered(design, "speed") + back_emf_Nms_rad(design)
