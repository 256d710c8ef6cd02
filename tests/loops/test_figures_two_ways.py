"""Figures of a drive and of its response to the command, for one design and for many: the two agree."""

import numpy as np
import pytest
from test_stacked import everything

from actuator_lti import assemble_loops, closed_loop_bandwidth, step_figures
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import DRIVE_QUANTITIES
from actuator_lti.batch import Population, drive_figures, linear_figures
from tests.validation.random_drives import drives


@pytest.mark.parametrize("load_Nm", [0.0, 3.0, -20.0])
def test_drive_figures(load_Nm: float) -> None:
    """Speed, current, acceleration, torque margin, stiffness, lost motion."""
    for design in drives(90_100, 12):
        many = Population(design, {}, 2)
        for name in DRIVE_QUANTITIES:
            one = drive_figure(design, name, load_Nm)
            truth = np.nan if one is None else float(one)
            if name == "motor_current" and not design.motor.has_electrical_dynamics:
                continue
            found = drive_figures(many, name, load_Nm)
            assert found == pytest.approx([truth] * 2, rel=1e-9, nan_ok=True), (design.name, name)


def test_figures_of_the_response_to_the_command() -> None:
    """Of a drive with every slot of the controller filled."""
    figures = linear_figures(Population(everything(), {}, 1))
    response = assemble_loops(everything()).reference_to_output
    width, step = closed_loop_bandwidth(response), step_figures(response)
    pairs = {"bandwidth": width.minus3db_hz, "resonance_peak": width.resonance_peak_db,
             "overshoot": step.overshoot_percent, "rise_time": step.rise_time_s}  # fmt: skip
    for quantity, expected in pairs.items():
        found = figures.quantity(quantity, "position")[0]
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6), quantity
