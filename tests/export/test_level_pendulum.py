"""The page's linear drive has no slope where the pendulum stands out level, as the linear loops have none."""

from math import cos, radians

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design.model import Gravity
from nonlinear._kernels import layout
from nonlinear.export.c_files import exported_row
from nonlinear.export.linear_row import linear_row
from tests.changed import changed


@pytest.mark.parametrize("degrees", [0.0, 90.0, 90.01, 180.0, 270.0, -90.0])
@pytest.mark.parametrize("spring", [0.0, -1e-9, -2.0])
def test_slope_of_the_linear_row(degrees: float, spring: float) -> None:
    """k + m g l cos(angle), with cos of a quarter turn 0."""
    gravity = Gravity(mass_kg=3.5, arm_m=0.28, offset_rad=radians(degrees))
    design = changed(load_design("joint"), load={"gravity": gravity, "moment_slope_Nm_rad": spring})
    row = exported_row(design)
    linear = np.zeros_like(row)
    linear_row(row, linear)
    level = degrees % 180.0 == 90.0
    expected = spring + (0.0 if level else 3.5 * 9.80665 * 0.28 * cos(radians(degrees)))
    assert linear[layout.LOAD_SLOPE] == pytest.approx(expected, rel=1e-5)
    if level and spring == 0.0:
        assert linear[layout.LOAD_SLOPE] == 0.0
