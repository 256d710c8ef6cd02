"""Roll control of a canard rocket in RocketPy: ideal actuator, lag with rate limit, and the real drive.

The rocket rolls because its fins are canted a little.  An autopilot at 500 Hz holds the roll angle by its
canards: state feedback on roll angle, its integral and roll rate, scheduled with dynamic pressure.  The
canards move as

- the command says (ideal),
- a first-order lag says, with the bandwidth of the drive's position loop (`margins`) and its speed limit,
- the exported C of the drive says, tick by tick, under the hinge moment of the canards.

The drive steps inside the flight step: RocketPy stops at every tick, the canards are held over it at the
angle that they have at its beginning, and the tick takes the command and the hinge moment of that instant.

The lag has the drive's bandwidth and its fastest rate, and the flight with it looks like that with an ideal
actuator.  It knows neither dry friction nor play: with the real drive the roll never comes to rest, it hunts
between sticking and slipping and through the play of the gears.  The same drive without the two of them
hunts no more.

    python -m examples.canard_roll [FIGURE.svg]

RocketPy 1.13 gives fins a fixed cant angle; the autopilot sets the deflection in the coefficients that its
fin set keeps (``roll_parameters``).  Needs ``pip install 'actuator-lti[examples]'``.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti import assemble_loops, load_design
from actuator_lti.bandwidth import closed_loop_bandwidth
from actuator_lti.design.model import Design
from examples.exported_drive import ExportedDrive
from reports.charts.chart import Chart
from reports.charts.svg import paper_svg

DESIGN, TICKS = "fin", 10  # of the drive in a sample of the autopilot
RATE_HZ = 500.0  # of the autopilot
FREQUENCY_RAD_S, DAMPING, INTEGRAL_1_S = 70.0, 0.8, 6.0  # of the roll loop with an ideal actuator
LARGEST_RAD = np.radians(6.0)  # of the canards
FIN_CANT_DEG = 0.02  # what makes it roll
HINGE_NM_RAD_PA = 30.0 / 45e3  # the hinge moment of the design, at the highest dynamic pressure
ROLL_INERTIA_KGM2 = 0.06
CONTROL_FROM_S, SETTLED_S = 0.5, 1.5  # the canards are held at zero before

Actuator = Callable[[float, float], float]  # command and hinge moment over a tick -> angle at its end


def ideal(_design: Design) -> Actuator:
    """The angle is the command."""
    return lambda command, _moment: command


def lag(design: Design) -> Actuator:
    """First order with the bandwidth of the position loop, its rate limited to the drive's speed limit."""
    loops = assemble_loops(design)
    assert loops.reference_to_output is not None
    pole = closed_loop_bandwidth(loops.reference_to_output).minus3db_rad_s
    assert pole is not None
    fastest = design.limits.speed_rad_s / design.total_ratio
    dt, angle = design.controller.period_s, 0.0

    def advance(command: float, _moment: float) -> float:
        nonlocal angle
        step = (command - angle) * (1.0 - np.exp(-pole * dt))
        angle += float(np.clip(step, -fastest * dt, fastest * dt))
        return angle

    return advance


def real(design: Design, folder: Path) -> Actuator:
    """The exported C, at its own tick."""
    return ExportedDrive(design, folder).step


@dataclass(frozen=True)
class RollFlight:
    """One flight at the ticks of the drive, shape (n,) each."""

    time_s: np.ndarray
    roll_rad: np.ndarray
    rate_rad_s: np.ndarray
    command_rad: np.ndarray
    canard_rad: np.ndarray

    def after(self, time_s: float) -> RollFlight:
        """The part from a time on."""
        keep = self.time_s >= time_s
        return RollFlight(*(value[keep] for value in vars(self).values()))

    @property
    def reversals(self) -> int:
        """How often the canards change direction by more than a hundredth of a degree."""
        turns = np.diff(self.canard_rad)
        turns = turns[np.abs(turns) > np.radians(0.01)]
        return int(np.count_nonzero(np.diff(np.sign(turns))))


class Autopilot:
    """State feedback on roll angle, its integral and roll rate; keeps what it has seen."""

    def __init__(self, canards: Any, actuator: Actuator) -> None:
        self.canards, self.actuator = canards, actuator
        self.roll, self.integral, self.angle, self.command = 0.0, 0.0, 0.0, 0.0
        self.rows: list[tuple[float, ...]] = []

    def __call__(self, time, _rate, state, _history, _seen, _objects, _sensors, environment):  # type: ignore[no-untyped-def]
        """What RocketPy calls at every tick: the canards are where the last one has brought them."""
        speed, rate = float(np.linalg.norm(state[3:6])), float(state[12])
        pressure = 0.5 * float(environment.density(state[2])) * speed**2
        if len(self.rows) % TICKS == 0:
            self.roll += rate / RATE_HZ
            if time >= CONTROL_FROM_S:
                self.command = self._command(
                    rate, pressure, speed / float(environment.speed_of_sound(state[2]))
                )
        self.rows.append((time, self.roll, rate, self.command, self.angle))
        self.canards.roll_parameters[2] = self.angle
        self.angle = self.actuator(self.command, -HINGE_NM_RAD_PA * pressure * self.angle)

    def _command(self, rate: float, pressure: float, mach: float) -> float:
        surface = self.canards
        slope = surface.roll_parameters[0].get_value_opt(mach)
        slope *= surface.reference_area * surface.reference_length
        authority = pressure * slope / ROLL_INERTIA_KGM2  # rad/s2 per rad
        w = FREQUENCY_RAD_S
        wanted = w * w * (self.roll + INTEGRAL_1_S * self.integral) + 2.0 * DAMPING * w * rate
        command = -wanted / authority
        if abs(command) < LARGEST_RAD:
            self.integral += self.roll / RATE_HZ
        return float(np.clip(command, -LARGEST_RAD, LARGEST_RAD))


def fly(actuator: Actuator, until_s: float = 4.0) -> RollFlight:
    """Fly the rocket with an actuator."""
    from rocketpy import Environment, Flight, GenericMotor, Rocket
    from rocketpy.control.controller import _Controller

    motor = GenericMotor(
        thrust_source=[[0.0, 2500.0], [2.5, 2500.0], [2.6, 0.0]], burn_time=2.6, chamber_radius=0.06,
        chamber_height=0.8, chamber_position=0.4, propellant_initial_mass=3.2, nozzle_radius=0.04,
        dry_mass=2.0, dry_inertia=(0.2, 0.2, 0.004),
    )  # fmt: skip
    rocket = Rocket(
        radius=0.075, mass=16.0, inertia=(6.0, 6.0, ROLL_INERTIA_KGM2 - 0.004), power_off_drag=0.4,
        power_on_drag=0.4, center_of_mass_without_motor=0.0,
    )  # fmt: skip
    rocket.add_motor(motor, position=-1.3)
    rocket.add_nose(length=0.5, kind="von karman", position=1.3)
    rocket.add_trapezoidal_fins(
        4, root_chord=0.2, tip_chord=0.1, span=0.14, position=-1.05, cant_angle=FIN_CANT_DEG
    )
    canards = rocket.add_trapezoidal_fins(4, root_chord=0.06, tip_chord=0.04, span=0.06, position=0.85)
    autopilot = Autopilot(canards, actuator)
    # the public way to a controller is air brakes; this is what they use
    rocket._add_controllers(
        _Controller(
            interactive_objects=[canards], controller_function=autopilot, sampling_rate=TICKS * RATE_HZ
        )
    )
    Flight(
        rocket=rocket, environment=Environment(latitude=0.0, longitude=0.0), rail_length=6.0,
        inclination=88.0, heading=0.0, max_time=until_s, terminate_on_apogee=True, time_overshoot=False,
    )  # fmt: skip
    return RollFlight(*np.array(autopilot.rows).T)


def drive_design() -> Design:
    """The drive of the canards, its hinge moment left to the flight."""
    design = load_design(DESIGN)
    return replace(design, load=design.load.bare())


def smooth_design() -> Design:
    """The same without play and without dry friction on either side of it."""
    design = drive_design()
    assert design.coupling is not None
    assert design.load.friction is not None
    return replace(
        design,
        coupling=replace(design.coupling, play_rad=0.0),
        friction=replace(design.friction, dry_torque_Nm=0.0, load_coefficient=0.0),
        load=replace(design.load, friction=replace(design.load.friction, dry_torque_Nm=0.0)),
    )


def flights(folder: Path, until_s: float = 3.0) -> dict[str, RollFlight]:
    """The same flight with each actuator, by its name."""
    design = drive_design()
    actuators = {
        "ideal": ideal(design),
        "lag with rate limit": lag(design),
        "real drive": real(design, folder),
        "real drive, neither friction nor play": real(smooth_design(), folder),
    }
    return {name: fly(actuator, until_s) for name, actuator in actuators.items()}


def main() -> None:
    """Print what each actuator makes of the flight; write the figure where a name is given."""
    with tempfile.TemporaryDirectory() as folder:
        found = flights(Path(folder))
    for name, flight in found.items():
        late = flight.after(SETTLED_S)
        given_way = np.degrees(np.abs(np.mean(late.canard_rad - late.command_rad)))
        sys.stdout.write(
            f"{name}: roll rate {np.degrees(np.std(late.rate_rad_s)):.3f} deg/s rms from {SETTLED_S:g} s on, "
            f"{late.reversals} reversals of the canards, {given_way:.3f} deg between command and canard\n"
        )
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(figure(found), encoding="utf-8")


def figure(found: dict[str, RollFlight]) -> str:
    """Roll rate and canard angle of all flights, as SVG."""
    chart = Chart(title="What a lag with a rate limit misses", width=900.0)
    rate, canard = chart.panel(), chart.panel()
    rate.x.label = canard.x.label = "time, s"
    rate.y.label, canard.y.label = "roll rate, deg/s", "canard angle, deg"
    for (name, flight), colour in zip(found.items(), ("c1", "c2", "c3", "c4"), strict=True):
        late = flight.after(SETTLED_S)
        rate.curve(late.time_s, np.degrees(late.rate_rad_s), name, colour=colour)
        canard.curve(late.time_s, np.degrees(late.canard_rad), name, colour=colour)
    return paper_svg(chart, "roll")


if __name__ == "__main__":
    main()
