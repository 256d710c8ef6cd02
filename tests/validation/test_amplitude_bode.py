"""Bandwidth against amplitude."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.bandwidth import closed_loop_bandwidth
from analyses.large_signal.bode import amplitude_bode
from analyses.large_signal.map import amplitude_map


@pytest.mark.parametrize("name", ["ilr33-amber", "emps"])
def test_small_amplitudes_without_friction_have_the_linear_bandwidth(name: str) -> None:
    """Interpolated between 40 frequencies: to 0.5 %."""
    design = load_design(name)
    loops = assemble_loops(design)
    small = replace(design.validation, full_deflection_rad=design.validation.full_deflection_rad / 1e5)
    tiny = replace(design, validation=small)
    result = amplitude_bode(tiny, amplitude_map(tiny, loops, friction_on=False, counts=(6, 40)))
    exact = closed_loop_bandwidth(loops.reference_to_output)
    np.testing.assert_allclose(result.minus3db_hz, exact.minus3db_hz, rtol=5e-3)
    np.testing.assert_allclose(result.minus90deg_hz, exact.minus90deg_hz, rtol=5e-3)
    assert result.linear_minus3db_hz == pytest.approx(exact.minus3db_hz, rel=5e-3)


def test_limits_take_bandwidth_away_as_the_amplitude_grows() -> None:
    design = load_design("ilr33-amber")
    result = amplitude_bode(design, amplitude_map(design, assemble_loops(design), counts=(16, 30)))
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
