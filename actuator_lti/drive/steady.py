"""The drive in steady motion, equations (1), (2): torque, current and voltage; gains at rest, droop at speed.

Everything outside `actuator_lti.drive` that needs ``u = R i + kE w`` or ``M = kM i`` asks here.
"""

import math
from typing import Any

from actuator_lti.design.law import Law
from actuator_lti.design.model import Design, Motor
from actuator_lti.design.plant import torque_per_command


def winding(motor: Motor) -> tuple[Any, Any, Any]:
    """R, kM and kE of a motor that has them: one that is no ideal source."""
    R, kM, kE = motor.resistance_ohm, motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
    assert R is not None
    assert kM is not None
    assert kE is not None
    return R, kM, kE


def circuit_resistance_ohm(design: Design) -> Any:
    """Resistance between the source and the back-EMF while the voltage is at its limit: R + R_s.

    There u = U = U_s - R_s i, so ``U_s = (R + R_s) i + kE w``. It holds for motoring and R_s <= R; a supply
    of more resistance than the winding gives its most current at less than its whole voltage.
    """
    resistance = winding(design.effective_motor)[0]
    return resistance if design.supply is None else resistance + design.supply.resistance_ohm


def motor_torque_Nm(design: Design, current_A: Any, voltage_V: Any) -> Any:
    """``kM i``, or the gain times the drive signal of an ideal source."""
    motor = design.effective_motor
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V * voltage_V
    return winding(motor)[1] * current_A


def steady_input(design: Design, torque_Nm: Any, speed_rad_s: Any) -> tuple[Any, Any]:
    """Current (0 of an ideal source) and voltage at a motor torque and speed: ``i = M/kM``, equation (1)."""
    motor = design.effective_motor
    if motor.source_gain_Nm_V is not None:
        return 0.0 * torque_Nm, torque_Nm / motor.source_gain_Nm_V
    current = torque_Nm / winding(motor)[1]
    return current, steady_voltage_V(design, current, speed_rad_s)


def steady_voltage_V(design: Design, current_A: Any, speed_rad_s: Any) -> Any:
    """``u = R i + kE w`` of a motor with a winding."""
    R, _, kE = winding(design.effective_motor)
    return R * current_A + kE * speed_rad_s


def voltage_limit_torque_Nm(design: Design, speed_rad_s: Any) -> Any:
    """Torque at the voltage limit and a speed, ``kM (U - kE w)/(R + R_s)``."""
    _, kM, kE = winding(design.effective_motor)
    return kM * (design.limits.voltage_V - kE * speed_rad_s) / circuit_resistance_ohm(design)


def current_limit_torque_Nm(design: Design, speed_rad_s: Any) -> Any:
    """Torque at the current limit and a speed; a P current loop falls short of it."""
    return drive_gain(design) * design.limits.peak_current_A - back_emf_Nms_rad(design) * speed_rad_s


def own_drag_Nms_rad(design: Design) -> Any:
    """Damping of the motor by itself: its friction and, without a current loop, its back-EMF ``kM kE/R``."""
    drag = design.friction.viscous_Nms_rad
    if not design.motor.has_electrical_dynamics or design.controller.current is not None:
        return drag
    return drag + torque_per_command(design) * winding(design.effective_motor)[2]


def stage_gain(gain: Any, law: Law | None) -> Any:
    """Gain of a stage on a command at rest: of a law of one's own at zero frequency, inf if it integrates."""
    return gain if law is None else law.steady("command")


def filtered(design: Design, place: Any) -> Any:
    """Gain at DC of the velocity loop's filters at a place: 1 but for sampled biquads."""
    velocity = design.controller.velocity
    filters = () if velocity is None else velocity.filters_on(place)
    biquads = (item.polynomials for item in filters if item.kind == "biquad")
    return math.prod((sum(b) / sum(a) for b, a in biquads), start=1.0)


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
    stiff = None if motor.source_gain_Nm_V is not None else _held_ohm(design)
    if current is None or stiff is None:
        return torque_per_command(design)
    fed = current.gain_V_A if current.law is None else current.law.steady("command")
    return winding(motor)[1] * (fed + fed_forward(design)[0]) / stiff


def fed_forward(design: Design) -> tuple[Any, Any]:
    """What the current stage adds to the voltage, per current command in ohm and per speed in V s/rad."""
    current = design.controller.current
    if current is None:
        return 0.0, 0.0
    R, _, kE = winding(design.controller_model.effective_motor)
    return current.resistance_feedforward * R, current.back_emf_feedforward * kE


def _held_ohm(design: Design) -> Any:
    """Volts per ampere of a settled current: R and the current loop's P gain; None behind an integral."""
    current, (resistance, *_) = design.controller.current, winding(design.effective_motor)
    if current is None:
        return resistance
    law = current.law
    if law is None:
        return None if current.integral_time_s is not None else current.gain_V_A + resistance
    return None if law.integrates else resistance + law.steady("error") - law.steady("current")


def back_emf_Nms_rad(design: Design) -> Any:
    """Motor torque lost per speed to back-EMF that no current integral and no feed-forward makes up for."""
    motor = design.effective_motor
    stiff = None if motor.source_gain_Nm_V is not None else _held_ohm(design)
    if stiff is None:
        return 0.0
    _, kM, kE = winding(motor)
    return kM * (kE - fed_forward(design)[1]) / stiff


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
