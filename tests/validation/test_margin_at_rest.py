"""Gain margins at 0 Hz: an upright pendulum that only the integral of a velocity loop holds."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design
from actuator_lti.loops import ExactMargins
from analyses.validation.places import Bench
from analyses.validation.small_signal import Place, small_signal
from nonlinear import tangent

INTEGRAL_TIME_S = 100.0  # so slow that the pole passes 1 by 1e-6 of a relative change of the gain
FALLING = (1e-3, 1.0, 50.0)  # N m/rad at the output


def pendulum(falls_Nm_rad: float) -> Design:
    """A shipped drive without its position loop, on a load that falls over."""
    design = load_design("ilr33-amber")
    velocity = replace(design.controller.velocity, integral_time_s=INTEGRAL_TIME_S)
    control = replace(design.controller, position=None, velocity=velocity)
    load = replace(design.load, path="back-drivable", moment_slope_Nm_rad=falls_Nm_rad)
    return replace(design, controller=control, load=load)


def least_gain(design: Design) -> float:
    """k/(N^2 kM Kp/Tn): where the torque of the integral only just outweighs that of the load."""
    law, slope = design.controller.velocity, design.load.moment_slope_Nm_rad
    held = design.effective_motor.torque_constant_Nm_A * law.gain / law.integral_time_s
    return slope / design.total_ratio**2 / held


@pytest.mark.parametrize("falls_Nm_rad", FALLING)
def test_the_least_gain_is_that_of_the_integral(falls_Nm_rad: float) -> None:
    """The mode at rest of integral and angle stood beside the pole at some gains: 0.0140 for 0.0250 once."""
    design = pendulum(falls_Nm_rad)
    rows = small_signal(Bench(design, design).place("velocity"))
    (row,) = (row for row in rows if row.name == "gain_margin" and row.because.startswith("0 Hz"))
    assert row.verdict is Verdict.MET
    assert [row.predicted, row.found] == pytest.approx(2 * [least_gain(design)], rel=1e-6)
    assert "by +" in row.because  # outside the circle below that gain


@pytest.mark.parametrize("falls_Nm_rad", FALLING)
def test_the_mode_at_rest_is_none_of_the_poles_at_any_gain(falls_Nm_rad: float) -> None:
    design = pendulum(falls_Nm_rad)
    found = Bench(design, design).place("velocity").tangent
    beside = 1.0 + 1e-3 * np.random.default_rng(1).normal(size=200)
    assert {len(found.poles_at(gain)[0]) for gain in least_gain(design) * beside} == {len(found.A) - 1}


def test_a_gain_that_moves_a_pole_by_less_than_rounding_proves_nothing() -> None:
    """A pole at 1 - 1e-20 (K - 1): at 1 in every double whatever the gain."""
    one, none = np.ones((1, 1)), np.zeros((2, 2))
    known = tangent("ilr33-amber", "velocity")
    still = replace(known, A=one, B=1e-20 * one, C=one, D=0.0 * one, entry_errors=none)
    place = Place(
        name="u", condition="", tangent=still, predicted=still.closed, poles=np.empty(0, complex),
        exact=ExactMargins(True, 2.0, 0.0, None, 1.0), critical=lambda gain: np.ones(1, complex),
    )  # fmt: skip
    _, row = small_signal(place)
    assert (row.name, row.verdict) == ("gain_margin_up", Verdict.NOT_PROVEN)
    assert "less than rounding" in row.because
