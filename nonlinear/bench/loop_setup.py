"""One loop of a drive on the bench: which loops run, where the instrument sits, and the state it starts in.

The loop definition of model.md section 3 (inner loops closed, outer ones open) is made as a drive does it:
for the velocity loop the position controller is out of action and the speed command is a constant (speed
mode); for the current loop the current command is (torque mode).  The rotor may then be held at its speed, as
a bench does it: a free one runs away under a constant torque, and what is measured is the back-EMF.  For a
break point all loops run.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, lcm

import numpy as np
import numpy.typing as npt

from actuator_lti.design.control import FEED_FORWARD
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from nonlinear._kernels import layout as at
from nonlinear.bench.operating_motion import (
    OperatingMotion,
    current_state,
    full_torque_Nm,
    may_stand,
    operating_motion,
    standing,
    velocity_state,
)
from nonlinear.bench.own_law_start import own_start
from nonlinear.bench.probe import Probe, write_probe
from nonlinear.rows import Rows

Floats = npt.NDArray[np.float64]
Value = float | npt.NDArray[np.float64]
STAGES = ("current", "velocity", "position")
HELD = 1e12  # so many times its inertia holds the rotor at its speed


@dataclass(frozen=True)
class LoopSetup:
    """A drive set up to test one loop.

    Attributes
    ----------
    design : Design
    loop : str
        ``"current"``, ``"velocity"``, ``"position"`` (outer loops open), or a break point ``"u"``,
        ``"i_ref"``, ``"w_ref"``, ``"output"`` (all other loops closed).
    bias : OperatingMotion
        The motion underneath.
    limits_on : bool
    held : bool
        Whether the rotor is held at its speed.
    """

    design: Design
    loop: str
    bias: OperatingMotion
    limits_on: bool = True
    held: bool = False

    @cached_property
    def stages(self) -> tuple[str, ...]:
        """Stages that the design has, innermost first."""
        return stages_of(self.design)

    @cached_property
    def outer(self) -> str:
        """Outermost stage that runs."""
        return self.loop if self.loop in STAGES or not self.stages else self.stages[-1]

    @cached_property
    def point(self) -> str:
        """Where the instrument sits."""
        if self.loop in PATHS:
            return target(self.design, self.outer) if self.stages else "u"
        return target(self.design, self.loop) if self.loop in STAGES else self.loop

    @property
    def before(self) -> str:
        """Name of the signal in front of the instrument."""
        return f"probe_{self.point}_before"

    @cached_property
    def hold_ticks(self) -> int:
        """Ticks between two updates at the point."""
        return every(self.design, producer(self.design, self.point))

    @cached_property
    def base_ticks(self) -> int:
        """Ticks after which everything repeats."""
        current, own = self.design.controller.current, self.design.controller.own_law
        fed = current is not None and current.back_emf_feedforward != 0.0
        taken = fed or (own is not None and self._own is not None and "speed" in own[1].inputs)
        measured = taken and not self.held and "velocity" in self.stages
        stages = self._running + (("velocity",) if measured else ())
        return lcm(*(every(self.design, stage) for stage in stages))

    @property
    def period_s(self) -> float:
        """Sampling period of the loop at the point."""
        return self.hold_ticks * self.design.controller.period_s

    @property
    def _running(self) -> tuple[str, ...]:
        return self.stages[: self.stages.index(self.outer) + 1] if self.stages else ()

    @property
    def _own(self) -> str | None:
        """The stage that has a law of one's own, if it runs."""
        own = self.design.controller.own_law
        return own[0] if own is not None and own[0] in self._running else None

    @property
    def condition(self) -> str:
        """On which motion it is tested, in words."""
        if self.held:
            return "rotor locked" + (" at a constant speed" if self.bias.speed_rad_s else "")
        if self.bias.speed_rad_s:
            pressed = ", coupling pressed by a constant load" if self.bias.coupling_Nm else ""
            return f"on a constant speed{pressed}"
        return "standing, without dry friction"

    def rows(self, gain: npt.ArrayLike = 1.0, delay_samples: npt.ArrayLike = 0.0) -> Rows:
        """Parameters of runs that start in the steady state of the operating motion, one a value.

        ``gain`` is a factor on the whole controller in front of the point; a delay is in the point's samples.
        """
        gains, delays = np.broadcast_arrays(np.atleast_1d(gain), np.atleast_1d(delay_samples))
        rows = self._base.repeat(gains.size)
        for values, delay in zip(rows.values, delays, strict=True):
            write_probe(Probe(point=self.point, delay_samples=float(delay)), values)  # type: ignore[arg-type]
        for place in gains_of(self.design, producer(self.design, self.point)):
            rows[place] *= gains
        self._start(rows)
        return rows

    @cached_property
    def _base(self) -> Rows:
        """The row without instrument and state."""
        row = Rows.of(self.design, friction_on=self.bias.friction_on, limits_on=self.limits_on)
        dropped = ("friction_feedforward",) if self.loop in PATHS else FEED_FORWARD
        for name in dropped:
            row[name] = 0.0
        if self.outer != "position":
            for name in GAINS["position"]:
                row[name] = 0.0
        if self.outer == "current":
            row["velocity_gain"] = row["velocity_integral"] = 0.0
        if self._own is None:
            row["own_stage"] = 0.0
        if self.held:
            for name in ("inertia", "motor_inertia"):
                row[name] *= HELD
        return row

    def _start(self, row: Rows) -> None:
        """Write the steady state, from the motor outwards."""
        self.bias.load(row)
        row["speed_start"], row["current_start"] = self.bias.speed_rad_s, self.bias.current_A
        row["twist_start"] = self.bias.twist_rad
        row["load_speed_start"] = self.bias.speed_rad_s / self.design.ratio_to_coupling
        wanted: Value = self.bias.voltage_V
        point = "u"
        row["voltage_start"] = wanted
        for stage in self._running:
            if stage == "position":
                self._position(row, wanted)
                if point == "w_ref":
                    row["speed_command_start"] = wanted
                return
            wanted = self._current(row) if stage == "current" else self._velocity(row, wanted)
            point = "i_ref" if stage == "current" else "w_ref"
            if point == "i_ref":
                row["current_command_start"] = wanted
        if self.outer == "current":
            row["current_command_start"] = 0.0  # filters of a velocity controller that is out of action
        self._constant(row, point, wanted)

    def _current(self, row: Rows) -> Value:
        """The current controller in its steady state; returns the current command."""
        if self._own == "current":
            fed = row["back_emf_feedforward"] * self.bias.speed_rad_s
            return self._own_start(row, self.bias.voltage_V, row["resistance_feedforward"], fed)
        steady = current_state(
            self.bias,
            row["current_gain"],
            row.value("current_integral") != 0.0,
            row["back_emf_feedforward"],
            row["resistance_feedforward"],
        )
        row["current_integrator_start"] = steady.integrator
        return steady.command

    def _velocity(self, row: Rows, wanted: Value) -> Value:
        """The velocity controller in its steady state; returns the speed command."""
        if self._own == "velocity":
            row["current_command_start"] = wanted
            return self._own_start(row, wanted)
        integral = row.value("velocity_integral") != 0.0
        steady = velocity_state(self.design, self.bias, wanted, row["velocity_gain"], integral)
        row["velocity_integrator_start"] = steady.integrator
        row["current_command_start"] = steady.output  # what the torque filters begin with
        return steady.command

    def _own_start(self, row: Rows, wanted: Value, direct: Value = 0.0, fed: Value = 0.0) -> Value:
        """A law of one's own in its steady state; returns the command of its stage."""
        commands = np.zeros(len(row))
        parts = np.broadcast_arrays(wanted, row["own_gain"], direct, fed, commands)
        for k, values in enumerate(zip(*parts[:4], strict=True)):
            start = own_start(self.design, self.bias, *map(float, values))
            row.values[k, at.OWN_START : at.OWN_START + len(start.states)] = start.states
            commands[k] = start.command
        return commands

    def _position(self, row: Rows, wanted: Value) -> None:
        """Let the command run with the drive, ahead of the motor by what the controller needs.

        The motor starts at zero: a large angle would round what its derivative is made of.
        """
        if self._own == "position":
            command = self._own_start(row, wanted) / self.design.total_ratio
            if self.bias.speed_rad_s == 0.0:
                row.step("bias", command, -1.0)
            else:
                speed = self.bias.speed_rad_s / self.design.total_ratio
                row.ramp("bias", speed, -command / speed)
            return
        ahead = (wanted - row["feedforward"] * self.bias.speed_rad_s) / row["position_gain"]
        at_output = self.design.controller.position_loop.sensor == "output"
        seen = self.design.total_ratio * self.bias.output_rad(self.design) if at_output else 0.0
        if self.bias.speed_rad_s == 0.0:
            row["angle_start"] = -ahead
            row.step("bias", seen / self.design.total_ratio, -1.0)
            return
        speed = self.bias.speed_rad_s
        row.ramp("bias", speed / self.design.total_ratio, -(ahead + seen) / speed)

    @property
    def steady_start(self) -> bool:
        """Whether the steady state is known that a run begins in; a ramp sets what a PI of position holds."""
        if self._own is not None and not _steady_law(self.design, self.bias):
            return False
        return not (self.outer == "position" and remembers(self.design) and self.bias.speed_rad_s != 0.0)

    @staticmethod
    def _constant(row: Rows, point: str, value: Value) -> None:
        """Replace the outer controllers, which are out of action, by a constant command."""
        row.step(point, value, -1.0)

    @cached_property
    def range(self) -> float:
        """What would be a large signal at the place, in its unit."""
        design, limits = self.design, self.design.limits
        full = design.validation.full_deflection_rad
        speed = min(limits.speed_rad_s, self.bias.speed_rad_s or inf)
        ranges = {"u": limits.voltage_V, "i_ref": limits.peak_current_A, "w_ref": speed, "output": full}
        if self.loop == "load":
            return full_torque_Nm(design) * design.total_ratio
        if self.loop == "command":
            outermost = design.controller.outermost
            ranges |= {"position": full, "velocity": speed / design.total_ratio}
            ranges |= {"current": limits.peak_current_A, "voltage": limits.voltage_V}
            return ranges[outermost]
        return ranges[self.point]


PATHS = ("command", "load")  # of the whole drive, to its output
GAINS = {
    "current": ("current_gain", "current_integral", "back_emf_feedforward", "resistance_feedforward"),
    "velocity": ("velocity_gain", "velocity_integral"),
    "position": ("position_gain", "position_integral", "derivative"),
}


def loop_setup(design: Design, loop: str, *, limits_on: bool = True, held: bool = False) -> LoopSetup:
    """Set a drive up for one loop, on an operating motion that the code chooses.

    A position controller with an integral or a derivative part cannot be started in the steady state of a
    ramp: then the drive stands, where it has no slope of its own about rest.

    Raises
    ------
    InputError
        If the design has no such loop or break point, or has no operating motion.
    """
    known = (*stages_of(design), *points_of(design), *PATHS)
    if loop not in known:
        raise InputError(f"loop = {loop!r}: one of {', '.join(known)}", where=design.name)
    result = LoopSetup(design, loop, operating_motion(design), limits_on, held)
    unsteady = (result.outer == "position" and remembers(design)) or not result.steady_start
    if unsteady and may_stand(design):
        return LoopSetup(design, loop, standing(design), limits_on, held)
    return result


def remembers(design: Design) -> bool:
    """Whether the position controller has a state that a ramp sets."""
    place = design.controller.position
    return place is not None and (place.integral_time_s is not None or place.derivative_time_s > 0.0)


def gains_of(design: Design, stage: str) -> tuple[str, ...]:
    """Columns of a row that are the gain of a stage."""
    own = design.controller.own_law
    return (*GAINS[stage], *(("own_gain",) if own is not None and own[0] == stage else ()))


def _steady_law(design: Design, bias: OperatingMotion) -> bool:
    """Whether a law of one's own has a steady state on an operating motion, whatever its stage gives."""
    own = design.controller.own_law
    return own is None or own_start(design, bias, 0.0, own[1].gain).steady


def stages_of(design: Design) -> tuple[str, ...]:
    """Stages of the cascade, innermost first."""
    control = design.controller
    there = {"current": control.current, "velocity": control.velocity, "position": control.position}
    return tuple(stage for stage in STAGES if there[stage] is not None)


def target(design: Design, stage: str) -> str:
    """The signal that a stage drives: ``u``, ``i_ref`` or ``w_ref``."""
    stages = stages_of(design)
    inside = stages[: stages.index(stage)]
    return {"current": "i_ref", "velocity": "w_ref"}[inside[-1]] if inside else "u"


def points_of(design: Design) -> tuple[str, ...]:
    """Break points that exist, from the motor outwards."""
    output = () if design.controller.position is None else ("output",)
    return (*(target(design, stage) for stage in stages_of(design)), *output)


def producer(design: Design, point: str) -> str:
    """The stage that updates a break point; the position stage reads the output."""
    return next((stage for stage in stages_of(design) if target(design, stage) == point), "position")


def every(design: Design, stage: str) -> int:
    """Ticks between two updates of a stage."""
    control = design.controller
    if stage == "velocity" and control.velocity is not None:
        return control.velocity.every
    return control.position_loop.every if stage == "position" else 1
