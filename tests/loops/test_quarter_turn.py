"""A pendulum that stands out level has no slope: cos of a quarter turn is 0, whatever its rounding leaves.

In the linear loops, and in the linear drive of the page.
"""

from dataclasses import replace
from math import cos, pi, radians
from typing import Any

import numpy as np
import pytest
from loop_designs import sprung

from actuator_lti import assemble_loops, closed_loop_bandwidth, load_design, stability_margins
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.model import Gravity
from actuator_lti.drive.operating import Operating, moment_slope
from analyses.linear.loop_figures import all_loop_figures
from nonlinear._kernels import layout
from nonlinear.export.c_files import exported_row
from nonlinear.export.linear_row import linear_row
from tests.changed import changed

QUARTERS = (radians(90), radians(270), radians(-90), -3 * pi / 2, 5 * pi / 2)
SLOPES = (-1e-14, -1e-10, -1e-6, -1e-2, 1e-14, 1e-10, 1e-6)


def level(offset_rad: float) -> Gravity:
    return Gravity(mass_kg=3.5, arm_m=0.28, offset_rad=offset_rad)


@pytest.mark.parametrize("offset", QUARTERS)
@pytest.mark.parametrize("name", ["ilr33-amber", "joint"])
def test_level_is_without_slope(name: str, offset: float) -> None:
    """Every loop is that of a drive without gravity, to the bit."""
    with_it, without = (sprung(name, 0.0, gravity=gravity) for gravity in (level(offset), None))
    for form in ("sampled", "continuous", "ideal"):
        ours, theirs = (assemble_loops(each, form=form).present for each in (with_it, without))
        for loop in theirs:
            a, b = ours[loop].plain_open, theirs[loop].plain_open
            np.testing.assert_array_equal(a.A, b.A)
    for loop in assemble_loops(with_it).present.values():
        m = stability_margins(loop.open_loop)
        assert m.stable is True
        assert all(abs(g.db) < 200.0 for g in m.gain_margins)
        assert closed_loop_bandwidth(loop.closed_loop).resonance_peak_db < 10.0
    many = linear_figures(Population(with_it, {}, 1))
    assert all(many.stable(loop)[0] for loop in many.loops)


def test_a_slope_beside_it_stays() -> None:
    """k + m g l cos(angle), by hand; a hundredth of a degree off level is a slope."""

    def slope(gravity: Gravity | None, slope_Nm_rad: float = 0.0, **at: float) -> Any:
        return moment_slope(sprung("joint", slope_Nm_rad, gravity=gravity), Operating(**at))

    peak = 3.5 * 9.80665 * 0.28
    for degrees in (0.0, 89.99, 90.01, 180.0, 269.9999, 360.0):
        assert slope(level(radians(degrees))) == pytest.approx(peak * cos(radians(degrees)), rel=1e-9)
    assert slope(level(pi / 2), -1e-9) == pytest.approx(-1e-9, rel=1e-5)
    assert slope(None, -1e-14) == -1e-14
    assert slope(level(0.0), -peak) == 0.0  # a spring that takes the pendulum's slope
    assert slope(level(radians(60)), angle_rad=radians(30)) == 0.0
    offsets = np.array([0.0, pi / 2, 2.0, 3 * pi / 2])  # many designs are each of them alone
    many = slope(replace(level(0.0), offset_rad=offsets))
    assert many.tolist() == [slope(level(each)) for each in offsets]
    assert (many == 0.0).tolist() == [False, True, False, True]


@pytest.mark.parametrize(("followed", "told"), [(0.2, True), (0.7, True), (0.72, False), (0.95, False)])
def test_a_spring_that_holds_3_db_of_a_constant_command_is_told(followed: float, told: bool) -> None:
    """k = (1/T(0) - 1) Kp/Tn kM N^2; 1/sqrt(2) lies between 0.7 and 0.72."""
    base = sprung("ilr33-amber", 0.0)
    law, N = base.controller.velocity, base.total_ratio
    slope = (1 - 1 / followed) * law.gain / law.integral_time_s * N**2
    slope *= base.effective_motor.torque_constant_Nm_A
    notes = all_loop_figures(assemble_loops(sprung("ilr33-amber", slope)))["velocity"].notes
    assert any(f"a constant command gives {followed:g} of it" in note for note in notes) is told
    assert any("a constant command" in note for note in notes) is told


@pytest.mark.parametrize("slope", SLOPES)
def test_no_resonance_over_nothing(slope: float) -> None:
    """A P velocity loop against a spring has T(0) = 0: what rounding leaves of it measures nothing."""
    design = sprung("joint", slope, gravity=None)
    loops = assemble_loops(design)
    refused: list[str] = []
    figures = all_loop_figures(loops, refused=refused)
    assert figures["velocity"].bandwidth is None
    if figures["velocity"].stable:
        assert any("at zero frequency" in note for note in figures["velocity"].notes)
    many = linear_figures(Population(design, {}, 1))
    assert not many.quantity("resonance_peak", "velocity")[0] > 20.0


@pytest.mark.parametrize("degrees", [0.0, 90.0, 90.01, 180.0, 270.0, -90.0])
@pytest.mark.parametrize("spring", [0.0, -1e-9, -2.0])
def test_slope_of_the_linear_row(degrees: float, spring: float) -> None:
    """k + m g l cos(angle), with cos of a quarter turn 0."""
    load = {"gravity": level(radians(degrees)), "moment_slope_Nm_rad": spring}
    row = exported_row(changed(load_design("joint"), load=load))
    linear = np.zeros_like(row)
    linear_row(row, linear)
    flat = degrees % 180.0 == 90.0
    expected = spring + (0.0 if flat else 3.5 * 9.80665 * 0.28 * cos(radians(degrees)))
    assert linear[layout.LOAD_SLOPE] == pytest.approx(expected, rel=1e-5)
    if flat and spring == 0.0:
        assert linear[layout.LOAD_SLOPE] == 0.0
