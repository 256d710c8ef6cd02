"""The kernel's arrays as a `Trajectory`."""

from __future__ import annotations

from dataclasses import fields
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Axis, Design
from actuator_lti.drive.signals import LIMITERS
from nonlinear._kernels import layout as at
from nonlinear.runs.trajectory import Energy, LimitUse, ProbeRecord, State, Status, Trajectory

Floats = npt.NDArray[np.float64]
SWITCHES = {"torque-command": at.TORQUE_FILTERS, "overload": at.OVERLOAD, "profile": at.PROFILED}
STORED = ("magnetic_J", "kinetic_J", "spring_J")  # the other energies are the kernel's, in its order


def wrap(
    design: Design, row: Floats, history: Floats, flags: npt.NDArray[np.uint16], out: Floats, status: Status,
    probing: list[str], digest: str,
) -> Trajectory:  # fmt: skip
    """Name the columns and the results of one run."""
    period, s = float(row[at.PERIOD]), out[at.OUT_STATE :]
    behind = at.HISTORY_PROBES + 2 * len(probing)
    sides = history[at.HISTORY_PROBES : behind]
    probes = {
        point: ProbeRecord(point=point, before=before, after=after)
        for point, before, after in zip(probing, sides[::2], sides[1::2], strict=True)
    }
    elastic = list(history[behind:]) if row[at.ELASTIC_DRIVE] else [None] * at.ELASTIC_COLUMNS
    return Trajectory(
        design_name=design.name,
        axis=design.axis,
        period_s=period,
        row_period_s=float(period * row[at.RECORD_EVERY]),
        **{name: history[k] for k, name in enumerate(at.SIGNALS[: at.BASE_SIGNALS])},
        motor_angle_rad=history[at.HISTORY_ANGLE],
        limit_flags=flags,
        limits=limit_uses(row, out, design.axis),
        events=int(s[at.S_EVENTS]),
        events_per_tick=int(s[at.S_MAX_EVENTS]),
        stick_fraction=float(out[at.OUT_STICK_TICKS] / row[at.TICKS]),
        status=status,
        final=final_state(row, s),
        energy=energy_of(row, s, out[at.OUT_TWIST]) if row[at.WITH_ENERGY] else None,
        probes=probes,
        output_speed_rad_s=elastic[0],
        twist_rad=elastic[1],
        coupling_torque_Nm=elastic[2],
        load_Nm=_load(row, history),
        parameters_hash=digest,
        stage=design.controller.outermost,
        ratio=float(row[at.RATIO]),
    )


def _load(row: Floats, history: Floats) -> Floats | None:
    """The moment on the output shaft at the recorded ticks; ``None`` where there is none in the whole run."""
    if not row[at.LOAD : at.TORQUE_TABLE].any():
        return None
    return history[-1] if row[at.VARYING_LOAD].any() else np.broadcast_to(row[at.LOAD], history.shape[1])


def limit_uses(row: Floats, out: Floats, axis: Axis = "rotary") -> dict[str, LimitUse]:
    """How long each limiter of the drive acted."""
    uses = {}
    for k, (name, limiter) in enumerate(LIMITERS.items()):
        limit, unit = float(row[at.LIMIT[name]]), limiter.unit(axis)
        if limiter.signal == "torque_command" and not row[at.HAS_CURRENT]:
            limit, unit = float(row[at.VOLTAGE_LIMIT]), "V"
        if not (row[SWITCHES[name]] if name in SWITCHES else limiter.always or limit < inf):
            continue
        first = out[at.OUT_LIMIT_FIRST + k]
        uses[name] = LimitUse(
            limit=limit,
            unit=unit,
            fraction=float(out[at.OUT_LIMIT_TICKS + k] / max(out[at.OUT_TICKS], 1.0)),
            first_time_s=None if first < 0 else float(first * row[at.PERIOD]),
        )
    return uses


def final_state(row: Floats, s: Floats) -> State:
    """State after the last tick, of the numbers that a run leaves of it."""
    angle, speed = (
        (float(s[at.S_OUTPUT]), float(s[at.S_OUTPUT_SPEED])) if row[at.ELASTIC_DRIVE] else (None, None)
    )
    held = {
        "motor_angle_rad": at.S_ANGLE, "motor_speed_rad_s": at.S_SPEED, "current_A": at.S_CURRENT,
        "current_integral_V": at.S_CURRENT_INTEGRATOR, "velocity_integral": at.S_VELOCITY_INTEGRATOR,
        "speed_command_rad_s": at.S_SPEED_COMMAND, "current_command_A": at.S_CURRENT_REFERENCE,
        "voltage_V": at.S_VOLTAGE,
    }  # fmt: skip
    numbers: dict[str, Any] = {name: float(s[place]) for name, place in held.items()}
    return State(output_angle_rad=angle, output_speed_rad_s=speed, **numbers)


def energy_of(row: Floats, s: Floats, twist_rad: float) -> Energy:
    """Energies of the run: integrals from the kernel, stored energies from the end states."""
    stored = 0.0 if row[at.SOURCE] else 0.5 * row[at.INDUCTANCE]
    integrals = s[at.S_ENERGY : at.S_ENERGY + at.ENERGY_SIZE].tolist()
    names = [each.name for each in fields(Energy) if each.name not in STORED]
    return Energy(
        magnetic_J=float(stored * (s[at.S_CURRENT] ** 2 - row[at.CURRENT_START] ** 2)),
        kinetic_J=kinetic_energy(row, s),
        spring_J=spring_energy(row, twist_rad) - spring_energy(row, row[at.TWIST_START]),
        **dict(zip(names, integrals, strict=True)),
    )


def kinetic_energy(row: Floats, s: Floats) -> float:
    """Change of the kinetic energy of the run, of both sides of a coupling."""
    J = row[at.MOTOR_INERTIA] if row[at.ELASTIC_DRIVE] else row[at.INERTIA]
    total = 0.5 * J * (s[at.S_SPEED] ** 2 - row[at.SPEED_START] ** 2)
    if row[at.ELASTIC_DRIVE] and not row[at.RIGID]:
        W = s[at.S_OUTPUT_SPEED] * row[at.RATIO] / row[at.RATIO_TO_COUPLING]
        total += 0.5 * row[at.LOAD_INERTIA] * (W**2 - row[at.LOAD_SPEED_START] ** 2)
    return float(total)


def spring_energy(row: Floats, twist_rad: float) -> float:
    """Work that the spring has taken up at a twist; of one stiffness k max(0, |delta| - b)^2 / 2."""
    if not row[at.ELASTIC_DRIVE] or row[at.RIGID]:
        return 0.0
    left, torque, k, work = max(0.0, abs(twist_rad) - row[at.HALF_PLAY]), 0.0, row[at.STIFFNESS], 0.0
    for bend, beyond in row[at.BEND_TORQUE : at.BEND_STIFFNESS_2 + 1].reshape(2, 2):
        here = (bend - torque) / k
        if bend <= torque or left <= here:
            break
        left, work, torque, k = left - here, work + 0.5 * (bend + torque) * here, bend, beyond
    return float(work + torque * left + 0.5 * k * left**2)
