"""The sawtooth and the formulas of rate and acceleration limits."""

import math

import pytest

from actuator_lti import load_design
from actuator_lti.design import with_values
from analyses.large_signal.classify import FULL_TRIANGLE, rate_limited
from analyses.large_signal.sawtooth import sawtooth

TRIANGLE_CREST, TRIANGLE_DISTORTION = math.sqrt(3.0), 0.1212  # model.md section 5


def test_h1_rate_limit() -> None:
    """Reference case H1: 10 deg, 5 Hz, 150 deg/s."""
    result = rate_limited(10.0, 2.0 * math.pi * 5.0, 150.0)
    assert result.regime == "triangle"
    assert result.peak == pytest.approx(7.5)
    assert result.gain == pytest.approx(0.607927, abs=5e-7)
    assert 20.0 * math.log10(result.gain) == pytest.approx(-4.3230, abs=5e-5)
    assert result.lag_deg == pytest.approx(41.4096, abs=5e-5)


def test_the_regimes_join() -> None:
    """The accepted fit meets both ends to its own accuracy of about a percent and a degree."""
    assert pytest.approx(1.8621, abs=5e-5) == FULL_TRIANGLE
    low, high = rate_limited(1.0001, 1.0, 1.0), rate_limited(FULL_TRIANGLE - 1e-9, 1.0, 1.0)
    full = rate_limited(FULL_TRIANGLE + 1e-9, 1.0, 1.0)
    assert (low.regime, high.regime, full.regime) == ("between", "between", "triangle")
    assert low.gain == pytest.approx(1.0, abs=0.01)
    assert low.lag_deg == pytest.approx(0.0, abs=1.0)
    assert high.gain == pytest.approx(full.gain, rel=0.01)
    assert high.lag_deg == pytest.approx(full.lag_deg, abs=1.0)
    assert rate_limited(0.5, 1.0, 1.0).gain == 1.0


@pytest.mark.parametrize("x", [2.2, 3.0, 6.0])
def test_the_formulas_hold_where_loops_and_torque_are_fast(x: float) -> None:
    """A tenth of the speed limit, so that a tenth of the frequency gives the same x: gain 1 %, lag 1 deg."""
    design = with_values(load_design("ilr33-amber"), {"limits.speed": 94.25})
    rate = 94.25 / design.total_ratio
    hz = x * rate / (2.0 * math.pi * design.validation.full_deflection_rad)
    result = sawtooth(design, frequency_hz=hz)
    assert result.applicable
    assert result.passed
    assert [run.load_Nm for run in result.runs] == [0.0, 8.0]
    for run in result.runs:
        assert run.formula.x == pytest.approx(x, rel=1e-3)
        assert abs(run.gain_error) < 0.01
        assert abs(run.lag_error_deg) < 1.0
        assert run.peak_rad == pytest.approx(run.formula.peak, rel=0.01)
        assert run.distortion == pytest.approx(TRIANGLE_DISTORTION, abs=0.002)
        assert run.crest == pytest.approx(TRIANGLE_CREST, rel=0.005)


def test_the_baseline_reverses_too_slowly_for_the_lag() -> None:
    """At 10 deg the gain is met, the lag comes 8 deg later: 27 ms of reversal, said and not judged."""
    result = sawtooth(load_design("ilr33-amber"))
    assert not result.applicable
    assert result.passed is None
    assert result.reversal_deg > 10.0
    for run in result.runs:
        assert abs(run.gain_error) < 0.01
        assert 5.0 < run.lag_error_deg < result.reversal_deg


@pytest.mark.parametrize(
    ("name", "changed", "asked", "word"),
    [
        ("emps", {}, {}, "no speed limit"),
        ("ctms-motor-position", {}, {}, "no speed limit"),
        ("ilr33-amber", {"limits.voltage": 5.6}, {}, "not every load"),
        # dry friction holds the drive: nothing to compare, and no division by a motion that is none
        ("ilr33-amber", {}, {"amplitude_rad": 1e-7, "frequency_hz": 1.0}, "stands still"),
    ],
)
def test_not_applicable_with_a_reason(name: str, changed: dict, asked: dict, word: str) -> None:
    result = sawtooth(with_values(load_design(name), changed), **asked)
    assert result.runs == ()
    assert result.passed is None
    assert word in result.reason
