"""Where a signal is added to a drive that runs by hand, and what is read of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from actuator_lti.drive.signals import Kind
from nonlinear._kernels import layout as at
from nonlinear.bench.lifted import Floats
from nonlinear.bench.loop_setup import LoopSetup
from nonlinear.runs.running import Running

RETURNED = {
    "u": at.S_VOLTAGE_BEFORE, "i_ref": at.S_CURRENT_BEFORE, "w_ref": at.S_SPEED_COMMAND,
    "output": at.S_OUTPUT_BEFORE,
}  # fmt: skip
COUNTS = [at.COUNTS_PER_RAD, at.POSITION_COUNTS, at.OWN_COUNTS, at.OWN_OUTPUT_COUNTS]
HELD = {"velocity_integral": at.S_VELOCITY_INTEGRATOR, "current_integral": at.S_CURRENT_INTEGRATOR}


@dataclass(frozen=True)
class Watched:
    """A signal in front of a limiter, at its last update before the next command."""

    signal: str  # "u", "i_ref", "w_ref", "torque_command", "i", "velocity_integral" or "current_integral"
    kind: Kind  # the signal itself, its change over the update by ``period_s``, the plant's at the last tick
    every: int  # ticks between two updates
    period_s: float  # time of them


class Injection:
    """A place of a drive: where a signal is added, what is large there, what is read (None: what returns)."""

    def __init__(self, setup: LoopSetup, place: str, watched: Sequence[Watched | None] = (None,)) -> None:
        design = setup.design
        self.place, self.rows, self.ratio = place, setup.rows(), design.total_ratio
        self.at_start = place in ("command", "load")
        self.outermost, self.readings = design.controller.outermost, len(watched)
        self.own = [k for k, each in enumerate(watched) if each is None]
        others = [(k, each) for k, each in enumerate(watched) if each is not None]
        self.watched = sorted(others, key=lambda one: -one[1].every)
        if place == "load":
            self.hold_ticks, self.at = 1, at.LOAD
        elif place == "command":
            self.rows.step("command", 0.0, -1.0)
            self.hold_ticks, self.at = setup.every(self.outermost), at.COMMAND + 1
        else:
            point = setup.point
            self.rows.step(point, 0.0, -1.0)
            probe = at.PROBES + at.POINTS.index(point) * at.PROBE_SIZE
            self.hold_ticks, self.at = setup.hold_ticks, probe + at.PROBE_SIGNAL + 1
            self.read_at = RETURNED[point]
        self.signals = {"i": at.S_CURRENT} | RETURNED | HELD
        if "velocity" in setup.wired.stages:
            self.signals["torque_command"] = RETURNED[setup.wired.target["velocity"]]
        self.size = setup.range if isfinite(setup.range) and setup.range > 0.0 else 1.0
        self.steady = float(self.rows.values[0, self.at])

    def prepare(self, p: Floats) -> None:
        """Without counts; the load is looked at in every tick where it is what is moved."""
        p[COUNTS] = 0.0
        if self.place == "load":
            p[at.LOAD_VARIES] = 1.0

    def run(self, drive: Running, states: Floats, values: Floats) -> Floats:
        """Run every state to the next update with its own value; what is read, shape (states, readings).

        A signal is read, or what it changed by, at its last update.  What stands in front of the torque
        filters is no number of the state: that update is made once more without them.
        """
        seen, tick = np.empty((len(states), self.readings)), 0
        if self.at_start:
            seen[:, self.own] = self._read(states, drive.p)[:, None]
        for k, watched in self.watched:
            drive.each(states, self.hold_ticks - watched.every - tick, self.at, values)
            tick, before = self.hold_ticks - watched.every, states
            if watched.signal == "torque_command":
                before, filters = states.copy(), drive.p[at.TORQUE_FILTERS]
                drive.p[at.TORQUE_FILTERS] = 0.0
                drive.each(before, 1, self.at, values)
                drive.p[at.TORQUE_FILTERS] = filters
            seen[:, k] = before[:, self.signals[watched.signal]]
        drive.each(states, self.hold_ticks - tick, self.at, values)
        if not self.at_start:
            seen[:, self.own] = self._read(states, drive.p)[:, None]
        for k, watched in self.watched:
            after = states[:, self.signals[watched.signal]]
            if watched.kind == "rate":
                seen[:, k] = (after - seen[:, k]) / watched.period_s
            elif watched.kind == "value" and watched.signal != "torque_command":
                seen[:, k] = after
        return seen

    def _read(self, s: Floats, p: Floats) -> Floats:
        """What comes back, negated; the output itself for command and load."""
        if self.place == "current":  # cut at its controller's output: back-EMF feed-forward stays closed
            return p[at.BACK_EMF_FEEDFORWARD] * s[:, at.S_MEASURED_SPEED] - s[:, self.read_at]
        if not self.at_start:
            return -s[:, self.read_at]
        if self.place == "command" and self.outermost != "position":
            return s[:, at.S_CURRENT if self.outermost == "current" else at.S_SPEED].copy()
        return s[:, at.S_OUTPUT].copy() if p[at.ELASTIC_DRIVE] > 0.0 else s[:, at.S_ANGLE] / self.ratio
