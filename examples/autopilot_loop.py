"""The exported drive in the roll-rate loop of a linear airframe: margins of the outer loop, in time.

The drive is the FMU of ``actuator-lti export fmu``; the airframe is ``p' = -a p + b delta``, delta the fin
angle.  The autopilot commands ``delta = -K p`` every tick.  The outer loop is closed around the linear drive
of `actuator_lti.assemble_loops`; its gain margin says at which K the roll oscillation stays.  With dry
friction off (a parameter of the FMU) the FMU must decay just below that gain and grow just above it.

A second host has an integrator of its own: scipy's ``solve_ivp`` goes from tick to tick, and asks the
exported C for the fin angle wherever it looks within one.  The first comes to the same flight where it has
several communication points in a tick and takes the mean of the fin angle at both ends of each step.

    python -m examples.autopilot_loop
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import control
import numpy as np

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Design
from actuator_lti.margins import StabilityMargins, stability_margins
from examples.exported_drive import ExportedDrive
from nonlinear.export import fmu_bytes

DAMPING_1_S = 2.0  # a
EFFECTIVENESS_1_S2 = 60.0  # b
GAIN_S = 0.5  # K of the autopilot
NO_DRY_FRICTION = {"friction.dry_torque": 0.0, "friction.load_coefficient": 0.0}


def smooth(design: Design) -> Design:
    """The design without dry friction, which would hide the stability limit."""
    return design.with_values(NO_DRY_FRICTION)


def airframe(period_s: float) -> tuple[float, float]:
    """(A, B) of the roll rate over one tick in which the fin angle is held."""
    decay = float(np.exp(-DAMPING_1_S * period_s))
    return decay, EFFECTIVENESS_1_S2 / DAMPING_1_S * (1.0 - decay)


def outer_loop(design: Design, gain_s: float) -> Any:
    """The loop of the autopilot: airframe times closed drive, broken at the roll rate."""
    position = assemble_loops(design).position
    assert position is not None
    A, B = airframe(design.controller.period_s)
    plant = control.ss([[A]], [[B]], [[gain_s]], [[0.0]], design.controller.period_s)
    return plant * control.ss(position.closed_loop)


def margins(design: Design, gain_s: float = GAIN_S) -> StabilityMargins:
    """Margins of the autopilot with the drive."""
    return stability_margins(outer_loop(design, gain_s))


@dataclass(frozen=True)
class Flight:
    """Roll rate at every tick."""

    time_s: np.ndarray
    roll_rate_rad_s: np.ndarray

    @property
    def growth(self) -> float:
        """Largest rate of the last third over that of the second."""
        third = self.roll_rate_rad_s.size // 3
        late, before = self.roll_rate_rad_s[2 * third :], self.roll_rate_rad_s[third : 2 * third]
        return float(np.abs(late).max() / np.abs(before).max())


def fly(
    design: Design, path: Path, gain_s: float, duration_s: float, start_rad_s: float = 1e-4, *, parts: int = 1
) -> Flight:
    """Fly with the FMU at ``path`` as the drive.

    With several ``parts`` of a tick the fin angle goes on within it; with one it is held over the tick, as in
    the loop of `margins`.
    """
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    description = read_model_description(str(path))
    place = {item.name: item.valueReference for item in description.modelVariables}
    unit = FMU2Slave(
        guid=description.guid,
        unzipDirectory=extract(str(path)),
        modelIdentifier="drive",
        instanceName="drive",
    )
    unit.instantiate()
    unit.setupExperiment()
    unit.setReal([place[name] for name in NO_DRY_FRICTION], list(NO_DRY_FRICTION.values()))
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    period = design.controller.period_s
    step = period / parts
    A, B = airframe(step)
    rates = np.empty(round(duration_s / period))
    rate = start_rad_s
    for k in range(rates.size * parts):
        if k % parts == 0:
            rates[k // parts] = rate
            unit.setReal([place["command"]], [-gain_s * rate])
        angle = unit.getReal([place["output.angle"]])[0]
        unit.doStep(k * step, step)
        if parts > 1:
            angle = 0.5 * (angle + unit.getReal([place["output.angle"]])[0])
        rate = A * rate + B * angle
    unit.terminate()
    unit.freeInstance()
    return Flight(np.arange(rates.size) * period, rates)


def fly_inside(
    design: Design, folder: Path, gain_s: float, duration_s: float, start_rad_s: float = 1e-4
) -> Flight:
    """Fly with the exported C inside ``solve_ivp``: the ticks are the ends of its intervals."""
    from scipy.integrate import solve_ivp

    drive, period = ExportedDrive(design, folder), design.controller.period_s
    rates = np.empty(round(duration_s / period))
    rate = start_rad_s
    for k in range(rates.size):
        rates[k], command = rate, -gain_s * rate

        def slope(t: float, p: np.ndarray, command: float = command) -> np.ndarray:
            return -DAMPING_1_S * p + EFFECTIVENESS_1_S2 * drive.within(t, command)

        rate = solve_ivp(slope, (0.0, period), [rate], rtol=1e-10, atol=1e-15).y[0, -1]
        drive.step(command)
    return Flight(np.arange(rates.size) * period, rates)


def main() -> None:
    """Print the margins and what the FMU does on both sides of the gain margin."""
    design = load_design("ilr33-amber")
    found = margins(design)
    factor = found.gain_margins[0].ratio
    sys.stdout.write(f"{found}\n")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.fmu"
        path.write_bytes(fmu_bytes(design, 2, ("linux64",)))
        for part in (0.9, 1.1):
            flight = fly(design, path, GAIN_S * factor * part, 0.6)
            sys.stdout.write(f"{part:g} of the limit: amplitude changes by {flight.growth:.3g} in 0.2 s\n")


if __name__ == "__main__":
    main()
