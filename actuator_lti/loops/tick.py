"""The walk in samples: one controller tick of model.md section 2 as a linear map, with a loop cut anywhere.

Every signal is a row over (states, inputs) at t_k; walking once gives the state-space matrices. States: the
plant's ``i``, ``w``, ``th``, ``W``, ``twist``; past inputs ``u1``, ``u2``, ... under a delay; a block's own,
named after its place (``velocity.I``, ``speed.filter``, ``torque1.1``, ``estimate.D1``); held values
``hold_*`` of slower stages; ``*_prev`` of differences; ``acc``, the angle gained since the last speed
estimate.

An estimated speed is computed from ``acc`` and not from stored angles: so the velocity loop has no
eigenvalue at 1 that it does not see.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from actuator_lti.design.law import Law, Matrices
from actuator_lti.drive.blocks import Block
from actuator_lti.loops.rows import Row, table, total
from actuator_lti.loops.walk import INPUTS, Program, Walk


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
        """Names of the states, see the module."""
        names = dict.fromkeys(name for walk in self._walked.values() for name in walk.next)
        return tuple(sorted(names, key=self._order))

    def _order(self, name: str) -> tuple[int, int]:
        plant = self.drive.plant.states
        if name in plant:
            return 0, plant.index(name)
        return (1, int(name[1:])) if name[0] == "u" and name[1:].isdigit() else (2, 0)

    @property
    def inputs(self) -> tuple[str, ...]:
        """``ref`` (of the outer stage), ``torque`` (N m at the motor, accelerating), ``moment``, ``cut``."""
        return INPUTS

    @cached_property
    def _ticks(self) -> dict[tuple[bool, ...], Tick]:
        return {kind: walk.finish(self.states) for kind, walk in self._walked.items()}

    def tick(self, k: int) -> Tick:
        """The map of tick k (only k modulo `ticks` matters)."""
        return self._ticks[self._kind(k % self.ticks)]


class TickWalk(Walk):
    """The program of one tick; ``next`` holds the states after it."""

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
        """Whether k is a multiple."""
        return self.k % every == 0

    def held(self, name: str, value: Row | None, made: int, used: int) -> Row:
        """Held from one update to the next."""
        if made == 1:
            assert value is not None
            return value
        kept = self.state(f"hold_{name}")
        if value is None:
            return kept
        self.next[f"hold_{name}"] = value
        return value

    def own_matrices(self, law: Law) -> Matrices:
        """Those that run."""
        return law.sampled

    def moves(self, name: str, value: Row) -> None:
        """At the next update."""
        self.next[name] = value

    def apply(self, name: str, block: Block, value: Row) -> Row:
        """The sampled realisation."""
        return self.realised([f"{name}.{state}" for state in block.states], block.sampled, value)

    def derivative(self, name: str, value: Row, period_s: Any) -> Row:
        """(x_k - x_{k-1})/T."""
        before = self.state(f"{name}_prev")
        self.next[f"{name}_prev"] = value
        return (value - before) / period_s

    def estimated(self, block: Block, speed: Row, angle: Row) -> Row:
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
        for r, name in enumerate(plant.states):
            rest = total(_nonzero(hold.Gamma_T[..., r, c]) * outer[c] for c in (0, 1))
            rest += total(_nonzero(gain[..., r]) * held[j] for j, gain in hold.gains.items())
            own = [hold.Phi[..., r, c] for c in range(len(x))]
            self.next[name] = rest + total(_nonzero(own[c]) * x[c] for c in range(len(x)))
            own[r] = own[r] - 1.0  # exactly 0 for the motor's angle
            change[name] = rest + total(_nonzero(own[c]) * x[c] for c in range(len(x)))
        for j in range(1, hold.memory + 1):
            self.next[f"u{j}"] = held[j - 1]
        if angle is not None:
            self.state("acc")
            self.next["acc"] += total(value * change[name] for name, value in angle.terms.items())

    def finish(self, states: tuple[str, ...]) -> Tick:
        """Matrices over the states of the whole program."""
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
