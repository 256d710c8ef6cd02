"""One controller tick of model.md section 2 as a linear map, with a loop cut anywhere.

Every signal is a row vector over (states, inputs) at t_k; running the tick's program once on rows gives
the state-space matrices.  States: the plant's ``i``, ``w``, ``th``; integrals ``I_current``,
``I_velocity``; held references ``hold_*`` of slower loops; past inputs ``u1``, ``u2``, ... under a
delay; ``acc``, ``D1``, ... and ``filter`` of the speed estimate; ``ref_prev`` of the feed-forward.

A difference speed is kept as angle gained since the last velocity update (``acc``) and over the
updates before it (``Dj``), not as stored angles: so the velocity loop has no eigenvalue at 1 that it
does not see.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuator_lti.loops.cascade import ERRORS, Cascade
from actuator_lti.sampling import DelayedHold, delayed_hold


@dataclass(frozen=True)
class Tick:
    """``x+ = A x + B v`` over one tick, and the rows (over x, v) of the signals at its start."""

    A: np.ndarray
    B: np.ndarray
    signals: dict[str, np.ndarray]


@dataclass(frozen=True)
class TickProgram:
    """The linear drive, tick by tick, up to a stage, perhaps with one signal cut.

    Attributes
    ----------
    cascade : Cascade
    outer : str
        Outermost stage that runs; the reference of that stage is an input (``th_ref`` at the output shaft).
    cut : str or None
        A break point (``u``, ``i_ref``, ``w_ref``, ``output``) or an error (``e_i``, ``e_w``, ``e_th``)
        that is replaced by the input ``cut`` where it is updated; what arrives is the signal of that
        name.
    opened : tuple of str
        Stages whose feedback is taken away; their controllers stay in the path.
    """

    cascade: Cascade
    outer: str
    cut: str | None = None
    opened: tuple[str, ...] = ()

    @cached_property
    def stages(self) -> tuple[str, ...]:
        """Stages that run, innermost first."""
        names = self.cascade.stages
        return names[: names.index(self.outer) + 1]

    @property
    def ticks(self) -> int:
        """Ticks after which the program repeats."""
        return self.cascade.interval[self.outer]

    @cached_property
    def hold(self) -> DelayedHold:
        """The sampled plant, angle included; the angle is an exact integrator."""
        plant, control = self.cascade.plant, self.cascade.design.controller
        hold = delayed_hold(
            plant.A, plant.B_u[:, None], plant.B_T[:, None], control.period_s, control.computing_delay_s
        )
        if plant.states[-1] == "th":
            hold.Phi[:, -1] = np.eye(len(plant.states))[-1]
        return hold

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """``ref`` (of the outer stage), ``torque`` (N m at the motor, accelerating), ``cut``."""
        return ("ref", "torque", "cut")

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Names of the states, see the module."""
        cascade, encoder = self.cascade, self.cascade.design.encoder
        needs_angle = self.outer == "position" or cascade.plant.stiffness_Nm_rad != 0.0
        names = [s for s in cascade.plant.states if s != "th" or needs_angle]
        names += [f"u{j}" for j in range(1, self.hold.memory + 1)]
        names += [f"I_{stage}" for stage in self.stages if cascade.pi(stage).integral_time_s is not None]
        names += [f"hold_{cascade.target[stage]}" for stage in self.stages if cascade.interval[stage] > 1]
        if "velocity" in self.stages and "velocity" not in self.opened:
            if encoder.speed == "difference":
                names += ["acc", *(f"D{j}" for j in range(1, encoder.difference_samples))]
            names += ["filter"] if encoder.filter_time_s > 0 else []
        if self.outer == "position" and cascade.design.controller.position_loop.feedforward != 0.0:
            names.append("ref_prev")
        return tuple(names)

    def tick(self, k: int) -> Tick:
        """The map of tick k (only k modulo `ticks` matters)."""
        return _Run(self, k).finish()


class _Run:
    """The program of one tick on row vectors."""

    def __init__(self, program: TickProgram, k: int) -> None:
        self.program, self.cascade, self.k = program, program.cascade, k
        names = (*program.states, *(f"in:{name}" for name in program.inputs))
        self.row = dict(zip(names, np.eye(len(names)), strict=True))
        self.next = {name: self.row[name] for name in program.states}
        self.zero = np.zeros(len(names))
        self.signals: dict[str, np.ndarray] = {}

    def at_cut(self, name: str, value: np.ndarray) -> np.ndarray:
        self.signals[name] = value
        return self.row["in:cut"] if self.program.cut == name else value

    def publish(self, stage: str, value: np.ndarray | None) -> np.ndarray:
        """Pass a stage's output on, from its hold where it was not updated in this tick."""
        target = self.cascade.target[stage]
        hold = f"hold_{target}"
        if value is None:
            self.signals[target] = self.row[hold]
            return self.row[hold]
        value = self.at_cut(target, value)
        if hold in self.next:
            self.next[hold] = value
        return value

    def position(self) -> np.ndarray | None:
        cascade, position = self.cascade, self.cascade.design.controller.position_loop
        reference = cascade.ratio * self.row["in:ref"]
        fed_back = cascade.ratio * self.at_cut("output", self.row["th"] / cascade.ratio)
        self.signals["th"] = self.row["th"]
        if self.k % cascade.interval["position"]:
            return None
        value = position.gain * self.at_cut("e_th", reference - fed_back)
        if "ref_prev" in self.next:
            change = (reference - self.row["ref_prev"]) / cascade.period_s("position")
            value = value + position.feedforward * change
            self.next["ref_prev"] = reference
        self.signals["w_cmd"] = value
        return value

    def measured_speed(self) -> np.ndarray:
        encoder, T = self.cascade.design.encoder, self.cascade.period_s("velocity")
        m, speed = encoder.difference_samples, self.row["w"]
        if encoder.speed == "difference":
            past = [self.zero, *(self.row[f"D{j}"] for j in range(1, m))]
            speed = (self.row["acc"] + past[m - 1]) / (m * T)
            for j in range(1, m):
                self.next[f"D{j}"] = self.row["acc"] + past[j - 1]
            self.next["acc"] = self.zero
        if "filter" in self.next:
            old = self.row["filter"]
            speed = old + T / (encoder.filter_time_s + T) * (speed - old)
            self.next["filter"] = speed
        return speed

    def pi(self, stage: str, error: np.ndarray) -> np.ndarray:
        law, integral = self.cascade.pi(stage), f"I_{stage}"
        error = self.at_cut(ERRORS[stage], error)
        if integral not in self.next:
            return law.gain * error
        self.next[integral] = self.row[integral] + law.integral_step * error
        return law.gain * error + self.next[integral]

    def velocity(self, reference: np.ndarray) -> np.ndarray | None:
        if self.k % self.cascade.interval["velocity"]:
            return None
        if "velocity" in self.program.opened:
            return self.pi("velocity", reference)
        self.signals["w_meas"] = self.measured_speed()
        return self.pi("velocity", reference - self.signals["w_meas"])

    def controllers(self) -> np.ndarray:
        reference, stages = self.row["in:ref"], self.program.stages
        if "position" in stages:
            reference = self.publish("position", self.position())
        if "velocity" in stages:
            reference = self.publish("velocity", self.velocity(reference))
        if "current" in stages:
            error = reference if "current" in self.program.opened else reference - self.row["i"]
            reference = self.publish("current", self.pi("current", error))
        return reference

    def propagate(self, u: np.ndarray) -> None:
        plant, hold = self.cascade.plant, self.program.hold
        x = [self.row.get(name, self.zero) for name in plant.states]
        held = [u, *(self.row[f"u{j}"] for j in range(1, hold.memory + 1))]
        torque = self.row["in:torque"]
        if plant.stiffness_Nm_rad:
            torque = torque + plant.stiffness_Nm_rad * self.row["th"]
        for r, name in enumerate(plant.states):
            value = sum((hold.Phi[r, c] * x[c] for c in range(len(x))), hold.Gamma_T[r, 0] * torque)
            value = value + sum(gain[r] * held[j] for j, gain in hold.gains.items())
            if name in self.next:
                self.next[name] = value
            if name == "th" and "acc" in self.next:
                self.next["acc"] = self.next["acc"] + (value - x[r])
        for j in range(1, hold.memory + 1):
            self.next[f"u{j}"] = held[j - 1]

    def finish(self) -> Tick:
        for name in ("i", "w", "th"):
            if name in self.row:
                self.signals[name] = self.row[name]
        u = self.controllers()
        self.signals.setdefault("u", u)
        self.propagate(u)
        n = len(self.program.states)
        rows = np.array([self.next[name] for name in self.program.states])
        return Tick(rows[:, :n], rows[:, n:], self.signals)
