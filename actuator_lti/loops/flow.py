"""The cascade in continuous time, with or without delays, and with a loop cut anywhere.

Which loop carries which delay. A reference r that is updated every n ticks and used by a loop of n' ticks
(n a multiple of n') waits 0, n', ..., n - n' ticks until it is used: (n - n') Ts/2 on average. The voltage is
held for one tick after the computing delay: d + Ts/2. Along the path of a loop of period T these add up to
d + T/2, as model.md section 3 has it, and nothing is counted twice: with equal rates only the voltage is
held. A difference speed over m velocity periods T is the mean over m T, that is m T/2 old. The measurement
filter is the lag 1/(T_F s + 1).

What remains between this form and the sampled one is of order Ts: the digital PI is
Kp (1 + 1/(Tn s)) + Kp T/(2 Tn) + O(s T^2), and holds and differences also lose some gain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuator_lti.loops.cascade import ERRORS, Cascade

INPUTS = ("ref", "ref_rate", "torque", "cut")


@dataclass(frozen=True)
class Flow:
    """``dx = rates (x, z, v), q = delayed (x, z, v), z_k(t) = q_k(t - delays[k])``; signals as such rows.

    v = (ref, ref_rate, torque, cut): the reference of the outermost stage (``ref`` of the position at the
    output shaft, ``ref_rate`` its derivative), a torque at the motor, the input at the cut.
    """

    states: tuple[str, ...]
    delays_s: np.ndarray
    rates: np.ndarray
    delayed: np.ndarray
    signals: dict[str, np.ndarray]


@dataclass(frozen=True)
class FlowProgram:
    """The linear drive in continuous time, up to a stage, perhaps with one signal cut (as `TickProgram`).

    Attributes
    ----------
    delays : {"all", "none", "no computing", "no computing, no measurement"}
        Which delays are kept: all of them; none (form ``ideal``); all but the computing delay; the holds only
        (for the delay budget).
    opened : tuple of str
        Stages whose feedback is taken away; their controllers stay in the path.
    """

    cascade: Cascade
    outer: str
    cut: str | None = None
    delays: str = "all"
    opened: tuple[str, ...] = ()

    @cached_property
    def stages(self) -> tuple[str, ...]:
        """Stages that run, innermost first."""
        names = self.cascade.stages
        return names[: names.index(self.outer) + 1]

    @property
    def measures_speed(self) -> bool:
        """Whether the velocity feedback is there."""
        return "velocity" in self.stages and "velocity" not in self.opened

    @cached_property
    def delay_table(self) -> dict[str, float]:
        """Delay in s of each place that has one: ``u``, ``i_ref``, ``w_ref`` and ``speed``."""
        if self.delays == "none":
            return {}
        cascade, control, encoder = self.cascade, self.cascade.design.controller, self.cascade.design.encoder
        inner, table = 1, {}
        for stage in self.stages:
            table[cascade.target[stage]] = (cascade.interval[stage] - inner) * cascade.tick_s / 2
            inner = cascade.interval[stage]
        table["u"] = table.get("u", 0.0) + cascade.tick_s / 2
        if self.delays == "all":
            table["u"] += control.computing_delay_s
        if self.measures_speed and encoder.speed == "difference" and "no measurement" not in self.delays:
            table["speed"] = encoder.difference_samples * cascade.period_s("velocity") / 2
        return {name: delay for name, delay in table.items() if delay > 0}

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Plant states, integrals of the controllers, measurement filter."""
        cascade, encoder = self.cascade, self.cascade.design.encoder
        needs_angle = self.outer == "position" or cascade.plant.stiffness_Nm_rad != 0.0
        names = [s for s in cascade.plant.states if s != "th" or needs_angle]
        names += [f"I_{stage}" for stage in self.stages if cascade.pi(stage).integral_time_s is not None]
        if self.measures_speed and encoder.filter_time_s > 0:
            names.append("filter")
        return tuple(names)

    def flow(self) -> Flow:
        """Run the program once on rows."""
        return _Run(self).finish()


class _Run:
    def __init__(self, program: FlowProgram) -> None:
        self.program, self.cascade = program, program.cascade
        waits = (*(f"z:{name}" for name in program.delay_table),)
        names = (*program.states, *waits, *(f"in:{name}" for name in INPUTS))
        self.row = dict(zip(names, np.eye(len(names)), strict=True))
        self.rate: dict[str, np.ndarray] = {}
        self.waiting: dict[str, np.ndarray] = {}
        self.signals: dict[str, np.ndarray] = {}

    def at_cut(self, name: str, value: np.ndarray) -> np.ndarray:
        self.signals[name] = value
        return self.row["in:cut"] if self.program.cut == name else value

    def after_delay(self, name: str, value: np.ndarray) -> np.ndarray:
        if name not in self.program.delay_table:
            return value
        self.waiting[name] = value
        return self.row[f"z:{name}"]

    def publish(self, stage: str, value: np.ndarray) -> np.ndarray:
        target = self.cascade.target[stage]
        return self.after_delay(target, self.at_cut(target, value))

    def position(self) -> np.ndarray:
        cascade, position = self.cascade, self.cascade.design.controller.position_loop
        fed_back = cascade.ratio * self.at_cut("output", self.row["th"] / cascade.ratio)
        value = position.gain * self.at_cut("e_th", cascade.ratio * self.row["in:ref"] - fed_back)
        value = value + position.feedforward * cascade.ratio * self.row["in:ref_rate"]
        self.signals["w_cmd"] = value
        return value

    def measured_speed(self) -> np.ndarray:
        speed = self.after_delay("speed", self.row["w"])
        if "filter" in self.program.states:
            self.rate["filter"] = (speed - self.row["filter"]) / self.cascade.design.encoder.filter_time_s
            speed = self.row["filter"]
        self.signals["w_meas"] = speed
        return speed

    def pi(self, stage: str, error: np.ndarray) -> np.ndarray:
        law, integral = self.cascade.pi(stage), f"I_{stage}"
        error = self.at_cut(ERRORS[stage], error)
        if integral not in self.program.states:
            return law.gain * error
        self.rate[integral] = law.integral_rate_s * error
        return law.gain * error + self.row[integral]

    def controllers(self) -> np.ndarray:
        reference = self.row["in:ref"]
        if "position" in self.program.stages:
            reference = self.publish("position", self.position())
        if "velocity" in self.program.stages:
            error = reference - self.measured_speed() if self.program.measures_speed else reference
            reference = self.publish("velocity", self.pi("velocity", error))
        if "current" in self.program.stages:
            error = reference if "current" in self.program.opened else reference - self.row["i"]
            reference = self.publish("current", self.pi("current", error))
        return reference

    def finish(self) -> Flow:
        plant, program = self.cascade.plant, self.program
        self.signals |= {name: self.row[name] for name in plant.states if name in self.row}
        u, torque = self.controllers(), self.row["in:torque"]
        if plant.stiffness_Nm_rad:
            torque = torque + plant.stiffness_Nm_rad * self.row["th"]
        for r, name in enumerate(plant.states):
            if name in program.states:
                rate = plant.B_u[r] * u + plant.B_T[r] * torque
                known = [(c, s) for c, s in enumerate(plant.states) if s in self.row]
                self.rate[name] = rate + sum((plant.A[r, c] * self.row[s] for c, s in known), 0 * u)
        width = len(u)
        rates = np.array([self.rate[name] for name in program.states]).reshape(-1, width)
        waits = np.array([self.waiting[name] for name in program.delay_table]).reshape(-1, width)
        return Flow(program.states, np.array(list(program.delay_table.values())), rates, waits, self.signals)
