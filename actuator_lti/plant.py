"""The continuous motor and gear train at an operating point of the friction (model.md sections 1 and 3)."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from actuator_lti.errors import InputError

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

OperatingPoint = Literal["sliding", "rest", "describing-function"]
RotorState = Literal["free", "locked"]


@dataclass(frozen=True)
class Plant:
    """``dx/dt = A x + B_u u + B_T T`` of the slipping drive, motor side.

    Attributes
    ----------
    states : tuple of str
        ``("i", "w", "th")`` in A, rad/s, rad; without ``"i"`` for a torque source; ``("i",)`` with the
        rotor locked.
    A : ndarray, shape (n, n)
        Without the stiffness of the hinge moment, see `stiffness_Nm_rad`.
    B_u, B_T : ndarray, shape (n,)
        Effect of the voltage (V, or the drive signal of a torque source) and of a torque in N m that
        accelerates the motor.
    stiffness_Nm_rad : float
        Motor torque per motor angle by a hinge moment proportional to the output angle: T_bd =
        stiffness * th (negative: it pulls back). Zero for a self-locking path.
    """

    states: tuple[str, ...]
    A: np.ndarray
    B_u: np.ndarray
    B_T: np.ndarray
    stiffness_Nm_rad: float


def friction_slope(
    design: Design,
    operating_point: OperatingPoint = "sliding",
    load_Nm: float = 0.0,
    speed_amplitude_rad_s: float | None = None,
    direction: int = 1,
) -> float:
    """Slope of the friction torque over speed at an operating point, in N m s/rad (motor side).

    Parameters
    ----------
    operating_point : {"sliding", "rest", "describing-function"}
        ``sliding``: Cv, as the dry part is a constant while the speed keeps its sign. ``rest``: Cv + Tc/w_s,
        the slope of the tanh law at zero speed. ``describing-function``: Cv + 4 Tc/(pi W) for a sinusoidal
        speed of amplitude W; where friction differs by direction, the mean of both (the fundamental of an
        asymmetric relay).
    load_Nm : float
        Hinge moment at the output shaft; enters through Tc = C0 + CM |M_ext|, equation (9).
    speed_amplitude_rad_s : float, optional
        W, motor side; needed by the describing function only.
    direction : {1, -1}
        Direction of motion, for asymmetric friction.

    Raises
    ------
    InputError
        For an unknown operating point, or an amplitude that is missing or not positive.
    """
    if operating_point not in get_args(OperatingPoint):
        allowed = ", ".join(get_args(OperatingPoint))
        raise InputError(f"operating_point = {operating_point!r}: one of {allowed}")
    if direction not in (1, -1):
        raise InputError(f"direction = {direction!r}: 1 or -1")
    if not isfinite(load_Nm):
        raise InputError(f"load_Nm = {load_Nm}: must be finite")
    friction = design.friction
    if operating_point == "sliding":
        return friction.viscous(direction)
    if operating_point == "rest":
        return (
            friction.viscous(direction) + friction.dry_Nm(load_Nm, direction) / friction.smoothing_speed_rad_s
        )
    if speed_amplitude_rad_s is None or not 0 < speed_amplitude_rad_s < float("inf"):
        raise InputError(f"speed_amplitude_rad_s = {speed_amplitude_rad_s}: must be positive (motor side)")
    dry = (friction.dry_Nm(load_Nm, 1) + friction.dry_Nm(load_Nm, -1)) / 2
    viscous = (friction.viscous(1) + friction.viscous(-1)) / 2
    return viscous + 4 * dry / (pi * speed_amplitude_rad_s)


def motor_plant(design: Design, slope_Nms_rad: float, rotor: RotorState = "free") -> Plant:
    """State space of equations (1), (2), (14) with a friction slope (see `friction_slope`).

    Examples
    --------
    >>> from actuator_lti.design.model import Controller, Design, Limits, Motor, PositionLoop, Validation
    >>> design = Design(
    ...     name="force source", title="", motor=Motor(rotor_inertia_kgm2=2.0, source_gain_Nm_V=4.0),
    ...     controller=Controller(period_s=1e-3, computing_delay_s=0.0, position=PositionLoop(gain=1.0)),
    ...     limits=Limits(voltage_V=10.0), validation=Validation(full_deflection_rad=1.0))
    >>> plant = motor_plant(design, 6.0)
    >>> plant.states, plant.A[0].tolist(), plant.B_u.tolist()
    (('w', 'th'), [-3.0, 0.0], [2.0, 0.0])
    """
    motor, J = design.motor, design.inertia_kgm2
    stiffness = 0.0
    if design.load.path == "back-drivable":
        stiffness = design.load.moment_slope_Nm_rad / design.total_ratio**2
    if motor.source_gain_Nm_V is not None:
        if rotor == "locked":
            raise InputError("rotor = 'locked': the design has no current, its torque is an ideal source")
        A = np.array([[-slope_Nms_rad / J, 0.0], [1.0, 0.0]])
        B_u = np.array([motor.source_gain_Nm_V / J, 0.0])
        return Plant(("w", "th"), A, B_u, np.array([1 / J, 0.0]), stiffness)
    R, L = motor.resistance_ohm, motor.inductance_H
    kM, kE = motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
    if R is None or L is None or kM is None or kE is None:
        raise InputError(
            "motor: resistance, inductance, torque_constant and back_emf_constant, or source_gain"
        )
    if rotor == "locked":
        return Plant(("i",), np.array([[-R / L]]), np.array([1 / L]), np.zeros(1), 0.0)
    A = np.array([[-R / L, -kE / L, 0.0], [kM / J, -slope_Nms_rad / J, 0.0], [0.0, 1.0, 0.0]])
    return Plant(("i", "w", "th"), A, np.array([1 / L, 0.0, 0.0]), np.array([0.0, 1 / J, 0.0]), stiffness)
