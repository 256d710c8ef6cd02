"""How the stages of a drive are wired: who drives whom, how often, and in which units."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.asked.quantities import LOOPS
from actuator_lti.drive import blocks
from actuator_lti.drive.blocks import Block
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.plant import Plant, motor_plant
from actuator_lti.drive.signals import SIGNALS
from actuator_lti.errors import InputError
from actuator_lti.systems.sampling import DelayedHold, delayed_hold

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, Filter

ERRORS = {"current": "e_i", "velocity": "e_w", "position": "e_th"}
MEASURED = {"current": "i", "velocity": "w_meas", "position": "th"}
BEHIND_FILTER = "command"  # the command of the outermost stage that runs, as it takes it
LAW_OUTPUT = "law"  # what a law of one's own gives, before feed-forward and limits
COMMANDS = {"voltage": "u", "current": "i_ref", "velocity": "w_ref", "position": "th_ref"}


def present(value: Any) -> bool:
    """Whether a coefficient (an array: of any design) is there at all."""
    return value is not None and bool(np.any(value != 0))


@dataclass(frozen=True)
class Drive:
    """A design (its numbers may be arrays, stacked over designs) at an operating point, as loops need it."""

    design: Design
    operating: Operating
    stages: tuple[str, ...]  # those present, innermost first, of "current", "velocity", "position"
    interval: dict[str, int]  # ticks between two updates of each, and of the speed measurement ("speed")
    target: dict[str, str]  # the signal that each stage drives: "u", "i_ref" or "w_ref"
    # Loops cut at a break point and their distances to the stability limit, by `actuator_lti.loops.periodic`
    blocks_at: dict[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)
    margins_at: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def plant(self) -> Plant:
        return motor_plant(self.design, self.operating)

    @cached_property
    def hold(self) -> DelayedHold:
        """The sampled plant; the angle is an exact integrator. Second inputs: motor and load torque."""
        plant, control = self.plant, self.design.controller
        B = np.stack(np.broadcast_arrays(plant.B_T, plant.B_M), axis=-1)
        hold = delayed_hold(plant.A, plant.B_u[..., None], B, control.period_s, control.computing_delay_s)
        if "th" in plant.states and not self.operating.torques_at_once:
            hold.Phi[..., :, plant.states.index("th")] = np.eye(len(plant.states))[plant.states.index("th")]
        return hold

    @property
    def tick_s(self) -> Any:
        return self.design.controller.period_s

    @property
    def ratio(self) -> Any:
        return self.design.total_ratio

    def has_own_law(self, stage: str) -> bool:
        """Whether a stage has a law of one's own, so that its loop is cut at what that gives."""
        own = self.design.controller.own_law
        return own is not None and own[0] == stage and stage in self.stages

    def responds_apart(self, stage: str) -> bool:
        """Whether L/(1 + L) need not be how an inner stage answers its command: its law may take more."""
        return stage != "position" and self.has_own_law(stage)

    def around(self, place: str) -> tuple[str, str]:
        """Signals behind and in front of where the loop of a stage, or at a break point, is broken."""
        if place in self.stages and not self.has_own_law(place):
            return ERRORS[place], MEASURED[place]
        point = self.target.get(place, place)
        return point, f"{point}_returned"

    def cut_of(self, place: str) -> tuple[str, str, Any]:
        """Where the loop of a stage, or at a break point, is cut, what comes back there, and its factor.

        With a law of one's own it is cut at what the law gives, whatever it takes: what feed-forward adds to
        that stays closed, as with gains.
        """
        if self.has_own_law(place):
            return LAW_OUTPUT, LAW_OUTPUT, -1.0
        if place not in self.stages:
            return place, place, -1.0
        if place == "position":
            return ERRORS[place], "output", self.ratio
        return ERRORS[place], MEASURED[place], 1.0

    def command_of(self, stage: str) -> tuple[str, str, float]:
        """The same of how an inner stage answers its command, behind the filter that this may have."""
        return BEHIND_FILTER, MEASURED[stage], 1.0

    def period_s(self, stage: str) -> Any:
        return self.interval[stage] * self.tick_s

    @property
    def outermost(self) -> str:
        return self.stages[-1] if self.stages else "voltage"

    def law(self, stage: str) -> Block:
        """The PI of a stage in its own period (of the position loop without its derivative part)."""
        loop: Any = getattr(self.design.controller, stage)
        gain = loop.gain_V_A if stage == "current" else loop.gain
        return blocks.pi(gain, loop.integral_time_s, self.period_s(stage))

    def filters(self, place: str) -> tuple[Filter, ...]:
        """Filters of the velocity loop on ``"speed"`` or ``"torque"``, in order."""
        velocity: Any = self.design.controller.velocity
        return () if velocity is None else velocity.filters_on(place)

    @property
    def command_filter(self) -> Block | None:
        """The filter of the command at the period of the outermost stage, in Tustin's form."""
        command = self.design.command
        if not present(command.filter_time_s):
            return None
        T = self.period_s(self.outermost) if self.stages else self.tick_s
        return blocks.biquad(command.lowpass(T, self.design.name), T)

    def producer(self, signal: str) -> str:
        """The stage that updates a break point (``"output"`` is read by the position stage)."""
        return next((stage for stage, target in self.target.items() if target == signal), "position")

    @property
    def points(self) -> tuple[str, ...]:
        return (*(self.target[stage] for stage in self.stages), *["output"] * ("position" in self.stages))

    def inside(self, stage: str) -> tuple[str, ...]:
        return self.stages[: self.stages.index(stage)]

    def unit(self, signal: str) -> str:
        """Unit of a signal (motor side, except ``"output"``), for a rotary or a linear axis."""
        return SIGNALS[signal].unit_for(self.design.axis)

    def later(self, delay_s: float) -> Drive:
        control = self.design.controller
        slower = replace(control, computing_delay_s=control.computing_delay_s + delay_s)
        return replace(self, design=replace(self.design, controller=slower))


def wire(design: Design, operating: Operating | None = None) -> Drive:
    """Wire a design up at an operating point; with the rotor locked only the current loop remains.

    Raises `InputError`: for stages that do not fit, or an operating point that the design does not have.
    """
    at = (operating or Operating()).checked(design)
    control = design.controller
    if control.current is not None and not design.motor.has_electrical_dynamics:
        raise InputError("control.current: an ideal torque source has no current to control")
    kept = control.stages if at.rotor == "free" else tuple(s for s in control.stages if s == "current")
    stages = tuple(str(stage) for stage in reversed(kept))
    target = {stage: COMMANDS[inner] for inner, stage in pairwise(("voltage", *stages))}
    every = {stage: getattr(getattr(control, stage), "every", 1) for stage in LOOPS}
    if every["position"] % every["velocity"] and "position" in stages:
        raise InputError(f"control.position.every = {every['position']}: a multiple of {every['velocity']}")
    interval = {stage: every[stage] for stage in stages} | {"speed": every["velocity"]}
    return Drive(design, at, stages, interval, target)
