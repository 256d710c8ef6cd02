"""How the stages of a cascade are wired: who drives whom, how often, and in which units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from actuator_lti.controllers import PI
from actuator_lti.errors import InputError
from actuator_lti.plant import Plant, RotorState, friction_slope, motor_plant

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from actuator_lti.plant import OperatingPoint

ERRORS = {"current": "e_i", "velocity": "e_w", "position": "e_th"}
MEASURED = {"current": "i", "velocity": "w_meas", "position": "th"}


@dataclass(frozen=True)
class Cascade:
    """A design at an operating point, as the loop builders need it.

    Attributes
    ----------
    stages : tuple of str
        The stages present, innermost first, of ``"current"``, ``"velocity"``, ``"position"``.
    interval : dict
        Ticks between two updates of each stage.
    target : dict
        The signal that each stage drives: ``"u"``, ``"i_ref"`` or ``"w_ref"``.
    """

    design: Design
    plant: Plant
    stages: tuple[str, ...]
    interval: dict[str, int]
    target: dict[str, str]

    @property
    def tick_s(self) -> float:
        """Base period Ts."""
        return self.design.controller.period_s

    @property
    def ratio(self) -> float:
        """N, motor angle over output angle."""
        return self.design.total_ratio

    def period_s(self, stage: str) -> float:
        """Period T of a stage in s."""
        return self.interval[stage] * self.tick_s

    def pi(self, stage: str) -> PI:
        """The controller of a stage in its own period."""
        control = self.design.controller
        if stage == "current" and control.current is not None:
            return PI(control.current.gain_V_A, control.current.integral_time_s, self.period_s(stage))
        if stage == "velocity" and control.velocity is not None:
            return PI(control.velocity.gain, control.velocity.integral_time_s, self.period_s(stage))
        return PI(control.position_loop.gain, None, self.period_s(stage))

    def producer(self, signal: str) -> str:
        """The stage that updates a break point (``"output"`` is read by the position stage)."""
        for stage, target in self.target.items():
            if target == signal:
                return stage
        return "position"

    @property
    def points(self) -> tuple[str, ...]:
        """The break points that exist, from the motor outwards."""
        return (
            *(self.target[stage] for stage in self.stages),
            *(("output",) if "position" in self.stages else ()),
        )

    def inside(self, stage: str) -> tuple[str, ...]:
        """The stages inside a stage."""
        return self.stages[: self.stages.index(stage)]

    def unit(self, signal: str) -> str:
        """Unit of a signal (motor side, except ``"output"``), for a rotary or a linear axis."""
        angle, speed = ("rad", "rad/s") if self.design.axis == "rotary" else ("m", "m/s")
        table = {"u": "V", "i_ref": "A", "e_i": "A", "i": "A", "w_ref": speed, "w_cmd": speed, "e_w": speed}
        table |= {"w": speed, "w_meas": speed, "e_th": angle, "th": angle, "output": angle, "th_ref": angle}
        return table[signal]


def cascade(
    design: Design,
    operating_point: OperatingPoint = "sliding",
    load_Nm: float = 0.0,
    speed_amplitude_rad_s: float | None = None,
    direction: int = 1,
    rotor: RotorState = "free",
) -> Cascade:
    """Wire a design up at an operating point; with the rotor locked only the current loop remains."""
    if rotor not in ("free", "locked"):
        raise InputError(f"rotor = {rotor!r}: free or locked")
    slope = friction_slope(design, operating_point, load_Nm, speed_amplitude_rad_s, direction)
    plant = motor_plant(design, slope, rotor)
    control = design.controller
    if control.current is not None and not design.motor.has_electrical_dynamics:
        raise InputError("control.current: an ideal torque source has no current to control")
    present = {
        "current": control.current is not None,
        "velocity": control.velocity is not None,
        "position": True,
    }
    if rotor == "locked":
        present |= {"velocity": False, "position": False}
    stages = tuple(name for name, there in present.items() if there)
    signals = {"current": "i_ref", "velocity": "w_ref"}
    target, inner = {}, "u"
    for stage in stages:
        target[stage] = inner
        inner = signals.get(stage, "")
    every = {"current": 1, "velocity": control.velocity.every if control.velocity else 1}
    every["position"] = control.position_loop.every
    if every["position"] % every["velocity"]:
        raise InputError(f"control.position.every = {every['position']}: a multiple of {every['velocity']}")
    return Cascade(design, plant, stages, {stage: every[stage] for stage in stages}, target)
