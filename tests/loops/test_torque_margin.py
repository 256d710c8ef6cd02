"""The torque margin of a requirement: at 1 the drive just starts to move, in the simulator too."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch.static import drive_figures
from actuator_lti.design import load_design
from actuator_lti.design.model import Design
from nonlinear import commands, simulate

AMBER = load_design("ilr33-amber").with_values({"friction.breakaway_ratio": 1.3})


def test_by_hand() -> None:
    """kM i_peak (or kM U/R) over CM |M| passed to the motor, breakaway on the dry part alone."""
    friction, motor, limits = AMBER.friction, AMBER.motor, AMBER.limits
    torque = motor.torque_constant_Nm_A * min(limits.peak_current_A, limits.voltage_V / motor.resistance_ohm)
    dry = friction.dry_torque_Nm + friction.load_coefficient * 4.0
    held = dry * friction.breakaway_ratio + abs(friction.offset_torque_Nm)
    if AMBER.load.path == "back-drivable":
        held += 4.0 / AMBER.total_ratio
    assert drive_figure(AMBER, "torque_margin", 4.0) == pytest.approx(torque / held, rel=1e-12)


def weak(design: Design, load_Nm: float, margin: float) -> Design:
    """The same drive with a current limit that gives it this margin."""
    torque = drive_figure(design, "torque_margin", load_Nm)
    peak = design.limits.peak_current_A * margin / torque
    return replace(design, limits=replace(design.limits, peak_current_A=float(peak)))


@pytest.mark.parametrize("load_Nm", [0.0, 1.0, 6.0])
@pytest.mark.parametrize(("margin", "moves"), [(0.98, False), (1.02, True)])
def test_the_simulator_starts_above_one(load_Nm: float, margin: float, moves: bool) -> None:
    """A large step in the worse direction, within a voltage that is no limit."""
    base = replace(AMBER, limits=replace(AMBER.limits, peak_current_A=1.0))
    design = weak(base, load_Nm, margin)
    assert drive_figure(design, "torque_margin", load_Nm) == pytest.approx(margin, rel=1e-9)
    starts = []
    for sign in (1.0, -1.0):
        run = simulate(design, commands.step(sign * 0.2), duration_s=0.3, load_Nm=-sign * load_Nm)
        starts.append(bool(np.abs(run.motor_speed_rad_s).max() > 1e-6))
    assert all(starts) is moves


def test_many_designs_have_the_figure_of_each() -> None:
    scale = np.array([0.5, 1.0, 2.0])
    path = "motor.torque_constant"
    values = {path: AMBER.parameters[path].value * scale}
    many = drive_figures(Population(AMBER, values, 3), "torque_margin", 4.0)
    assert many == pytest.approx(scale * drive_figure(AMBER, "torque_margin", 4.0), rel=1e-12)
