"""The exact sampled form: every loop as a state space with its own period."""

from functools import partial

import numpy as np

from actuator_lti.drive.wiring import COMMANDS, Drive
from actuator_lti.loops.limiters import LimiterPath, Response, limiter_paths
from actuator_lti.loops.periodic import cyclic, fundamental, phase_blocks, point_blocks, shown
from actuator_lti.loops.result import Loop, loop_of
from actuator_lti.loops.simulation import OUTPUTS, TickSystem
from actuator_lti.loops.tick import Block, TickProgram, compose
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.resolvent import states_at


def _system(block: Block, name: str, source: str, signal: str, period_s: float) -> PlainSystem:
    return PlainSystem(block.A, block.B, block.C, block.D, period_s, name, source, signal, block.states)


def stage_blocks(wired: Drive, stage: str, opened: tuple[str, ...] = ()) -> list[Block]:
    """The loop of a stage broken at its own error, inner loops closed (unless opened), outer ones absent.

    One block, or several where a slower speed measurement is fed forward inside (then it is periodic).
    """
    cut, signal, scale = wired.cut_of(stage)
    return phase_blocks(TickProgram(wired, stage, cut, opened), wired.interval[stage], "cut", signal, scale)


def loop(wired: Drive, place: str, opened: tuple[str, ...] = ()) -> Loop:
    """The loop of a stage, see `stage_blocks`, or at a break point with all other loops closed."""
    is_stage = place in wired.stages
    blocks = stage_blocks(wired, place, opened) if is_stage else point_blocks(wired, place)
    block = fundamental(shown(blocks)).shown()
    period = wired.period_s(place if is_stage else wired.producer(place))
    parts, named = (block, block.feedback(), block.sensitivity()), partial(_system, period_s=period)
    own = commanded(wired, place, opened).shown() if wired.responds_apart(place) else None
    return loop_of(wired, place, parts, own, named, period, periodic=len(blocks) > 1)


def reference_to_output(wired: Drive) -> PlainSystem:
    """Command to what the outermost stage moves, at its instants (see `Loops.reference_to_output`)."""
    source, signal, every, label = whole_path(wired)
    block = fundamental_path(TickProgram(wired, wired.outermost), every, "ref", signal)
    return _system(block.shown(), "reference_to_output", source, label, every * wired.tick_s)


def commanded(wired: Drive, stage: str, opened: tuple[str, ...] = ()) -> Block:
    """Command of a stage behind its filter to what it measures, as `stage_blocks` has the other loops."""
    cut, signal, _ = wired.command_of(stage)
    return fundamental_path(TickProgram(wired, stage, cut, opened), wired.interval[stage], "cut", signal)


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


def load_torque_to_output(wired: Drive) -> PlainSystem:
    """Moment on the output shaft, held over every tick, to the output angle: the compliance, all loops
    closed.

    Its inverse is the dynamic stiffness (model.md section 9). Where the drive has slower stages, the
    fundamental of the periodic loop.
    """
    block = fundamental_path(TickProgram(wired, wired.outermost), 1, "load_torque", "output_angle")
    return _system(block, "load_torque_to_output", "load_torque", "output_angle", wired.tick_s)


def tick_system(wired: Drive) -> TickSystem:
    """The whole closed loop for the identity of model.md section 4."""
    program = TickProgram(wired, wired.outermost)
    signals = program.tick(0).signals
    return TickSystem(program, tuple(name for name in OUTPUTS if name in signals))


def limiters(wired: Drive) -> dict[str, LimiterPath]:
    """From the command to what stands in front of each limiter: a row for every tick where that is updated.

    A sinusoid passes every phase of the samples, so the peak of the samples is the magnitude of the row.
    """
    program = TickProgram(wired, wired.outermost)
    ticks = [program.tick(k) for k in range(program.ticks)]
    n, period = len(program.states), program.ticks * wired.tick_s
    A, B = compose(ticks)

    def evaluate(signals: tuple[str, ...], every: int, rate: bool) -> Response:
        rows = []
        for j in range(0, program.ticks, every):
            before = compose(ticks[:j]) if j else (np.eye(n), np.zeros_like(B))
            seen = [ticks[j].signals[signal] for signal in signals]
            rows += [np.append(row[:n] @ before[0], row[:n] @ before[1][:, 0] + row[n]) for row in seen]
        table = np.array(rows)

        def response(omega: np.ndarray) -> np.ndarray:
            z = np.exp(1j * omega * period)
            values = table[:, :n] @ states_at(A, B[:, [0]], z)[:, :, 0].T + table[:, [n]]
            return _changes(values, omega * period) / (every * wired.tick_s) if rate else values

        return response

    return limiter_paths(wired, evaluate, np.pi / period)


def _changes(values: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Change of each update's value from that before it; the last one before the first is a turn older."""
    if len(values) == 1:
        return values * -np.expm1(-1j * turn)
    before = np.roll(values, 1, axis=0)
    before[0] *= np.exp(-1j * turn)
    return values - before
