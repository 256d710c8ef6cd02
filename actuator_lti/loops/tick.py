"""The walk in samples: one controller tick of model.md section 2 as a linear map, with a loop cut anywhere.

Every signal is a row over (states, inputs) at t_k; walking once gives the state-space matrices. States: the
plant's ``i``, ``w``, ``th``, ``W``, ``twist``; past inputs ``u1``, ``u2``, ... under a delay; a block's own,
named after its place (``velocity.I``, ``speed.filter``, ``torque1.1``, ``estimate.D1``); held values
``hold_*`` of slower stages; ``*_prev`` of differences; ``acc``, the angle gained since the last speed
estimate.

An estimated speed is computed from ``acc`` and not from stored angles: so the velocity loop has no
eigenvalue at 1 that it does not see.

Several ticks as one are a block: a slower loop sees A^n, (I + A + ... + A^(n-1)) B (model.md section 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from actuator_lti.design.law import Law, Matrices
from actuator_lti.drive import blocks as own
from actuator_lti.loops.rows import Row, table, total
from actuator_lti.loops.walk import INPUTS, Program, Walk
from actuator_lti.systems.resolvent import LARGE, states_at
from actuator_lti.systems.rest_mode import without_rest_mode

_BESIDE = 1.0 + 2.0**-50


@dataclass(frozen=True)
class Tick:
    """``x+ = A x + B v`` over one tick, and the rows (over x, v) of the signals at its start."""

    A: np.ndarray
    B: np.ndarray
    signals: dict[str, np.ndarray]


@dataclass(frozen=True)
class TickProgram(Program):
    """The linear drive, tick by tick (see `Program`)."""

    @cached_property
    def _walked(self) -> dict[tuple[bool, ...], TickWalk]:
        """A walk for each kind of tick that occurs."""
        first = {self._kind(k): k for k in reversed(range(self.ticks))}
        return {kind: TickWalk(self, k) for kind, k in first.items()}

    def _kind(self, k: int) -> tuple[bool, ...]:
        return tuple(k % every == 0 for every in self.drive.interval.values())

    @cached_property
    def states(self) -> tuple[str, ...]:
        names = dict.fromkeys(name for walk in self._walked.values() for name in walk.next)
        return tuple(sorted(names, key=self._order))

    def _order(self, name: str) -> tuple[int, int]:
        plant = self.drive.plant.states
        if name in plant:
            return 0, plant.index(name)
        return (1, int(name[1:])) if name[0] == "u" and name[1:].isdigit() else (2, 0)

    @cached_property
    def _ticks(self) -> dict[tuple[bool, ...], Tick]:
        return {kind: walk.finish(self.states) for kind, walk in self._walked.items()}

    @cached_property
    def plant_steps(self) -> dict[str, tuple[list[Any], dict[int, Any], list[Any]]]:
        """What makes each state of the plant after a tick: gains of both torques, voltages, states."""
        hold = self.drive.hold
        return {
            name: (
                [_nonzero(hold.Gamma_T[..., r, c]) for c in (0, 1)],
                {j: _nonzero(gain[..., r]) for j, gain in hold.gains.items()},
                [_nonzero(hold.Phi[..., r, c]) for c in range(hold.Phi.shape[-1])],
            )
            for r, name in enumerate(self.drive.plant.states)
        }

    def tick(self, k: int) -> Tick:
        """The map of tick k (only k modulo `ticks` matters)."""
        return self._ticks[self._kind(k % self.ticks)]


class TickWalk(Walk):
    """The program of one tick; ``next`` holds the states after it."""

    program: TickProgram

    def __init__(self, program: TickProgram, k: int) -> None:
        super().__init__(program)
        self.k = k
        self.next: dict[str, Row] = {}
        self.angle: Row | None = None
        self.propagate(self.controllers())

    def state(self, name: str) -> Row:
        """A state; it stays as it is unless something writes it."""
        self.next.setdefault(name, Row.of(name))
        return Row.of(name)

    def updates(self, every: int) -> bool:
        return self.k % every == 0

    def held(self, name: str, value: Row | None, made: int, used: int) -> Row:
        if made == 1:
            assert value is not None
            return value
        kept = self.state(f"hold_{name}")
        if value is None:
            return kept
        self.next[f"hold_{name}"] = value
        return value

    def own_matrices(self, law: Law) -> Matrices:
        return law.sampled

    def moves(self, name: str, value: Row) -> None:
        self.next[name] = value

    def apply(self, name: str, block: own.Block, value: Row) -> Row:
        return self.realised([f"{name}.{state}" for state in block.states], block.sampled, value)

    def derivative(self, name: str, value: Row, period_s: Any) -> Row:
        before = self.state(f"{name}_prev")
        self.next[f"{name}_prev"] = value
        return (value - before) / period_s

    def estimated(self, block: own.Block, speed: Row, angle: Row) -> Row:
        """From the angle gained since the last update."""
        self.angle = angle
        gained = self.state("acc")
        self.next["acc"] = Row()
        return self.apply("estimate", block, gained)

    def sensed_angle(self) -> Row | None:
        """The angle whose gain is counted in every tick, also where nothing is estimated now."""
        if self.angle is None and self.program.measures_speed | self.program.shares_speed:
            if self.design.encoder.speed == "ideal":
                return None
            velocity = self.control.velocity
            behind = velocity is not None and velocity.sensor == "output"
            return self.drive.ratio * self.signals["output_angle"] if behind else self.signals["th"]
        return self.angle

    def propagate(self, u: Row) -> None:
        """The plant over the tick, with the input and its delay line."""
        plant, hold = self.drive.plant, self.drive.hold
        self.signals.setdefault("u", u)
        held = [u, *(self.state(f"u{j}") for j in range(1, hold.memory + 1))]
        outer = self.acting()
        angle = self.sensed_angle()
        x = [self.state(name) for name in plant.states]
        change: dict[str, Row] = {}
        for r, (name, (driven, gains, kept)) in enumerate(self.program.plant_steps.items()):
            rest = total(gain * row for gain, row in zip(driven, outer, strict=True))
            rest += total(gain * held[j] for j, gain in gains.items())
            self.next[name] = rest + total(gain * row for gain, row in zip(kept, x, strict=True))
            if angle is not None and name in angle.terms:
                moved = [*kept[:r], _nonzero(kept[r] - 1.0), *kept[r + 1 :]]  # exactly 0: the motor's angle
                change[name] = rest + total(gain * row for gain, row in zip(moved, x, strict=True))
        for j in range(1, hold.memory + 1):
            self.next[f"u{j}"] = held[j - 1]
        if angle is not None:
            self.state("acc")
            self.next["acc"] += total(value * change[name] for name, value in angle.terms.items())

    def finish(self, states: tuple[str, ...]) -> Tick:
        n, names = len(states), (*states, *INPUTS)
        rows = table([self.next.get(name, Row.of(name)) for name in states], names)
        signals = table(self.signals.values(), names)
        split = {name: signals[..., k, :] for k, name in enumerate(self.signals)}
        return Tick(rows[..., :n], rows[..., n:], split)


def _nonzero(value: Any) -> Any:
    """A coefficient of the sampled plant; the float 0 where it is zero, so that structure shows."""
    if np.ndim(value) == 0:
        return float(value)
    return value if np.any(value != 0) else 0.0


def seen(depends: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Which states an output sees, through others as well.

    ``depends[r, c]``: state r is computed from state c; ``start``: what the output looks at itself.
    """
    result, new = start.copy(), start
    while new.any():
        new = depends[new].any(axis=0) & ~result
        result |= new
    return result


@dataclass(frozen=True)
class Block:
    """A sampled SISO system ``x+ = A x + B v, y = C x + D v``."""

    A: np.ndarray  # shapes (n, n), (n, 1), (1, n), (1, 1), or stacked over designs in front
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]

    def of(self, k: int) -> Block:
        A, B, C, D = (part[k] if part.ndim > 2 else part for part in (self.A, self.B, self.C, self.D))
        return replace(self, A=A, B=B, C=C, D=D)

    def pruned(self) -> Block:
        return pruned([self])[0]

    def shown(self) -> Block:
        """Without a mode at zero frequency that it does not show, see `rest_mode`; one design only."""
        A, B, C, kept = without_rest_mode(self.A, self.B, self.C, 1.0)
        names = tuple(name for name, there in zip(self.states, kept, strict=True) if there)
        return Block(A, B, C, self.D, names)

    def feedback(self) -> Block:
        """Closed with negative unit feedback, output kept: T = L/(1 + L). Needs D = 0."""
        return replace(self, A=self.A - self.B @ self.C)

    def sensitivity(self) -> Block:
        """S = 1/(1 + L). Needs D = 0."""
        return replace(self, A=self.A - self.B @ self.C, C=-self.C, D=np.ones_like(self.D))


def used(blocks: Sequence[Block]) -> np.ndarray:
    """Which of the common states of blocks their outputs see and their inputs reach, in any of the blocks.

    The motor angle inside an inner loop is not seen, the filter of the command not reached.
    """
    n = len(blocks[0].states)

    def there(name: str, *shape: int) -> np.ndarray:
        parts = (getattr(block, name).reshape(-1, *shape) for block in blocks)
        return np.any([np.any(part != 0, axis=0) for part in parts], axis=0)

    depends = there("A", n, n)
    return seen(depends, there("C", n)) & seen(depends.T, there("B", n))


def pruned(blocks: Sequence[Block]) -> list[Block]:
    kept = used(blocks)
    names = tuple(name for name, there in zip(blocks[0].states, kept, strict=True) if there)
    return [
        Block(b.A[..., kept, :][..., :, kept], b.B[..., kept, :], b.C[..., :, kept], b.D, names)
        for b in blocks
    ]


def compose(ticks: Sequence[Tick]) -> tuple[np.ndarray, np.ndarray]:
    A, B = ticks[0].A, ticks[0].B
    for tick in ticks[1:]:
        A, B = tick.A @ A, tick.A @ B + tick.B
    return A, B


def siso(program: TickProgram, ticks: Sequence[Tick], source: str, signal: str, scale: Any = 1.0) -> Block:
    """From an input held over the ticks to a signal at the start of the first of them."""
    n = len(program.states)
    column = INPUTS.index(source)
    A, B = compose(ticks)
    row = np.asarray(scale)[..., None, None] * ticks[0].signals[signal][..., None, :]
    return Block(A, B[..., :, [column]], row[..., :n], row[..., [n + column]], program.states)


def mean_response(steps: Sequence[tuple[Any, ...]], z: np.ndarray) -> np.ndarray:
    """Fundamental of a periodic system at z (..., 1, 1): A, B, C, D of each of the M steps of its period.

    An input z^k leaves the states z^k p_k with p_k of period M, ``z p_(k+1) = A_k p_k + B_k``; the mean of
    ``C_k p_k + D_k`` over a period is asked. It begins where ``z^M p_0`` is ``A_(M-1) ... A_0 p_0`` and the
    sum of ``A_(M-1) ... A_(k+1) B_k z^k``.
    """
    n = steps[0][0].shape[-1]
    over, driven, power, total = np.eye(n), np.zeros((n, 1)), np.ones_like(z), 0.0
    for A, B, _, _ in steps:
        over, driven, power = A @ over, A @ driven + B * power, power * z
    p = _solved(over, driven, power)
    for A, B, C, D in steps:
        total, p = total + C @ p + D, (A @ p + B) / z
    return np.asarray(total / len(steps))


def _solved(A: Any, right: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(p - A)^-1 right at points (..., 1, 1); of stacked designs with many states one after the other."""
    n = A.shape[-1]
    if n < LARGE:
        try:
            return np.asarray(np.linalg.solve(points * np.eye(n) - A, right))
        except np.linalg.LinAlgError:  # a pole is met to the last bit
            return np.asarray(np.linalg.solve(_BESIDE * points * np.eye(n) - A, right))
    A, points = (np.broadcast_to(each, (*right.shape[:-2], *each.shape[-2:])) for each in (A, points))
    parts = zip(
        A[..., 0, :, :].reshape(-1, n, n),
        right.reshape(-1, *right.shape[-3:]),
        points.reshape(-1, points.shape[-3]),
        strict=True,
    )
    return np.reshape([states_at(*each) for each in parts], right.shape)
