"""The exact sampled form: every loop as a python-control state space with its own period."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actuator_lti.loops.blocks import Block, siso
from actuator_lti.loops.cascade import ERRORS, MEASURED, Cascade
from actuator_lti.loops.periodic import fundamental, point_blocks
from actuator_lti.loops.result import Loop
from actuator_lti.loops.simulation import OUTPUTS, TickSystem
from actuator_lti.loops.tick import TickProgram

if TYPE_CHECKING:
    import control


def to_control(block: Block, period_s: float, name: str, source: str, signal: str) -> control.StateSpace:
    """A named python-control system of a block."""
    import control

    return control.ss(
        block.A, block.B, block.C, block.D, period_s, inputs=[source], outputs=[signal], name=name
    )


def _loop(
    wired: Cascade, block: Block, name: str, point: str, signals: tuple[str, str], periodic: bool
) -> Loop:
    period = wired.period_s(wired.producer(point))
    error, measured = signals
    unit = wired.unit(error)
    label = name.replace(" ", "_")
    return Loop(
        name=name,
        break_point=point,
        open_loop=to_control(block, period, f"{label}_open_loop", error, measured),
        closed_loop=to_control(block.feedback(), period, f"{label}_closed_loop", "reference", measured),
        sensitivity=to_control(block.sensitivity(), period, f"{label}_sensitivity", "reference", error),
        period_s=period,
        unit_in=unit,
        unit_out=unit,
        periodic=periodic,
    )


def stage_loop(wired: Cascade, stage: str, opened: tuple[str, ...] = ()) -> Loop:
    """The loop of a stage broken at its own error, inner loops closed (unless opened), outer ones absent."""
    program = TickProgram(wired, stage, ERRORS[stage], opened)
    ticks = [program.tick(k) for k in range(program.ticks)]
    block = siso(program, ticks, "cut", MEASURED[stage]).pruned()
    return _loop(wired, block, stage, wired.target[stage], (ERRORS[stage], MEASURED[stage]), periodic=False)


def point_loop(wired: Cascade, point: str) -> Loop:
    """The loop seen at a break point with all other loops closed."""
    blocks = point_blocks(wired, point)
    return _loop(
        wired, fundamental(blocks), f"at {point}", point, (point, f"{point}_returned"), len(blocks) > 1
    )


def reference_to_output(wired: Cascade) -> control.StateSpace:
    """Command at the output shaft to output angle, at the instants of the position loop."""
    program = TickProgram(wired, "position")
    ticks = [program.tick(k) for k in range(program.ticks)]
    block = siso(program, ticks, "ref", "th", scale=1 / wired.ratio).pruned()
    return to_control(block, wired.period_s("position"), "reference_to_output", "th_ref", "output_angle")


def tick_system(wired: Cascade) -> TickSystem:
    """The whole closed loop for the identity of model.md section 4."""
    program = TickProgram(wired, "position")
    signals = program.tick(0).signals
    return TickSystem(program, tuple(name for name in OUTPUTS if name in signals))
