"""Every figure that a requirement may name, for one design and for many: the two agree on any drive."""

import numpy as np
import pytest
from loop_designs import controlled
from test_stacked import everything

from actuator_lti import assemble_loops, closed_loop_bandwidth, load_design, stability_margins, step_figures
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import DRIVE_QUANTITIES, LOOP_QUANTITIES
from actuator_lti.batch import Population, drive_figures, linear_figures
from actuator_lti.design.model import Design
from tests.validation.random_drives import drives

LOUD = controlled(load_design("ilr33-amber"), position={"gain": 4800.0})  # S of its position loop has no peak


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


@pytest.mark.parametrize("design", [everything(), LOUD, *drives(90_209, 8)], ids=lambda each: each.name)
def test_loop_figures(design: Design) -> None:
    """The margins of every loop; where one of the two withholds them it has no say."""
    figures = linear_figures(Population(design, {}, 1), time_figures=False)
    loops = assemble_loops(design).present
    assert set(figures.loops) == set(loops)
    for name, loop in loops.items():
        truth = stability_margins(loop.open_loop)
        if truth.stable is None or figures.withheld(name)[0]:
            assert design not in (everything(), LOUD)
            continue
        assert bool(figures.stable(name)[0]) is truth.stable
        for key in ("gain_margin", "phase_margin", "modulus_margin", "sensitivity_peak", "delay_margin"):
            value = getattr(truth, LOOP_QUANTITIES[key].reader.removeprefix("margins."))
            expected = np.inf if value is None else value
            if key == "sensitivity_peak" and not truth.stable:
                assert value is None
                expected = np.nan  # S of an unstable loop has no peak
            got = figures.quantity(key, name)[0]
            assert got == pytest.approx(expected, rel=1e-6, nan_ok=True), (name, key)


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
