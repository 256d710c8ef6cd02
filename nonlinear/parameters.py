"""A design becomes the row of floats that the compiled kernel reads."""

from __future__ import annotations

from math import floor, inf, pi

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from nonlinear._kernels import layout as at

Floats = npt.NDArray[np.float64]

MAX_EVENTS_PER_TICK = 1000
TANH_TOLERANCE = 1e-8


def split_delay(delay_s: float, period_s: float) -> tuple[int, float]:
    """Whole ticks and the rest in seconds of a computing delay; a rest below 1e-9 of a tick is none.

    Examples
    --------
    >>> split_delay(3e-4, 1e-4)
    (3, 0.0)
    """
    whole = floor(delay_s / period_s + 1e-9)
    rest = delay_s - whole * period_s
    return (whole, 0.0) if abs(rest) < 1e-9 * period_s else (whole, rest)


def design_row(design: Design, *, friction_on: bool = True, limits_on: bool = True) -> Floats:
    """Parameters of the plant, the controllers and the limits of a design, at rest, without command or load.

    Parameters
    ----------
    design : Design
    friction_on : bool
        ``False`` leaves out the dry friction (C0, CM) and the offset torque; viscous friction stays, so that
        the drive without limits is a linear loop.
    limits_on : bool
        ``False`` takes speed, acceleration, peak current and voltage as unlimited.

    Returns
    -------
    ndarray, shape (layout.SIZE,)
        SI, motor side; the places are the names of ``nonlinear._kernels.layout``.

    Raises
    ------
    InputError
        If the stages of the design do not fit together.
    """
    row = np.zeros(at.SIZE)
    _plant(design, row)
    _friction(design, row, friction_on)
    _controllers(design, row)
    _limits(design, row, limits_on)
    row[at.MAX_EVENTS] = MAX_EVENTS_PER_TICK
    row[at.RECORD_EVERY] = 1
    row[at.TANH_TOLERANCE] = TANH_TOLERANCE
    row[at.TANH_LEVEL] = -1.0
    for point in range(4):
        row[at.PROBES + point * at.PROBE_SIZE + at.PROBE_GAIN] = 1.0
    return row


def _plant(design: Design, row: Floats) -> None:
    motor = design.motor
    row[at.RATIO] = design.total_ratio
    row[at.INERTIA] = design.inertia_kgm2
    row[at.BACK_DRIVABLE] = design.load.path == "back-drivable"
    if motor.source_gain_Nm_V is not None:
        row[at.SOURCE], row[at.SOURCE_GAIN] = 1.0, motor.source_gain_Nm_V
        row[at.RESISTANCE], row[at.INDUCTANCE] = 1.0, 1.0
        return
    electrical = {
        at.RESISTANCE: motor.resistance_ohm,
        at.INDUCTANCE: motor.inductance_H,
        at.BACK_EMF: motor.back_emf_constant_Vs_rad,
        at.TORQUE_CONSTANT: motor.torque_constant_Nm_A,
    }
    for place, value in electrical.items():
        if value is None:
            message = (
                "motor: resistance, inductance, torque_constant and back_emf_constant or source_gain needed"
            )
            raise InputError(message, where=design.name)
        row[place] = value


def _friction(design: Design, row: Floats, friction_on: bool) -> None:
    friction = design.friction
    row[at.VISCOUS], row[at.VISCOUS_REVERSE] = friction.viscous(1), friction.viscous(-1)
    row[at.BREAKAWAY] = friction.breakaway_ratio
    row[at.SMOOTHING] = friction.smoothing_speed_rad_s
    if not friction_on:
        return
    row[at.LAW] = friction.law == "tanh"
    row[at.DRY], row[at.DRY_REVERSE] = friction.dry_Nm(0.0, 1), friction.dry_Nm(0.0, -1)
    row[at.LOAD_COEFFICIENT] = friction.load_coefficient
    row[at.OFFSET] = friction.offset_torque_Nm
    if friction.breakaway_ratio < 1.0:
        message = f"friction.breakaway_ratio = {friction.breakaway_ratio}: must be at least 1"
        raise InputError(message, where=design.name)


def _controllers(design: Design, row: Floats) -> None:
    controller = design.controller
    Ts = controller.period_s
    row[at.PERIOD] = Ts
    row[at.DELAY_TICKS], row[at.DELAY_FRACTION] = split_delay(controller.computing_delay_s, Ts)
    row[at.EVERY_POSITION] = controller.position_loop.every
    row[at.POSITION_GAIN] = controller.position_loop.gain
    row[at.FEEDFORWARD] = controller.position_loop.feedforward
    row[at.EVERY_VELOCITY] = 1
    row[at.FILTER_COEFFICIENT] = 1.0
    row[at.DIFFERENCE_SAMPLES] = 1
    velocity, current = controller.velocity, controller.current
    if velocity is not None:
        T = velocity.every * Ts
        row[at.HAS_VELOCITY], row[at.EVERY_VELOCITY] = 1.0, velocity.every
        row[at.VELOCITY_GAIN] = velocity.gain
        if velocity.integral_time_s is not None:
            row[at.VELOCITY_INTEGRAL] = velocity.gain * T / velocity.integral_time_s
        _encoder(design, row, T)
    if current is not None:
        if row[at.SOURCE]:
            message = "control.current: an ideal torque source has no current to control"
            raise InputError(message, where=design.name)
        row[at.HAS_CURRENT], row[at.CURRENT_GAIN] = 1.0, current.gain_V_A
        if current.integral_time_s is not None:
            row[at.CURRENT_INTEGRAL] = current.gain_V_A * Ts / current.integral_time_s


def _encoder(design: Design, row: Floats, period_s: float) -> None:
    encoder = design.encoder
    row[at.FILTER_COEFFICIENT] = period_s / (encoder.filter_time_s + period_s)
    if encoder.speed == "difference":
        row[at.SPEED_SOURCE], row[at.DIFFERENCE_SAMPLES] = 1.0, encoder.difference_samples
        if encoder.counts_per_rev is not None:
            turn = 2.0 * pi if design.axis == "rotary" else 1.0
            row[at.COUNTS_PER_RAD] = encoder.counts_per_rev / turn


def _limits(design: Design, row: Floats, limits_on: bool) -> None:
    limits = design.limits
    values = (limits.speed_rad_s, limits.acceleration_rad_s2, limits.peak_current_A, limits.voltage_V)
    places = (at.SPEED_LIMIT, at.ACCELERATION_LIMIT, at.CURRENT_LIMIT, at.VOLTAGE_LIMIT)
    for place, value in zip(places, values, strict=True):
        row[place] = value if limits_on else inf
