"""The continuous plant of a drive at an operating point: equations (1), (2), (14), model.md section 6.

Coefficients may be arrays of shape (K,) stacked over designs: then the matrices have K in front.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from actuator_lti.design.model import Design, Motor
from actuator_lti.drive.operating import (
    Operating,
    moment_slope,
    reaction,
    slope_at,
    stiffness_there,
    torque_slope,
)
from actuator_lti.errors import InputError

Entries = dict[str, Any]
"""Numbers by the name of a state: floats, arrays of shape (K,) of stacked designs, or traced values."""
MatrixEntries = dict[tuple[str, str], Any]  # the same by the names of row and column


@dataclass(frozen=True)
class Plant:
    """``dx/dt = A x + B_u u + B_T T + B_M M_ext`` of the slipping drive."""

    # i, w, th in A, rad/s, rad at the motor (a torque source has no i, a locked rotor i alone); behind a
    # coupling W and twist = th/N_c - phi at its own shaft: one absolute angle, which no inner loop sees
    states: tuple[str, ...]
    A: np.ndarray  # shape (..., n, n): without the load's own torques, see `load_torque`
    B_u: np.ndarray  # shape (..., n): of the voltage in V, or the drive signal of a torque source
    B_T: np.ndarray  # of a torque in N m that accelerates the motor
    B_M: np.ndarray  # of a load torque in N m that pushes the output shaft forward
    torque: Entries  # the motor's own, of states and rows, held over a tick; empty where there is none
    load_torque: Entries  # the load's own on the output shaft, in the same way
    rows: dict[str, Entries]  # angles, speeds and T_s of states; load_speed: the motor's that its sensor sees


def matrix(names: tuple[str, ...], entries: MatrixEntries) -> np.ndarray:
    """A square matrix over named states, stacked where an entry is an array of shape (K,)."""
    out = np.zeros((*_stack(entries.values()), len(names), len(names)))
    for (row, column), value in entries.items():
        out[..., names.index(row), names.index(column)] = value
    return out


def vector(names: tuple[str, ...], entries: Entries) -> np.ndarray:
    out = np.zeros((*_stack(entries.values()), len(names)))
    for name, value in entries.items():
        out[..., names.index(name)] = value
    return out


def _stack(values: Iterable[Any]) -> tuple[int, ...]:
    return np.broadcast_shapes(*(np.shape(value) for value in values))


def motor_plant(design: Design, at: Operating | None = None) -> Plant:
    """State space of equations (1), (2), (14), and of section 6 with a coupling.

    Raises `InputError`: for an operating point that the design does not have, or a locked rotor without a
    current.

    >>> from actuator_lti.design.model import Controller, Design, Limits, Motor, PositionLoop, Validation
    >>> from actuator_lti.design.model import Friction
    >>> design = Design(
    ...     name="force source", title="", motor=Motor(rotor_inertia_kgm2=2.0, source_gain_Nm_V=4.0),
    ...     controller=Controller(period_s=1e-3, computing_delay_s=0.0, position=PositionLoop(gain=1.0)),
    ...     limits=Limits(voltage_V=10.0), validation=Validation(full_deflection_rad=1.0),
    ...     friction=Friction(viscous_Nms_rad=6.0))
    >>> plant = motor_plant(design)
    >>> plant.states, plant.A[0].tolist(), plant.B_u.tolist()
    (('w', 'th'), [-3.0, 0.0], [2.0, 0.0])
    """
    at = (at or Operating()).checked(design)
    motor = design.effective_motor
    if at.rotor == "locked":
        (A, B), names, none = _electrical(motor), ("i",), np.zeros(1)
        A_i = matrix(names, {("i", "i"): A["i", "i"]})
        return Plant(names, A_i, vector(names, B), none, none, {}, {}, {})
    plant = _rigid(design, motor, at) if design.coupling is None else _elastic(design, motor, at)
    return _at_once(plant) if at.torques_at_once else plant


def _at_once(plant: Plant) -> Plant:
    """The same with its own torques in A, not held."""
    A, unit = plant.A, np.eye(len(plant.states))
    for own, B in ((plant.torque, plant.B_T), (plant.load_torque, plant.B_M)):
        for name, gain in own.items():
            for state, share in plant.rows.get(name, {name: 1.0}).items():
                made = B * np.asarray(gain * share)[..., None]
                A = A + made[..., None] * unit[plant.states.index(state)]
    return replace(plant, A=A, torque={}, load_torque={})


def _electrical(motor: Motor) -> tuple[MatrixEntries, Entries]:
    """Equation (1): entries of the current's row, and of B_u."""
    R, L, kE = motor.resistance_ohm, motor.inductance_H, motor.back_emf_constant_Vs_rad
    if R is None or L is None or kE is None or motor.torque_constant_Nm_A is None:
        needed = "resistance, inductance, torque_constant and back_emf_constant, or source_gain"
        raise InputError(f"motor: {needed}")
    return {("i", "i"): -R / L, ("i", "w"): -kE / L}, {"i": 1 / L}


def _motor_side(motor: Motor, J: Any, slope: Any) -> tuple[MatrixEntries, Entries]:
    own = {("w", "w"): -slope / J, ("th", "w"): 1.0}
    if motor.source_gain_Nm_V is not None:
        return own, {"w": motor.source_gain_Nm_V / J}
    A, B = _electrical(motor)
    return {**A, ("w", "i"): motor.torque_constant_Nm_A / J, **own}, B


def _rigid(design: Design, motor: Motor, at: Operating) -> Plant:
    J, N = design.inertia_kgm2, design.total_ratio
    A, B_u = _motor_side(motor, J, slope_at(design, at))
    names = ("i", "w", "th") if motor.has_electrical_dynamics else ("w", "th")
    reaches = design.load.path == "back-drivable"
    return Plant(
        states=names, A=matrix(names, A), B_u=vector(names, B_u), B_T=vector(names, {"w": 1 / J}),
        B_M=vector(names, {"w": 1 / (N * J) if reaches else 0.0}), torque=_own_torque(design, at),
        load_torque=_own_load_torque(design, at) if reaches else {},
        rows={"output_angle": {"th": 1 / N}, "output_speed": {"w": 1 / N}, "load_speed": {"w": 1.0}}
    )  # fmt: skip


def _own_torque(design: Design, at: Operating) -> Entries:
    """The motor's own torque over its angle, made linear, where there is one."""
    slope = torque_slope(design, at)
    return {"th": slope} if np.any(slope != 0) else {}


def _own_load_torque(design: Design, at: Operating) -> Entries:
    damping = design.load.moment_damping_Nms_rad / design.total_ratio
    gains = {"output_angle": moment_slope(design, at), "load_speed": -damping}
    return {row: gain for row, gain in gains.items() if np.any(gain != 0)}


def _elastic(design: Design, motor: Motor, at: Operating) -> Plant:
    coupling, friction = design.coupling, design.load.friction
    assert coupling is not None
    J_m, J_l = design.motor_side_inertia_kgm2, design.load_side_inertia_kgm2
    N_c, N_r = design.ratio_to_coupling, design.ratio_behind_coupling
    k, c = stiffness_there(design, at), coupling.damping_Nms_rad
    A, B_u = _motor_side(motor, J_m, slope_at(design, at))
    names = ("i", "w", "th", "W", "twist") if motor.has_electrical_dynamics else ("w", "th", "W", "twist")
    spring = {} if at.point == "gap" else {"twist": k, "w": c / N_c, "W": -c}
    felt = reaction(design, at)
    for name, value in spring.items():
        A["w", name] = A.get(("w", name), 0.0) - felt * value / J_m
        A["W", name] = value / J_l
    A["W", "W"] = A.get(("W", "W"), 0.0) - (friction.viscous_Nms_rad if friction else 0.0) / J_l
    A |= {("twist", "w"): 1 / N_c, ("twist", "W"): -1.0}
    phi = {"th": 1 / N_c, "twist": -1.0}
    return Plant(
        states=names,
        A=matrix(names, A),
        B_u=vector(names, B_u),
        B_T=vector(names, {"w": 1 / J_m}),
        B_M=vector(names, {"W": 1 / (N_r * J_l)}),
        torque=_own_torque(design, at),
        load_torque=_own_load_torque(design, at),
        rows={
            "output_angle": {name: value / N_r for name, value in phi.items()},
            "phi": phi,
            "T_s": spring,
            "output_speed": {"W": 1 / N_r},
            "load_speed": {"W": N_c},
        },
    )
