"""The walk in continuous time, with or without delays, and with a loop cut anywhere.

Which loop carries which delay. A reference r that is updated every n ticks and used by a loop of n' ticks
(n a multiple of n') waits 0, n', ..., n - n' ticks until it is used: (n - n') Ts/2 on average. The voltage is
held for one tick after the computing delay: d + Ts/2. Along the path of a loop of period T these add up to
d + T/2, as model.md section 3 has it, and nothing is counted twice: with equal rates only the voltage is
held. A difference speed over m velocity periods T is the mean over m T, that is m T/2 old. The measurement
filter is the lag 1/(T_F s + 1). A derivative that the controller takes is the difference over its period, its
delay kept exactly; in the ideal form it is the derivative.

What remains between this form and the sampled one is of order Ts: the digital PI is
Kp (1 + 1/(Tn s)) + Kp T/(2 Tn) + O(s T^2), the tracking loop leads by T/2, a load torque that follows the
output is held, and holds and differences also lose some gain.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_lti.design.law import Law, Matrices
from actuator_lti.drive.blocks import Block
from actuator_lti.errors import InputError
from actuator_lti.loops.rows import Row, table, total
from actuator_lti.loops.walk import INPUTS, Program, Walk

ALL = frozenset({"hold", "measurement", "computing"})
SOURCES = (*INPUTS, "ref_rate", "ref_rate_rate", "cut_rate")
"""Inputs of a flow: those of a program, and the derivatives of the command and of the cut's input."""


@dataclass(frozen=True)
class Flow:
    """``dx = rates (x, z, v), q = delayed (x, z, v), z_k(t) = q_k(t - delays[k])``; signals as such rows.

    v in the order of `SOURCES`; the derivatives occur in the ideal form only.
    """

    states: tuple[str, ...]
    delays_s: np.ndarray
    rates: np.ndarray
    delayed: np.ndarray
    signals: dict[str, np.ndarray]


@dataclass(frozen=True)
class FlowProgram(Program):
    """The linear drive in continuous time (see `Program`)."""

    delays: frozenset[str] = ALL  # which are kept: none is the form ``ideal``; some, for the delay budget

    def flow(self) -> Flow:
        return FlowWalk(self).finish()


class FlowWalk(Walk):
    """The program in continuous time; ``rate`` holds the derivatives of the states."""

    def __init__(self, program: FlowProgram) -> None:
        super().__init__(program)
        self.delays = program.delays
        self.rate: dict[str, Row] = {}
        self.delay: dict[str, float] = {}
        self.waiting: dict[str, Row] = {}
        plant = self.drive.plant
        for r, name in enumerate(plant.states):  # left to itself
            own = (float(plant.A[r, c]) * Row.of(s) for c, s in enumerate(plant.states))
            self.rate[name] = total(own)
        u = self.controllers()
        self.signals.setdefault("u", u)
        torque, load_torque = self.acting()
        for r, name in enumerate(plant.states):
            acting = ((plant.B_u, u), (plant.B_T, torque), (plant.B_M, load_torque))
            self.rate[name] += total(float(B[r]) * row for B, row in acting)

    def state(self, name: str) -> Row:
        self.rate.setdefault(name, Row())
        return Row.of(name)

    def updates(self, every: int) -> bool:
        return True

    def late(self, name: str, value: Row, delay_s: float) -> Row:
        if not delay_s > 0:
            return value
        self.delay[name], self.waiting[name] = delay_s, value
        return Row.of(f"z:{name}")

    def held(self, name: str, value: Row | None, made: int, used: int) -> Row:
        """Late by the mean waiting time; the voltage by its own hold and the computing delay as well."""
        assert value is not None
        delay = (made - used) * self.drive.tick_s / 2 if "hold" in self.delays else 0.0
        if name == "u":
            delay += self.drive.tick_s / 2 if "hold" in self.delays else 0.0
            delay += self.control.computing_delay_s if "computing" in self.delays else 0.0
        return self.late(name, value, delay)

    def own_matrices(self, law: Law) -> Matrices:
        """Those that the design gives for continuous time."""
        if law.continuous is None:
            stage, _ = self.control.own_law or ("*", law)
            given = "sampled, or the law's continuous = {A, B, C, D} in the design as well"
            raise InputError(f"form: control.{stage}.law is a sampled one; allowed: {given}")
        return law.continuous.matrices(len(law.inputs))

    def moves(self, name: str, value: Row) -> None:
        self.rate[name] = value

    def apply(self, name: str, block: Block, value: Row) -> Row:
        return self.realised([f"{name}.{k}" for k in range(len(block.continuous.B))], block.continuous, value)

    def derivative(self, name: str, value: Row, period_s: Any) -> Row:
        """The difference over the period; ideal: the derivative, by the chain rule."""
        if self.delays:
            return (value - self.late(f"{name}_prev", value, period_s)) / period_s
        return total(gain * self.derivative_of(source) for source, gain in value.terms.items())

    def derivative_of(self, name: str) -> Row:
        if name in self.rate and name not in ("i", "w", "W"):
            return self.rate[name]
        if f"{name}_rate" in SOURCES:
            return Row.of(f"{name}_rate")
        raise InputError(f"form = 'ideal': no derivative of {name}; give the derivative a filter time")

    def estimated(self, block: Block, speed: Row, angle: Row) -> Row:
        """From the speed itself, as late as the estimate."""
        age = block.age_s if "measurement" in self.delays else 0.0
        return self.late("speed", self.apply("estimate", block, speed), age)

    def finish(self) -> Flow:
        states, waits = tuple(self.rate), tuple(self.delay)
        names = (*states, *(f"z:{name}" for name in waits), *SOURCES)
        return Flow(
            states, np.array([self.delay[name] for name in waits]), table(self.rate.values(), names),
            table([self.waiting[name] for name in waits], names),
            {name: table([row], names)[0] for name, row in self.signals.items()}
        )  # fmt: skip
