"""The kernel's arrays as a `Trajectory`."""

from __future__ import annotations

from math import inf

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Axis, Design
from actuator_lti.drive.signals import LIMITERS
from nonlinear._kernels import layout as at
from nonlinear.runs.trajectory import Energy, LimitUse, ProbeRecord, State, Status, Trajectory

Floats = npt.NDArray[np.float64]
SWITCHES = {"torque-command": at.TORQUE_FILTERS, "overload": at.OVERLOAD, "profile": at.PROFILED}


def wrap(
    design: Design, row: Floats, history: Floats, flags: npt.NDArray[np.uint16], out: Floats, status: Status,
    probing: list[str], digest: str,
) -> Trajectory:  # fmt: skip
    """Name the columns and the results of one run."""
    period = float(row[at.PERIOD])
    probes = {
        point: ProbeRecord(
            point=point,
            before=history[at.HISTORY_PROBES + 2 * k],
            after=history[at.HISTORY_PROBES + 2 * k + 1],
        )
        for k, point in enumerate(probing)
    }
    behind = at.HISTORY_PROBES + 2 * len(probing)
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
        events=int(out[at.OUT_EVENTS]),
        events_per_tick=int(out[at.OUT_MAX_EVENTS]),
        stick_fraction=float(out[at.OUT_STICK_TICKS] / row[at.TICKS]),
        status=status,
        final=final_state(row, out),
        energy=energy_of(row, out) if row[at.WITH_ENERGY] else None,
        probes=probes,
        output_speed_rad_s=elastic[0],
        twist_rad=elastic[1],
        coupling_torque_Nm=elastic[2],
        parameters_hash=digest,
        stage=design.controller.outermost,
        ratio=float(row[at.RATIO]),
    )


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


def final_state(row: Floats, out: Floats) -> State:
    """State after the last tick."""
    return State(
        motor_angle_rad=float(out[at.OUT_ANGLE]),
        motor_speed_rad_s=float(out[at.OUT_SPEED]),
        current_A=float(out[at.OUT_CURRENT]),
        current_integral_V=float(out[at.OUT_CURRENT_INTEGRATOR]),
        velocity_integral=float(out[at.OUT_VELOCITY_INTEGRATOR]),
        speed_command_rad_s=float(out[at.OUT_SPEED_COMMAND]),
        current_command_A=float(out[at.OUT_CURRENT_COMMAND]),
        voltage_V=float(out[at.OUT_VOLTAGE]),
        output_angle_rad=float(out[at.OUT_OUTPUT]) if row[at.ELASTIC_DRIVE] else None,
        output_speed_rad_s=float(out[at.OUT_OUTPUT_SPEED]) if row[at.ELASTIC_DRIVE] else None,
    )


def energy_of(row: Floats, out: Floats) -> Energy:
    """Energies of the run: integrals from the kernel, stored energies from the end states."""
    e = out[at.OUT_ENERGY : at.OUT_ENERGY + at.ENERGY_SIZE]
    stored = 0.0 if row[at.SOURCE] else 0.5 * row[at.INDUCTANCE]
    return Energy(
        electrical_input_J=float(e[at.ENERGY_INPUT]),
        copper_loss_J=float(e[at.ENERGY_COPPER]),
        magnetic_J=float(stored * (out[at.OUT_CURRENT] ** 2 - row[at.CURRENT_START] ** 2)),
        kinetic_J=kinetic_energy(row, out),
        dry_friction_J=float(e[at.ENERGY_DRY]),
        viscous_friction_J=float(e[at.ENERGY_VISCOUS]),
        offset_friction_J=float(e[at.ENERGY_OFFSET]),
        output_work_J=float(e[at.ENERGY_LOAD]),
        conversion_J=float(e[at.ENERGY_CONVERSION]),
        supply_J=float(e[at.ENERGY_SUPPLY]),
        supply_loss_J=float(e[at.ENERGY_SUPPLY_LOSS]),
        brake_J=float(e[at.ENERGY_BRAKE]),
        bus_capacitor_J=float(e[at.ENERGY_CAPACITOR]),
        spring_J=spring_energy(row, out[at.OUT_TWIST]) - spring_energy(row, row[at.TWIST_START]),
        coupling_damping_J=float(e[at.ENERGY_DAMPING]),
        parting_J=float(e[at.ENERGY_PARTING]),
        load_dry_friction_J=float(e[at.ENERGY_LOAD_DRY]),
        load_viscous_friction_J=float(e[at.ENERGY_LOAD_VISCOUS]),
        load_offset_friction_J=float(e[at.ENERGY_LOAD_OFFSET]),
    )


def kinetic_energy(row: Floats, out: Floats) -> float:
    """Change of the kinetic energy of the run, of both sides of a coupling."""
    J = row[at.MOTOR_INERTIA] if row[at.ELASTIC_DRIVE] else row[at.INERTIA]
    total = 0.5 * J * (out[at.OUT_SPEED] ** 2 - row[at.SPEED_START] ** 2)
    if row[at.ELASTIC_DRIVE] and not row[at.RIGID]:
        W = out[at.OUT_OUTPUT_SPEED] * row[at.RATIO] / row[at.RATIO_TO_COUPLING]
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
