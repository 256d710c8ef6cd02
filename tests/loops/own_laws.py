"""Random laws of one's own on shipped drives, and a plain writing of model.md section 10."""

from dataclasses import replace
from typing import Any

import numpy as np

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.law import LAW_INPUTS, LAW_WORDS, Law
from actuator_lti.design.model import (
    Command,
    Design,
    Encoder,
    Instruments,
    Limits,
    OutputEncoder,
    Temperature,
)
from actuator_lti.loops.tick import compose
from nonlinear import Rows, Trajectory
from tests.changed import changed

SIZES = {"command": 1.0, "error": 1.0, "speed": 1e-3, "angle": 0.1, "current": 1e-2, "output_angle": 0.1,
         "output_speed": 1e-3, "twist": 1.0}  # fmt: skip
STAGES = ("current", "velocity", "position")
FILTERED = ("filter_time_s", "filter_order", "filter_damping")
SIGNALS = {"th": "motor_angle_rad", "w": "motor_speed_rad_s", "i": "current_A", "u": "voltage_V"}
TICKS = 400
BASES = ("ilr33-amber-multirate", "joint", "emps", "ilr33-amber")


def as_law(design: Design, stage: str, **settings: Any) -> Design:
    """The drive with the PI of a stage (its position P) written as a law of one's own on the error."""
    loop, T = getattr(design.controller, stage), design.controller.period_of(stage)
    gain = loop.gain_V_A if stage == "current" else loop.gain
    if loop.integral_time_s is None:
        return design.with_law(stage, ([], [], [], [[gain]], T), ["error"], **settings)
    step = gain * T / loop.integral_time_s
    return design.with_law(stage, ([[1.0]], [[step]], [[1.0]], [[gain + step]], T), ["error"], **settings)


def linear(design: Design) -> Design:
    """Without counts, dry friction, limits and what bends: what the linear loops are of."""
    smooth = {"dry_torque_Nm": 0.0, "dry_torque_reverse_Nm": None, "load_coefficient": 0.0, "points": ()}
    smooth |= {"offset_torque_Nm": 0.0, "viscous_reverse_Nms_rad": None, "law": "coulomb"}
    encoder = Encoder(speed=design.encoder.speed, bandwidth_rad_s=design.encoder.bandwidth_rad_s)
    parts = {"encoder": encoder, "output_encoder": OutputEncoder(), "friction": smooth, "supply": None}
    parts |= {"load": {"gravity": None, "friction": None}, "limits": Limits(voltage_V=1e12)}
    parts |= {"coupling": design.coupling and {"play_rad": 0.0}}
    parts |= {"controller": {"position": design.controller.position and {"friction_feedforward": 0.0}}}
    return changed(design, command=Command(), instruments=Instruments(), **parts)


def laid_bare(design: Design) -> Design:
    """The linear part of a drive: of its command the filter, of its friction what grows with the load."""
    command, motor = design.command, replace(design.effective_motor, constants="dc", cogging_Nm=0.0)
    kept = replace(Command(), **{name: getattr(command, name) for name in FILTERED})
    bare = replace(linear(design), motor=motor, temperature=Temperature(), command=kept)
    line = dict.fromkeys(("torque_1_Nm", "stiffness_2_Nm_rad", "torque_2_Nm", "stiffness_3_Nm_rad"))
    return changed(
        bare, friction={"load_coefficient": design.friction.load_coefficient}, load={"gear_error_Nm": 0.0},
        encoder=replace(design.encoder, counts_per_rev=None), coupling=bare.coupling and line,
    )  # fmt: skip


def stepped(design: Design, ticks: int, size: float, **settings: Any) -> Trajectory:
    """A run of the drive under a step of its command."""
    rows = Rows.of(design, **settings)
    rows["ticks"] = ticks
    rows.step("command", size)
    return rows.trajectory()


def radius(design: Design) -> float:
    """Spectral radius of the whole closed loop over a base period."""
    program = assemble_loops(design).tick_system.program
    A, _ = compose([program.tick(k) for k in range(program.ticks)])
    return float(np.max(np.abs(np.linalg.eigvals(A))))


def random_law(
    rng: np.random.Generator,
    design: Design,
    stage: str,
    *,
    order: int | None = None,
    stable: bool = False,
    words: tuple[str, ...] = LAW_INPUTS,
) -> Design:
    """A law on any inputs, over decades of the stage's gain; at most so large that the loop is stable."""
    lacking = {"current": not design.motor.has_electrical_dynamics, "twist": design.coupling is None}
    known = [name for name in words if not lacking.get(name)]
    inputs = [name for name in known if rng.random() < 0.6]
    inputs += [] if {"command", "error"} & {*inputs} else ["error"]
    n, m = int(rng.integers(0, 7)) if order is None else order, len(inputs)
    size = 10.0 ** rng.uniform(-1, 0.3)
    A = rng.standard_normal((n, n))
    A *= rng.uniform(0.2, 1.0) / max(np.abs(np.linalg.eigvals(A)), default=1.0)
    B, C, D = rng.standard_normal((n, m)), rng.standard_normal((1, n)), rng.standard_normal((1, m))
    loop = getattr(design.controller, stage)
    scale = np.array([SIZES[name] for name in inputs]) * (loop.gain_V_A if stage == "current" else loop.gain)
    settings = {"L": 0.1 * rng.standard_normal(n) if n else (), "gain": rng.uniform(0.5, 2.0)}
    for _ in range(60):
        made = (A, B * size * scale, C, D * size * scale, design.controller.period_of(stage))
        result = design.with_law(stage, made, inputs, **settings)
        if not stable or radius(result) < 1.0 + 1e-6:
            return result
        size *= 0.5
    raise AssertionError("no stable loop found")


def drawn(case: int, stable: bool = False) -> tuple[Design, str] | None:
    """The case-th drive with its law; None where the drive has no such stage."""
    rng = np.random.default_rng(case)
    design = linear(load_design(BASES[case % len(BASES)]))
    stage = str(rng.choice(STAGES))
    if getattr(design.controller, stage) is None:
        return None
    if rng.random() < 0.5 and design.controller.velocity is not None:
        tracking = Encoder(speed="tracking", bandwidth_rad_s=0.3 / design.controller.period_of("velocity"))
        counted = Encoder(speed="difference", difference_samples=3)
        design = replace(design, encoder=(tracking, counted)[int(rng.integers(2))])
    return random_law(rng, design, stage, stable=stable, words=LAW_WORDS), stage


def same_run(design: Design, case: object, rng: np.random.Generator) -> None:
    """Simulator without limits and linear map, tick by tick, under a sine, a ramp and a load."""
    t = np.arange(TICKS)
    command = 1e-2 * (np.sin(t * rng.uniform(0.01, 0.1)) + 1e-3 * t)
    rows = Rows.of(design, limits_on=False)
    rows["ticks"], rows["load"] = TICKS, 0.1
    rows.series("command", command)
    system = assemble_loops(design).tick_system
    scale = design.total_ratio if design.controller.outermost == "velocity" else 1.0  # it is the motor's
    with np.errstate(over="ignore", invalid="ignore"):
        run, linear = rows.trajectory(), system.respond(scale * command, 0.0, None, 0.1)
    for name, ours in SIGNALS.items():
        if name not in linear:
            continue
        some = np.maximum.accumulate(np.abs(linear["w"])) < 1e12
        most = np.abs(linear[name][some]).max()
        assert np.abs(getattr(run, ours) - linear[name])[some].max() <= 1e-9 * most, (case, name)


class PlainLaw:
    """v = gain (C x + D e), then x+ = A x + B e + L (u - v), written out."""

    def __init__(self, law: Law) -> None:
        self.law, self.m = law, law.sampled
        self.x = np.zeros(len(self.m.A))

    def output(self, signals: dict[str, float]) -> float:
        self.e = np.array([signals[name] for name in self.law.inputs])
        self.v = self.law.gain * float(self.m.C @ self.x + self.m.D @ self.e)
        return self.v

    def step(self, u: float) -> None:
        self.x = self.m.A @ self.x + self.m.B @ self.e + self.m.L * (u - self.v)
