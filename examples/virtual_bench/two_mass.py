"""A test bench in the computer for a compliant drive: the simulator, a current command, instruments.

Two records: a multisine of the current in one direction under a moment that keeps the coupling on one flank,
and a current that reverses across the play. The drive's own loops outside the current do not act; its
``[instruments]`` act in the loop and, drawn again, in the log. The load is balanced: its gravity and slope do
not act.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Command, Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.records.record import Record, RowCounts


@dataclass(frozen=True, kw_only=True)
class TwoMassPlan:
    """What is done on the bench.

    The multisine has lines of equal amplitude ``line_A`` every ``1/period_s`` from ``lowest_hz`` to
    ``highest_hz``; the motor turns at about ``speed_rad_s`` against ``moment_Nm`` at the output. The log
    begins after ``settle_s``. The reversal is a sine of the current.
    """

    period_s: float = 0.5
    periods: int = 9
    settle_s: float = 2.5
    lowest_hz: float = 2.0
    highest_hz: float = 400.0
    line_A: float = 0.04
    moment_Nm: float = 3.0
    speed_rad_s: float = 50.0
    reversal_A: float = 1.0
    reversal_hz: float = 1.5
    reversal_s: float = 3.0
    log_period_s: float = 5e-4


def sweep_record(design: Design, plan: TwoMassPlan | None = None, *, seed: int = 0) -> Record:
    """The record of the multisine.

    Raises `InputError`: for a drive without a current loop or without a coupling, or where the coupling
    leaves its flank.
    """
    from nonlinear import State, commands, simulate

    plan = TwoMassPlan() if plan is None else plan
    drive, bias = _torque_drive(design, seed), _bias(design, plan)
    duration = plan.settle_s + plan.period_s * plan.periods
    time = np.arange(0.0, duration + drive.controller.period_s, drive.controller.period_s)
    wanted = bias + _multisine(time, plan, seed)
    start = State(
        motor_angle_rad=design.ratio_to_coupling * _contact(design, plan),
        output_angle_rad=0.0,
        motor_speed_rad_s=plan.speed_rad_s,
        current_A=bias,
        current_integral_V=_volts(design, bias, plan.speed_rad_s),
        current_command_A=bias,
    )
    run = simulate(drive, commands.sampled(time, wanted), duration, -plan.moment_Nm, initial=start)
    assert run.coupling_torque_Nm is not None
    if np.min(run.coupling_torque_Nm) <= 0.0:
        raise InputError("the coupling leaves its flank: a larger moment_Nm or smaller lines", design.name)
    record = _logged(drive, run, plan, seed, "sweep")
    return record.slice(round(plan.settle_s / record.period_s), len(record))


def reversal_record(design: Design, plan: TwoMassPlan | None = None, *, seed: int = 0) -> Record:
    """The record of the reversing current."""
    from nonlinear import commands, simulate

    plan = TwoMassPlan() if plan is None else plan
    drive = _torque_drive(design, seed)
    run = simulate(drive, commands.sine(plan.reversal_A, plan.reversal_hz), plan.reversal_s)
    return _logged(drive, run, plan, seed + 1, "reversal")


def _torque_drive(design: Design, seed: int) -> Design:
    """The drive from its current loop on."""
    if design.controller.current is None or design.coupling is None or design.axis != "rotary":
        raise InputError("this bench needs a rotary drive with a current loop and a coupling", design.name)
    controller = replace(design.controller, position=None, velocity=None)
    instruments = replace(design.instruments, seed=seed)
    load = design.load.bare()
    return replace(
        design, controller=controller, command=Command(), instruments=instruments, load=load, requirements=()
    )


def _bias(design: Design, plan: TwoMassPlan) -> float:
    """Current that holds the speed against moment and friction."""
    constant = design.effective_motor.torque_constant_Nm_A
    assert constant is not None
    w, n = plan.speed_rad_s, design.ratio_to_coupling
    friction, load = design.friction, design.load.friction
    reaction = plan.moment_Nm / design.ratio_behind_coupling
    if load is not None:
        reaction += load.dry_torque_Nm + load.viscous_Nms_rad * w / n + load.offset_torque_Nm
    carried = design.ratio_behind_coupling * reaction
    torque = friction.dry_Nm(carried) + friction.viscous() * w + friction.offset_torque_Nm + reaction / n
    return float(torque / constant)


def _contact(design: Design, plan: TwoMassPlan) -> float:
    """Twist of the coupling under the moment."""
    assert design.coupling is not None
    moment = plan.moment_Nm / design.ratio_behind_coupling
    return 0.5 * design.coupling.play_rad + moment / design.coupling.stiffness_Nm_rad


def _volts(design: Design, current_A: float, speed_rad_s: float) -> float:
    motor = design.effective_motor
    return (motor.resistance_ohm or 0.0) * current_A + (motor.back_emf_constant_Vs_rad or 0.0) * speed_rad_s


def _multisine(time: Floats, plan: TwoMassPlan, seed: int) -> Floats:
    """Lines of equal amplitude and random phase; one period, repeated."""
    first, last = np.ceil(plan.lowest_hz * plan.period_s), plan.highest_hz * plan.period_s
    hertz = np.arange(first, last) / plan.period_s
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(hertz))
    samples = round(plan.period_s / (time[1] - time[0]))
    one = sum(np.cos(2.0 * np.pi * f * time[:samples] + p) for f, p in zip(hertz, phase, strict=True))
    return plan.line_A * np.asarray(one)[np.arange(len(time)) % samples]


def _logged(design: Design, run: object, plan: TwoMassPlan, seed: int, name: str) -> Record:
    """What the instruments make of a run, at the log's period."""
    from nonlinear import Trajectory

    assert isinstance(run, Trajectory)
    every = max(round(plan.log_period_s / run.period_s), 1)
    rng, tools = np.random.default_rng([seed, 1]), design.instruments
    current, angle, output, command = (
        values[::every].copy()
        for values in (run.current_A, run.motor_angle_rad, run.output_angle_rad, run.reference_rad)
    )
    current += tools.current_noise_A * rng.standard_normal(len(current))
    angle += tools.angle_noise_rad * rng.standard_normal(len(angle))
    output += tools.output_angle_noise_rad * rng.standard_normal(len(output))
    signals = {
        "current": _stepped(current, tools.current_resolution_A),
        "angle": _stepped(angle, design.angle_quantum_rad),
        "output_angle": _stepped(output, design.output_quantum_rad),
        "current_reference": command,
    }
    return Record(name=name, time_s=run.time_s[::every], signals=signals, units={}, counts=RowCounts())


def _stepped(values: Floats, step: float | None) -> Floats:
    return values if not step else np.asarray(np.floor(values / step) * step)
