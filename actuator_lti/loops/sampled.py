"""The exact sampled form: every loop as a state space with its own period."""

from __future__ import annotations

from actuator_lti.drive.wiring import COMMANDS, ERRORS, MEASURED, Drive
from actuator_lti.loops.blocks import Block
from actuator_lti.loops.periodic import cyclic, fundamental, phase_blocks, point_blocks
from actuator_lti.loops.result import Loop
from actuator_lti.loops.simulation import OUTPUTS, TickSystem
from actuator_lti.loops.tick import TickProgram
from actuator_lti.systems.plain_system import PlainSystem


def _system(block: Block, period_s: float, name: str, source: str, signal: str) -> PlainSystem:
    """A block of one design with its period and its names."""
    return PlainSystem(block.A, block.B, block.C, block.D, period_s, name, source, signal, block.states)


def _loop(
    wired: Drive, block: Block, name: str, point: str, signals: tuple[str, str], periodic: bool
) -> Loop:
    block, period = block.shown(), wired.period_s(wired.producer(point))
    error, measured = signals
    unit = wired.unit(error)
    label = name.replace(" ", "_")
    return Loop(
        name=name,
        break_point=point,
        plain_open=_system(block, period, f"{label}_open_loop", error, measured),
        plain_closed=_system(block.feedback(), period, f"{label}_closed_loop", "reference", measured),
        plain_sensitivity=_system(block.sensitivity(), period, f"{label}_sensitivity", "reference", error),
        period_s=period,
        unit_in=unit,
        unit_out=unit,
        periodic=periodic,
    )


def stage_blocks(wired: Drive, stage: str, opened: tuple[str, ...] = ()) -> list[Block]:
    """The loop of a stage broken at its own error, inner loops closed (unless opened), outer ones absent.

    With a law of one's own it is broken at what the stage drives: one loop, whatever the law takes.
    One block, or several where a slower speed measurement is fed forward inside (then it is periodic).
    """
    if wired.has_own_law(stage):
        point = wired.target[stage]
        return phase_blocks(
            TickProgram(wired, stage, point, opened), wired.interval[stage], "cut", point, -1.0
        )
    program = TickProgram(wired, stage, ERRORS[stage], opened)
    measured = "output" if stage == "position" else MEASURED[stage]
    scale = wired.ratio if stage == "position" else 1.0
    return phase_blocks(program, wired.interval[stage], "cut", measured, scale)


def stage_loop(wired: Drive, stage: str, opened: tuple[str, ...] = ()) -> Loop:
    """The loop of a stage, see `stage_blocks`."""
    blocks = stage_blocks(wired, stage, opened)
    return _loop(wired, fundamental(blocks), stage, wired.target[stage], wired.around(stage), len(blocks) > 1)


def point_loop(wired: Drive, point: str) -> Loop:
    """The loop seen at a break point with all other loops closed."""
    blocks = point_blocks(wired, point)
    return _loop(
        wired, fundamental(blocks), f"at {point}", point, (point, f"{point}_returned"), len(blocks) > 1
    )


def reference_to_output(wired: Drive) -> PlainSystem:
    """Command to what the outermost stage moves, at its instants (see `Loops.reference_to_output`)."""
    source, signal, every, label = whole_path(wired)
    block = fundamental_path(TickProgram(wired, wired.outermost), every, "ref", signal)
    return _system(block.shown(), every * wired.tick_s, "reference_to_output", source, label)


def fundamental_path(program: TickProgram, every: int, source: str, signal: str) -> Block:
    """From an input held `every` ticks to a signal; of a periodic drive the fundamental."""
    return cyclic(phase_blocks(program, every, source, signal)).pruned()


def whole_path(wired: Drive) -> tuple[str, str, int, str]:
    """Command, controlled signal, ticks between two commands, and name of the output."""
    stage = wired.outermost
    signal = {"position": "output_angle", "velocity": "w", "current": "i"}.get(
        stage, "w" if "w" in wired.plant.states else "i"
    )
    label = "output_angle" if stage == "position" else signal
    return COMMANDS[stage], signal, wired.interval.get(stage, 1), label


def moment_to_output(wired: Drive) -> PlainSystem:
    """Moment on the output shaft, held over every tick, to the output angle: the compliance, all loops
    closed.

    Its inverse is the dynamic stiffness (model.md section 9). Where the drive has slower stages, the
    fundamental of the periodic loop.
    """
    block = fundamental_path(TickProgram(wired, wired.outermost), 1, "moment", "output_angle")
    return _system(block, wired.tick_s, "moment_to_output", "moment", "output_angle")


def tick_system(wired: Drive) -> TickSystem:
    """The whole closed loop for the identity of model.md section 4."""
    program = TickProgram(wired, wired.outermost)
    signals = program.tick(0).signals
    return TickSystem(program, tuple(name for name in OUTPUTS if name in signals))
