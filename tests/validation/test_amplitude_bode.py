"""Bandwidth against amplitude."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.bandwidth import closed_loop_bandwidth
from analyses.large_signal.map import (
    MINUS_3DB,
    AmplitudeBode,
    _crossing,
    amplitude_bode,
    amplitude_map,
    crossing_range,
)
from analyses.linear.loop_figures import all_loop_figures
from reports.sections.large_signal import _result


@pytest.mark.parametrize("name", ["ilr33-amber", "emps"])
def test_small_amplitudes_without_friction_have_the_linear_bandwidth(name: str) -> None:
    """Between the map's frequencies as the linear response goes: to 5e-6."""
    design = load_design(name)
    loops = assemble_loops(design)
    small = replace(design.validation, full_deflection_rad=design.validation.full_deflection_rad / 1e5)
    tiny = replace(design, validation=small)
    result = amplitude_bode(tiny, loops, amplitude_map(tiny, loops, friction_on=False, counts=(6, 40)))
    exact = closed_loop_bandwidth(loops.reference_to_output)
    np.testing.assert_allclose(result.minus3db_hz, exact.minus3db_hz, rtol=5e-6)
    np.testing.assert_allclose(result.minus90deg_hz, exact.minus90deg_hz, rtol=5e-6)
    assert result.linear_minus3db_hz == pytest.approx(exact.minus3db_hz, rel=5e-6)


@pytest.mark.parametrize("name", ["fin", "ballscrew"])
def test_the_linear_bandwidth_is_that_of_the_margins_however_coarse_the_map(name: str) -> None:
    """A moment over the angle (the gain at zero frequency is no 1), a limited jerk."""
    design = load_design(name)
    loops = assemble_loops(design)
    result = amplitude_bode(design, loops, amplitude_map(design, loops, counts=(2, 14)))
    exact = all_loop_figures(loops)["position"].bandwidth
    assert exact is not None
    assert result.linear_minus3db_hz == pytest.approx(exact.minus3db_hz, rel=1e-4)
    assert result.linear_minus90deg_hz == pytest.approx(exact.minus90deg_hz, rel=1e-4)


def test_limits_take_bandwidth_away_as_the_amplitude_grows() -> None:
    design = load_design("ilr33-amber")
    loops = assemble_loops(design)
    result = amplitude_bode(design, loops, amplitude_map(design, loops, counts=(16, 30)))
    full = design.validation.full_deflection_rad
    np.testing.assert_allclose(result.amplitude_rad, np.array(result.fractions) * full)
    assert result.fractions == (0.05, 0.1, 0.25, 0.5, 1.0)
    asked = [int(np.argmin(np.abs(result.all_amplitude_rad - a))) for a in result.amplitude_rad]
    gain, lag = result.minus3db_hz[asked], result.minus90deg_hz[asked]
    known = np.isfinite(gain)
    assert np.all(np.diff(gain[known]) < 0.0)
    assert np.all(np.diff(lag) < 0.0)
    # x = w A/R = 4/(pi sqrt(1/2)) brings the triangle's fundamental to -3 dB
    rate = design.limits.speed_rad_s / design.total_ratio
    place = list(result.fractions).index(0.5)
    expected = 4.0 / (np.pi * np.sqrt(0.5)) * rate / (2.0 * np.pi * result.amplitude_rad[place])
    assert gain[place] == pytest.approx(expected, rel=0.05)
    assert result.below_from_start[asked].tolist() == (~known).tolist()


def test_a_coarse_map_shows_no_amplitude_as_another() -> None:
    """Four amplitudes for five fractions: what is shown as 50 % is 50 %; full deflection is among them."""
    design = load_design("emps")
    loops = assemble_loops(design)
    coarse = amplitude_bode(design, loops, amplitude_map(design, loops, counts=(4, 4)))
    full = design.validation.full_deflection_rad
    np.testing.assert_allclose(coarse.amplitude_rad, np.array(coarse.fractions) * full, rtol=1e-9)
    assert len(coarse.fractions) == 4
    assert coarse.fractions[-1] == 1.0
    assert coarse.gain_db.shape == (4, 4)


HZ = np.array([1.0, 2.0, 4.0, 8.0])


def _words(gain_db: list[float]) -> str:
    """What is said of one amplitude, 10 deg at full deflection, of a loop with a bandwidth of 5 Hz."""
    gain, nothing = np.array([gain_db]), np.full((1, 4), np.nan)
    low_high = np.array([crossing_range(HZ, row, MINUS_3DB) for row in gain])
    found = np.array([_crossing(HZ, row, MINUS_3DB) for row in gain])
    size = np.array([np.radians(10.0)])
    below = gain[:, 0] < MINUS_3DB
    result = AmplitudeBode(
        0.0, HZ, (1.0,), size, gain, nothing, gain[0], nothing[0], size, found, nothing[:, 0], low_high,
        below, 5.0, None,
    )  # fmt: skip
    return _result(result, 180.0 / np.pi, "deg")


@pytest.mark.parametrize(
    ("gain_db", "words"),
    [
        ([0.0, 0.0, np.nan, np.nan], "(linear); at full deflection (10 deg) it is above 2 Hz."),
        ([0.0, np.nan, -6.0, -9.0], "between 1 and 4 Hz, the points between are not steady."),
        ([np.nan, np.nan, np.nan, np.nan], "not known: no point is steady."),
        ([np.nan, -6.0, -9.0, -9.0], "not known: no point below it is steady."),
        ([-4.0, -6.0, -9.0, -9.0], "falls from 5 Hz (linear) to below 1 Hz at"),
        ([0.0, 0.0, -6.02059991, -9.0], "falls from 5 Hz (linear) to 2.83 Hz at"),
        ([0.0, 0.0, 0.0, -6.02059991], "rises from 5 Hz (linear) to 5.66 Hz at"),
    ],
)
def test_a_missing_point_is_no_value(gain_db: list[float], words: str) -> None:
    """3.01 dB is half of 6.02: halfway on the logarithm, the root of two times the lower frequency."""
    assert words in _words(gain_db)
