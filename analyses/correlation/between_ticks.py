"""A run at any time: what winding and rotor do between two ticks, as the simulator has them there."""

from __future__ import annotations

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import motor_torque_Nm
from actuator_lti.types import Floats, Ints
from nonlinear import Trajectory

AT_TICK = 1e-6  # of a tick


def signals_at(design: Design, run: Trajectory, time_s: Floats) -> dict[str, Floats]:
    """The signals of a run at some times, under the names of a record; a voltage is that of the last tick."""
    tick = np.clip(np.floor(time_s / run.period_s + AT_TICK), 0, len(run.time_s) - 1).astype(np.int64)
    late = np.maximum(time_s - tick * run.period_s, 0.0)
    late[late < AT_TICK * run.period_s] = 0.0
    rate = run.output_speed_rad_s
    speed = run.motor_speed_rad_s / design.total_ratio if rate is None else rate
    inner = (run.motor_angle_rad, run.motor_speed_rad_s, run.current_A)
    if np.any(late):
        time = tick * run.period_s + late
        angle, motor, current, output, speed = (
            np.interp(time, run.time_s, one) for one in (*inner, run.output_angle_rad, speed)
        )
        bent = _bent(design, run, tick, late)
        angle, motor, current = angle + bent[0], motor + bent[1], current + bent[2]
        if rate is None:
            output, speed = output + bent[0] / design.total_ratio, speed + bent[1] / design.total_ratio
    else:
        angle, motor, current, output, speed = (one[tick] for one in (*inner, run.output_angle_rad, speed))
    voltage = run.voltage_V[tick]
    return {
        "angle": angle,
        "output_angle": output,
        "position": output,
        "speed": motor,
        "velocity": speed,
        "current": current,
        "voltage": voltage,
        "force": motor_torque_Nm(design, current, voltage),
    }


def _bent(design: Design, run: Trajectory, tick: Ints, late_s: Floats) -> Floats:
    """By how much angle, speed and current are off the straight lines between their ticks, shape (3, n).

    Equations (1), (2) and (14) with the voltage in two pieces, and over the tick a torque with which the
    speed arrives where it is at the next one.
    """
    motor, T = design.effective_motor, run.period_s
    R, L, kM = motor.resistance_ohm, motor.inductance_H, motor.torque_constant_Nm_A
    if not (R and L and kM) or motor.source_gain_Nm_V is not None:
        return np.zeros((3, len(tick)))
    kE = kM if motor.back_emf_constant_Vs_rad is None else motor.back_emf_constant_Vs_rad
    J = design.motor_side_inertia_kgm2 if design.coupling is not None else design.inertia_kgm2
    rates, modes = np.linalg.eig(np.array([[-R / L, -kE / L], [kM / J, 0.0]], dtype=np.complex128))
    into = np.linalg.inv(modes)
    queue, split = divmod(design.controller.computing_delay_s, T)

    def moved(from_tick: Floats, until: Floats) -> Floats:
        """Current, speed and angle turned, from the first two at the tick, two voltages and a torque."""
        state, area = into @ from_tick[:2], np.zeros(1)
        for volts, span in zip(
            from_tick[2:4], (np.minimum(until, split), np.maximum(until - split, 0.0)), strict=True
        ):
            push = into @ np.stack([volts / L, from_tick[4] / J])
            grown = np.expm1(rates[:, None] * span) / rates[:, None]
            area = area + grown * state + (grown - span) / rates[:, None] * push
            state = state + grown * (rates[:, None] * state + push)
        return np.asarray(np.vstack([modes @ state, (modes @ area)[1]]).real)

    tick = np.minimum(tick, len(run.time_s) - 2)
    after = np.maximum(tick - int(queue), 0)
    begun = np.stack(
        [
            run.current_A[tick],
            run.motor_speed_rad_s[tick],
            run.voltage_V[np.maximum(after - 1, 0)],
            run.voltage_V[after],
        ]
    )
    arrives = moved(np.eye(5), np.full(5, T))[1]
    torque = (run.motor_speed_rad_s[tick + 1] - arrives[:4] @ begun) / arrives[4]
    current, speed, turned = moved(np.vstack([begun, torque]), late_s)
    share = late_s / T
    columns = (run.motor_speed_rad_s, run.current_A, run.motor_angle_rad)
    speed_line, current_line, angle_line = (share * (one[tick + 1] - one[tick]) for one in columns)
    return np.array([turned - angle_line, speed - begun[1] - speed_line, current - begun[0] - current_line])
