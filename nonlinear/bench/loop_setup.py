"""One loop of a drive on the bench: which loops run, where the instrument sits, and the state it starts in.

The loop definition of model.md section 3 (inner loops closed, outer ones open) is made as a drive does it:
for the velocity loop the position controller is out of action and the speed command is a constant (speed
mode); for the current loop the current command is (torque mode).  The rotor may then be held at its speed, as
a bench does it: a free one runs away under a constant torque, and what is measured is the back-EMF.  For a
break point all loops run.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf, lcm

from actuator_lti.design.control import FEED_FORWARD
from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.drive.facts import stall_torque_Nm
from actuator_lti.drive.wiring import Drive, wire
from actuator_lti.errors import InputError
from nonlinear._kernels import layout as at
from nonlinear.bench import operating_motion as motion
from nonlinear.bench.operating_motion import OperatingMotion
from nonlinear.bench.probe import Probe
from nonlinear.bench.steady_control import own_start, steady_state
from nonlinear.rows import Rows

STAGES = ("current", "velocity", "position")
HELD = 1e200  # so many times its inertia holds the rotor at its speed: what then moves it is `NOTHING`


@dataclass(frozen=True)
class LoopSetup:
    """A drive set up to test one loop."""

    design: Design
    # "current", "velocity", "position": outer loops open; a break point "u", "i_ref", "w_ref", "output": all
    # other loops closed; or one of `PATHS`
    loop: str
    bias: OperatingMotion  # the motion underneath
    limits_on: bool = True
    held: bool = False  # whether the rotor is held at its speed

    @cached_property
    def wired(self) -> Drive:
        """The drive's stages, innermost first, what each drives and how often."""
        return wire(self.design)

    @cached_property
    def outer(self) -> str:
        return self.loop if self.loop in STAGES or not self.wired.stages else self.wired.stages[-1]

    @cached_property
    def point(self) -> str:
        point = self.outer if self.loop in PATHS else self.loop
        return self.wired.target.get(point, "u" if self.loop in PATHS else self.loop)

    @cached_property
    def hold_ticks(self) -> int:
        """Ticks between two updates at the point."""
        return self.every(self.wired.producer(self.point))

    def every(self, stage: str) -> int:
        """Ticks between two updates of a stage, 1 where there is none."""
        return self.wired.interval.get(stage, 1)

    @cached_property
    def base_ticks(self) -> int:
        """Ticks after which everything repeats."""
        current, own = self.design.controller.current, self.design.controller.own_law
        fed = current is not None and current.back_emf_feedforward != 0.0
        taken = fed or (own is not None and self._own is not None and "speed" in own[1].inputs)
        measured = taken and not self.held and "velocity" in self.wired.stages
        return lcm(*map(self.every, (*self._running, *(["velocity"] if measured else []))))

    @property
    def period_s(self) -> float:
        """Sampling period of the loop at the point."""
        return self.hold_ticks * self.design.controller.period_s

    @property
    def _running(self) -> tuple[str, ...]:
        stages = self.wired.stages
        return stages[: stages.index(self.outer) + 1] if stages else ()

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

    def rows(self, gain: float = 1.0, delay_samples: float = 0.0) -> Rows:
        """Parameters of a run that starts in the steady state of the operating motion.

        ``gain`` is a factor on the whole controller in front of the point, whose state is that of a factor of
        1; a delay is in the point's samples.
        """
        row = self._base.copy()
        row.probe(Probe(point=self.point, delay_samples=delay_samples))  # type: ignore[arg-type]
        self._start(row)
        stage, own = self.wired.producer(self.point), self.design.controller.own_law
        for place in (*GAINS[stage], *(["own_gain"] if own is not None and own[0] == stage else [])):
            row[place] *= gain
        return row

    @cached_property
    def _base(self) -> Rows:
        """The row without instrument and state."""
        row = Rows.of(self.design, friction_on=self.bias.friction_on, limits_on=self.limits_on)
        dropped = ["friction_feedforward"] if self.loop in PATHS else [*FEED_FORWARD]
        if self.outer != "position":
            dropped += GAINS["position"]
        if self.outer == "current":
            dropped += GAINS["velocity"]
        if self._own is None:
            dropped.append("own_stage")
        for name in dropped:
            row[name] = 0.0
        if self.held:
            for name in ("inertia", "motor_inertia"):
                row[name] *= HELD
        return row

    @cached_property
    def wanted(self) -> float:
        """What the position controller gives on the motion; 0 where it does not run."""
        return self._start(self._base.copy())

    def _start(self, row: Rows) -> float:
        """Write the steady state, from the motor outwards; a constant replaces controllers out of action."""
        bias, point = self.bias, "u"
        bias.load(row)
        row["speed_start"], row["current_start"] = bias.speed_rad_s, bias.current_A
        row["twist_start"] = bias.twist_rad
        row["load_speed_start"] = bias.speed_rad_s / self.design.ratio_to_coupling
        row["voltage_start"] = wanted = bias.voltage_V
        for stage in self._running:
            if stage == "position":
                if point == "w_ref":
                    row["speed_command_start"] = wanted
                self._position(row, wanted)
                return wanted
            if stage == self._own:
                command, output = self._own_start(row, wanted), wanted
            else:
                steady = steady_state(self.design, bias, stage, wanted)
                row[f"{stage}_integrator_start"] = steady.integrator
                command, output = steady.command, steady.output
            # the current's own, or what the torque filters begin with
            row["current_command_start"] = command if stage == "current" else output
            wanted, point = command, "i_ref" if stage == "current" else "w_ref"
        if self.outer == "current":
            row["current_command_start"] = 0.0  # filters of a velocity controller that is out of action
        row.step(point, wanted, -1.0)
        return 0.0

    def _own_start(self, row: Rows, wanted: float) -> float:
        """A law of one's own in its steady state; returns the command of its stage."""
        start = own_start(self.design, self.bias, wanted)
        row.values[0, at.OWN_START : at.OWN_START + len(start.states)] = start.states
        return start.command

    def _position(self, row: Rows, wanted: float) -> None:
        """Let the command run with the drive, ahead of the motor by what the controller needs."""
        # the motor starts at zero: a large angle would round what its derivative is made of
        N, speed = self.design.total_ratio, self.bias.speed_rad_s
        if self._own == "position":
            command = self._own_start(row, wanted) / N
            if speed == 0.0:
                row.step("bias", command, -1.0)
            else:
                row.ramp("bias", speed / N, command)
            return
        place = self.design.controller.position_loop
        holds = speed == 0.0 and place.integral_time_s is not None  # an integral needs no error
        ahead = (wanted - row.value("feedforward") * speed) / row.value("position_gain") * (not holds)
        at_output = place.sensor == "output"
        seen = N * self.bias.output_rad(self.design) if at_output else 0.0
        if speed == 0.0:
            row.step("bias", (ahead + seen) / N, -1.0)
        else:
            row.ramp("bias", speed / N, (ahead + seen) / N)

    @property
    def steady_start(self) -> bool:
        """Whether a run begins in its steady state: no row has what a position controller remembers."""
        if self._own is not None and not own_start(self.design, self.bias, 0.0).steady:
            return False
        moved = self.bias.speed_rad_s != 0.0 or self.wanted != 0.0
        return not (self.outer == "position" and remembers(self.design) and moved)

    @cached_property
    def range(self) -> float:
        """What would be a large signal at the place, in its unit."""
        design, limits = self.design, self.design.limits
        full = design.validation.full_deflection_rad
        speed = min(reachable_speed(design), self.bias.speed_rad_s or inf)
        ranges = {"u": limits.voltage_V, "i_ref": limits.peak_current_A, "w_ref": speed, "output": full}
        if self.loop == "load":
            return stall_torque_Nm(design) * design.total_ratio
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

    Raises `InputError`: if the design has no such loop or break point, or has no operating motion.
    """
    wired = wire(design)
    known = (*wired.stages, *wired.points, *PATHS)
    if loop not in known:
        raise InputError(f"loop = {loop!r}: one of {', '.join(known)}", where=design.name)
    result = LoopSetup(design, loop, motion.operating_motion(design), limits_on, held)
    unsteady = (result.outer == "position" and remembers(design)) or not result.steady_start
    if unsteady and motion.may_stand(design):
        return LoopSetup(design, loop, motion.standing(design), limits_on, held)
    return result


def remembers(design: Design) -> bool:
    """Whether the position controller has a state that a ramp sets."""
    place = design.controller.position
    return place is not None and (place.integral_time_s is not None or place.derivative_time_s > 0.0)
