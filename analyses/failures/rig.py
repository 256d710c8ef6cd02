"""Controller and plant of one drive as two, so that what passes between them, and either of them, can fail.

The controller is the drive's own on measured values; the plant is the same drive without its loops, a voltage
in.  Nothing failed, the two together are the drive (`nonlinear.simulate`) bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from actuator_lti.design.model import Command, Design, Instruments
from actuator_lti.drive.steady import motor_torque_Nm
from nonlinear import Drive, State


@dataclass
class Measured:
    """What the controller gets at t_k: motor side, and output shaft."""

    current_A: float
    speed_rad_s: float
    angle_rad: float
    output_angle_rad: float
    output_speed_rad_s: float


Sensing = Callable[[Measured], Measured]
Driving = Callable[[float, float], float]


def plant_of(design: Design) -> Design:
    """The drive without its loops and command shaping; its instruments stay with the controller."""
    bare = replace(design.controller, position=None, velocity=None, current=None)
    limits = replace(design.limits, peak_time_s=None)  # the overload protection is the controller's
    return replace(design, controller=bare, limits=limits, command=Command(), instruments=Instruments())


class Rig:
    """The two halves; ``sensing`` changes what the controller gets, ``driving`` the voltage by (u, U_bus)."""

    def __init__(self, design: Design, load_Nm: float) -> None:
        self.design, self.load_Nm = design, load_Nm
        self.controller, self.plant = Drive(design), Drive(plant_of(design), load_Nm=load_Nm)
        self.sensing: Sensing | None = None
        self.driving: Driving | None = None
        self.moment_Nm = 0.0

    def copy(self) -> Rig:
        """Another rig in the same state, nothing failed."""
        twin = Rig(self.design, self.load_Nm)
        twin.controller.set(self.controller.get())
        twin.plant.set(self.plant.get())
        return twin

    def measured(self) -> Measured:
        """The truth about the plant at t_k."""
        plant, N = self.plant, self.design.total_ratio
        w, th = plant.value("speed"), plant.value("angle")
        elastic = self.design.coupling is not None
        y = plant.value("output") if elastic else th / N
        Y = plant.value("output_speed") if elastic else w / N
        return Measured(plant.value("current"), w, th, y, Y)

    def fail(self, broken: Design) -> None:
        """Go on with another plant from the same angles, speeds, current and voltage."""
        true, u = self.measured(), self.plant.value("voltage")
        elastic = self.design.coupling is not None
        state = State(
            motor_angle_rad=true.angle_rad,
            motor_speed_rad_s=true.speed_rad_s,
            current_A=true.current_A,
            voltage_V=u,
            output_angle_rad=true.output_angle_rad if elastic else None,
            output_speed_rad_s=true.output_speed_rad_s if elastic else None,
        )
        self.plant = Drive(plant_of(broken), state, self.load_Nm)

    def step(self, command: float) -> Measured:
        """One tick; returns the truth at its start, `moment_Nm` what the train carried then."""
        true = self.measured()
        seen = true if self.sensing is None else self.sensing(true)
        bus = self.plant.value("voltage_limit")
        u = self.controller.control(
            command, seen.current_A, seen.speed_rad_s, seen.angle_rad,
            seen.output_angle_rad, bus, seen.output_speed_rad_s,
        )  # fmt: skip
        if self.driving is not None:
            u = self.driving(u, bus)
        self.plant.step(u)
        self.moment_Nm = self._moment(true.current_A, u)
        return true

    def _moment(self, current_A: float, voltage_V: float) -> float:
        """In the coupling, at the output; rigid: the motor's torque times the reduction."""
        if self.design.coupling is not None:
            return self.plant.noted("coupling_torque") * self.design.ratio_behind_coupling
        return float(motor_torque_Nm(self.design, current_A, voltage_V)) * self.design.total_ratio
