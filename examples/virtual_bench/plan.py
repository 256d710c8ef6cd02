"""What is done on the bench of a compliant drive: a plan that fits the drive."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, pi

import numpy as np

from actuator_lti.design import no_load_speed
from actuator_lti.design.model import Design
from actuator_lti.drive.facts import resonance_rad_s, steady_torque_Nm
from actuator_lti.drive.operating import Operating, stiffness_there
from actuator_lti.drive.steady import circuit_resistance_ohm, motor_torque_Nm
from actuator_lti.errors import InputError
from analyses.identification.two_mass import angle_responses
from examples.virtual_bench.two_mass import TwoMassPlan

LOG_RATE = 20.0
"""Rows of the log in a cycle of the resonance."""
SPACING = 50.0
"""Lines up to the resonance."""
TOP = 4.0
SPEED_SHARE = 0.25
CURRENT_SHARE = 0.3
RIPPLE_SHARE = 1.0 / 6.0
WOBBLE_SHARE = 0.2
REVERSALS = 12.0


def plan_for(design: Design) -> TwoMassPlan:
    """A plan whose motion stays in one direction, on one flank of the play, and within the drive's limits.

    Fifty lines up to the resonance and three times as many above it; a quarter of the largest speed, against
    a moment that takes three tenths of the continuous current. The lines are as large as the coupling's
    flank, the direction of motion and the current allow: rms a sixth of the mean torque in the coupling, a
    fifth of the speed, three tenths of the peak current.

    Raises `InputError`: for a drive without a current loop or a coupling, or that a moment does not drive
    back.
    """
    if design.controller.current is None or design.coupling is None or design.axis != "rotary":
        raise InputError("this bench needs a rotary drive with a current loop and a coupling", design.name)
    if design.load.path != "back-drivable":
        raise InputError('load.path = "self-locking": no moment keeps the coupling on its flank', design.name)
    if not design.load_side_inertia_kgm2 > 0.0:
        raise InputError("no inertia behind the coupling: there is no resonance", design.name)
    current, speed = _continuous(design), SPEED_SHARE * _largest_speed(design)
    moment = _moment(design, CURRENT_SHARE * current, speed)
    resonance_hz = float(resonance_rad_s(design, moment)) / (2.0 * pi)
    tick = design.controller.period_s
    log = tick * max(int(1.0 / (LOG_RATE * resonance_hz * tick)), 1)
    period = log * round(SPACING / resonance_hz / log)
    plan = TwoMassPlan(
        period_s=period,
        settle_s=5.0 * period,
        lowest_hz=1.0 / period,
        highest_hz=min(TOP * resonance_hz, 0.35 / log),
        moment_Nm=moment,
        speed_rad_s=speed,
        log_period_s=log,
    )
    return _with_reversal(design, replace(plan, line_A=_line(design, plan)))


def _continuous(design: Design) -> float:
    limits = design.limits
    for value in (limits.continuous_current_A, limits.peak_current_A):
        if isfinite(value):
            return value
    return float(limits.voltage_V / circuit_resistance_ohm(design))


def _largest_speed(design: Design) -> float:
    return float(min(design.limits.speed_rad_s, no_load_speed(design)))


def _moment(design: Design, current_A: float, speed_rad_s: float) -> float:
    """Moment at the output that takes a current at a speed, friction and its growth with the load counted."""
    own, more = (steady_torque_Nm(design, load, speed_rad_s) for load in (0.0, 1.0))
    left = motor_torque_Nm(design, current_A, 0.0) - own
    if not left > 0.0:
        raise InputError("friction alone takes the bench's current", design.name)
    return float(left / (more - own))


def _line(design: Design, plan: TwoMassPlan) -> float:
    """Amplitude of the current's lines."""
    constant = design.effective_motor.torque_constant_Nm_A or 0.0
    coupling, friction = design.coupling, design.load.friction
    assert coupling is not None
    stiffness = float(stiffness_there(design, Operating(load_Nm=plan.moment_Nm)))
    values = {
        "motor_inertia": design.motor_side_inertia_kgm2,
        "load_inertia": design.load_side_inertia_kgm2,
        "stiffness": stiffness,
        "damping": max(coupling.damping_Nms_rad, 1e-3 * stiffness * plan.log_period_s),
        "viscous": design.friction.viscous(),
        "load_viscous": 0.0 if friction is None else friction.viscous_Nms_rad,
    }
    omega = 2.0 * pi * np.arange(plan.lowest_hz, plan.highest_hz, 1.0 / plan.period_s)
    ratio = design.ratio_to_coupling
    motor, load = angle_responses(omega, values, ratio)
    spring = (values["stiffness"] + 1j * omega * values["damping"]) * (motor / ratio - load)

    def rms(response: np.ndarray) -> float:
        return float(np.sqrt(0.5 * np.sum(np.abs(constant * response) ** 2)))

    return min(
        RIPPLE_SHARE * plan.moment_Nm / design.ratio_behind_coupling / rms(spring),
        WOBBLE_SHARE * plan.speed_rad_s / rms(1j * omega * motor),
        CURRENT_SHARE * min(_continuous(design), design.limits.peak_current_A) / np.sqrt(0.5 * len(omega)),
    )


def _with_reversal(design: Design, plan: TwoMassPlan) -> TwoMassPlan:
    """The plan with a sine of the current that is well above the dry friction and below the largest speed."""
    constant = design.effective_motor.torque_constant_Nm_A or 0.0
    load = design.load.friction
    behind = 0.0 if load is None else load.dry_torque_Nm / design.ratio_to_coupling
    dry = design.friction.dry_Nm(0.0) + behind
    current = max(CURRENT_SHARE * _continuous(design), 3.0 * dry / constant)
    swing = constant * current / design.inertia_kgm2
    lowest = swing / (2.0 * pi * 0.4 * _largest_speed(design))
    hertz = max(lowest, 0.015 / plan.log_period_s / LOG_RATE)
    return replace(plan, reversal_A=current, reversal_hz=hertz, reversal_s=REVERSALS / hertz)
