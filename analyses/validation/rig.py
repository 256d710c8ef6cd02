"""One loop of a drive on the bench: which loops run, where the instrument sits, and the state it starts in.

The loop definition of model.md section 3 (inner loops closed, outer ones open) is made as a drive does it:
for the velocity loop the position controller is out of action and the speed command is a constant (speed
mode); for the current loop the current command is (torque mode).  For a break point all loops run.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.validation.riding import Ride, ride
from nonlinear._kernels import layout as at
from nonlinear.batch import injection_place, probe_place
from nonlinear.parameters import design_row
from nonlinear.probe import Probe, write_probe

Floats = npt.NDArray[np.float64]
STAGES = ("current", "velocity", "position")


@dataclass(frozen=True)
class Rig:
    """A drive set up to test one loop.

    Attributes
    ----------
    design : Design
    loop : str
        ``"current"``, ``"velocity"``, ``"position"`` (outer loops open), or a break point ``"u"``,
        ``"i_ref"``, ``"w_ref"``, ``"output"`` (all other loops closed).
    ride : Ride
        The motion underneath.
    limits_on : bool
    """

    design: Design
    loop: str
    ride: Ride
    limits_on: bool = True

    @cached_property
    def stages(self) -> tuple[str, ...]:
        """Stages that the design has, innermost first."""
        return stages_of(self.design)

    @cached_property
    def outer(self) -> str:
        """Outermost stage that runs."""
        return self.loop if self.loop in STAGES else "position"

    @cached_property
    def point(self) -> str:
        """Where the instrument sits."""
        return target(self.design, self.loop) if self.loop in STAGES else self.loop

    @property
    def before(self) -> str:
        """Name of the signal in front of the instrument."""
        return f"probe_{self.point}_before"

    @property
    def after(self) -> str:
        """Name of the signal behind the instrument."""
        return f"probe_{self.point}_after"

    @cached_property
    def hold_ticks(self) -> int:
        """Ticks between two updates at the point."""
        return every(self.design, producer(self.design, self.point))

    @cached_property
    def base_ticks(self) -> int:
        """Ticks after which everything repeats."""
        return max(every(self.design, stage) for stage in self._running)

    @property
    def period_s(self) -> float:
        """Sampling period of the loop at the point."""
        return self.hold_ticks * self.design.controller.period_s

    @property
    def _running(self) -> tuple[str, ...]:
        return self.stages[: self.stages.index(self.outer) + 1]

    def row(self, *, gain: float = 1.0, delay_samples: float = 0.0) -> Floats:
        """Parameters of a run that starts in the steady state of the ride.

        Parameters
        ----------
        gain : float
            Factor on the controller in front of the point, proportional and integral part: the loop gain.
        delay_samples : float
            Extra delay at the point, in its own samples.
        """
        row = self._base.copy()
        write_probe(Probe(point=self.point, delay_samples=delay_samples), row)  # type: ignore[arg-type]
        for place in GAINS[producer(self.design, self.point)]:
            row[place] *= gain
        self._start(row)
        return row

    @cached_property
    def _base(self) -> Floats:
        """The row without instrument and state."""
        row = design_row(self.design, friction_on=self.ride.friction_on, limits_on=self.limits_on)
        if self.design.load.path == "back-drivable":
            row[at.LOAD_SLOPE] = self.design.load.moment_slope_Nm_rad
        row[at.FEEDFORWARD] = 0.0
        if self.outer != "position":
            row[at.POSITION_GAIN] = 0.0
        if self.outer == "current":
            row[at.VELOCITY_GAIN] = row[at.VELOCITY_INTEGRAL] = 0.0
        return row

    def _start(self, row: Floats) -> None:
        """Write the steady state, from the motor outwards."""
        row[at.SPEED_START], row[at.CURRENT_START] = self.ride.speed_rad_s, self.ride.current_A
        wanted, point = self.ride.voltage_V, "u"
        row[at.VOLTAGE_START] = wanted
        for stage in self._running:
            if stage == "position":
                row[at.ANGLE_START] = -wanted / row[at.POSITION_GAIN]
                if point == "w_ref":
                    row[at.SPEED_COMMAND_START] = wanted
                self._command(row)
                return
            integral, step, kp = INTEGRALS[stage]
            base = self.ride.current_A if stage == "current" else self.ride.speed_rad_s
            if row[step] != 0.0:
                row[integral], wanted = wanted, base
            else:
                wanted = base + wanted / row[kp]
            point = "i_ref" if stage == "current" else "w_ref"
            if point == "i_ref":
                row[at.CURRENT_COMMAND_START] = wanted
        self._constant(row, point, wanted)

    def _command(self, row: Floats) -> None:
        """Let the command run with the motor."""
        row[at.BIAS] = at.RAMP
        row[at.BIAS + 1] = self.ride.speed_rad_s / self.design.total_ratio
        row[at.BIAS + 2], row[at.BIAS + 3] = 0.0, inf

    @staticmethod
    def _constant(row: Floats, point: str, value: float) -> None:
        """Replace the outer controllers, which are out of action, by a constant command."""
        row[probe_place(point) + at.PROBE_ON] = 1.0
        place = injection_place(point)
        row[place], row[place + 1], row[place + 2] = at.STEP, value, -1.0

    @cached_property
    def room(self) -> dict[str, float]:
        """How far each signal may move from its steady value: to its limit, and the speed to zero."""
        row, limits = self.row(), self.design.limits
        moving = abs(self.ride.speed_rad_s)
        room = {"motor_speed_rad_s": 0.7 * moving if moving else inf}
        room["voltage_V"] = limits.voltage_V - abs(row[at.VOLTAGE_START])
        room["current_command_A"] = limits.peak_current_A - abs(row[at.CURRENT_COMMAND_START])
        room["speed_command_rad_s"] = limits.speed_rad_s - abs(self.ride.speed_rad_s)
        if not self.limits_on:
            room = {name: value if name == "motor_speed_rad_s" else inf for name, value in room.items()}
        return room


INTEGRALS = {
    "current": (at.CURRENT_INTEGRATOR_START, at.CURRENT_INTEGRAL, at.CURRENT_GAIN),
    "velocity": (at.VELOCITY_INTEGRATOR_START, at.VELOCITY_INTEGRAL, at.VELOCITY_GAIN),
}

GAINS = {
    "current": (at.CURRENT_GAIN, at.CURRENT_INTEGRAL),
    "velocity": (at.VELOCITY_GAIN, at.VELOCITY_INTEGRAL),
    "position": (at.POSITION_GAIN,),
}


def rig(design: Design, loop: str, *, limits_on: bool = True) -> Rig:
    """Set a drive up for one loop, riding on a constant speed that the code chooses.

    Raises
    ------
    InputError
        If the design has no such loop or break point, or cannot ride.
    """
    known = (*stages_of(design), *points_of(design))
    if loop not in known:
        raise InputError(f"loop = {loop!r}: one of {', '.join(known)}", where=design.name)
    return Rig(design, loop, ride(design), limits_on)


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
    return (*(target(design, stage) for stage in stages_of(design)), "output")


def producer(design: Design, point: str) -> str:
    """The stage that updates a break point; the position stage reads the output."""
    return next((stage for stage in stages_of(design) if target(design, stage) == point), "position")


def every(design: Design, stage: str) -> int:
    """Ticks between two updates of a stage."""
    control = design.controller
    if stage == "velocity" and control.velocity is not None:
        return control.velocity.every
    return control.position_loop.every if stage == "position" else 1
