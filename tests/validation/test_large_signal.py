"""Large signals: the sawtooth and its formulas, bandwidth against amplitude, margins by amplitude."""

import math

import numpy as np
import pytest

from actuator_lti import assemble_loops, closed_loop_bandwidth
from actuator_lti.design import load_design, with_values
from actuator_lti.drive.operating import rubs
from analyses import amplitude_map, large_signals, sawtooth
from analyses.large_signal.classify import FULL_TRIANGLE, rate_limited
from analyses.large_signal.from_rest import CLOSE, TOO_MANY, margins_by_amplitude
from analyses.large_signal.map import MINUS_3DB, AmplitudeBode, _crossing, amplitude_bode, crossing_range
from analyses.linear.loop_figures import all_loop_figures
from analyses.validation.places import Bench
from reports.sections.large_signal import _result
from reports.sections.names import output_unit
from tests.changed import changed
from tests.nonlinear.elastic_drive import stribeck
from tests.validation.random_drives import full_drive

AMBER = load_design("ilr33-amber")
TRIANGLE_CREST, TRIANGLE_DISTORTION = math.sqrt(3.0), 0.1212  # model.md section 5
HZ = np.array([1.0, 2.0, 4.0, 8.0])


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
    design = with_values(AMBER, {"limits.speed": 94.25})
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
    result = sawtooth(AMBER)
    assert not result.applicable
    assert result.passed is None
    assert result.reversal_deg > 10.0
    for run in result.runs:
        assert abs(run.gain_error) < 0.01
        assert 5.0 < run.lag_error_deg < result.reversal_deg


@pytest.mark.parametrize(("name", "changed", "asked", "word"), [
    ("emps", {}, {}, "no speed limit"),
    ("ctms-motor-position", {}, {}, "no speed limit"),
    ("ilr33-amber", {"limits.voltage": 5.6}, {}, "not every load"),
    # dry friction holds the drive: nothing to compare, and no division by a motion that is none
    ("ilr33-amber", {}, {"amplitude_rad": 1e-7, "frequency_hz": 1.0}, "0 N m the output stands still"),
    ("ballscrew", {}, {"amplitude_rad": 1e-9, "frequency_hz": 1.0}, "0 N the output stands still"),
])  # fmt: skip
def test_not_applicable_with_a_reason(name: str, changed: dict, asked: dict, word: str) -> None:
    result = sawtooth(with_values(load_design(name), changed), **asked)
    assert result.runs == ()
    assert result.passed is None
    assert word in result.reason


@pytest.mark.parametrize(("name", "share", "friction_on", "counts", "within"), [
    # small amplitudes without friction: between the map's frequencies as the linear response goes
    ("ilr33-amber", 1e-5, False, (6, 40), 5e-6),
    ("emps", 1e-5, False, (6, 40), 5e-6),
    # a moment over the angle (the gain at zero frequency is no 1), a limited jerk, a coarse map
    ("fin", 1.0, True, (2, 14), 1e-4),
    ("ballscrew", 1.0, True, (2, 14), 1e-4),
])  # fmt: skip
def test_the_linear_bandwidth_is_that_of_the_margins(name, share, friction_on, counts, within):
    design, loops = load_design(name), assemble_loops(name)
    small = changed(design, validation={"full_deflection_rad": share * design.validation.full_deflection_rad})
    shown = amplitude_map(small, loops, friction_on=friction_on, counts=counts)
    result, exact = amplitude_bode(small, loops, shown), all_loop_figures(loops)["position"].bandwidth
    assert result.linear_minus3db_hz == pytest.approx(exact.minus3db_hz, rel=within)
    assert result.linear_minus90deg_hz == pytest.approx(exact.minus90deg_hz, rel=within)
    if not friction_on:
        assert exact == closed_loop_bandwidth(loops.reference_to_output)
        np.testing.assert_allclose(result.minus3db_hz, exact.minus3db_hz, rtol=within)
        np.testing.assert_allclose(result.minus90deg_hz, exact.minus90deg_hz, rtol=within)


def test_limits_take_bandwidth_away_as_the_amplitude_grows() -> None:
    design, loops = AMBER, assemble_loops(AMBER)
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


def _words(gain_db: list[float]) -> str:
    """What is said of one amplitude, 10 deg at full deflection, of a loop with a bandwidth of 5 Hz."""
    gain, nothing = np.array([gain_db]), np.full((1, 4), np.nan)
    low_high = np.array([crossing_range(HZ, row, MINUS_3DB) for row in gain])
    found = np.array([_crossing(HZ, row, MINUS_3DB) for row in gain])
    size, below = np.array([np.radians(10.0)]), gain[:, 0] < MINUS_3DB
    result = AmplitudeBode(
        0.0, HZ, (1.0,), size, gain, nothing, gain[0], nothing[0], size, found, nothing[:, 0], low_high,
        below, 5.0, None,
    )  # fmt: skip
    return _result(result, output_unit("rotary"))


@pytest.mark.parametrize(("gain_db", "words"), [
    ([0.0, 0.0, np.nan, np.nan], "(linear); at full deflection (10 deg) it is above 2 Hz."),
    ([0.0, np.nan, -6.0, -9.0], "between 1 and 4 Hz, the points between are not steady."),
    ([np.nan, np.nan, np.nan, np.nan], "not known: no point is steady."),
    ([np.nan, -6.0, -9.0, -9.0], "not known: no point below it is steady."),
    ([-4.0, -6.0, -9.0, -9.0], "falls from 5 Hz (linear) to below 1 Hz at"),
    ([0.0, 0.0, -6.02059991, -9.0], "falls from 5 Hz (linear) to 2.83 Hz at"),
    ([0.0, 0.0, 0.0, -6.02059991], "rises from 5 Hz (linear) to 5.66 Hz at"),
])  # fmt: skip
def test_a_missing_point_is_no_value(gain_db: list[float], words: str) -> None:
    """3.01 dB is half of 6.02: halfway on the logarithm, the root of two times the lower frequency."""
    assert words in _words(gain_db)


def test_a_way_back_of_hours_is_not_simulated() -> None:
    """114 kg that 0.18 N speeds up for an hour, at 47 kHz; the table says so of each margin."""
    drive = full_drive(1_600_015)
    found = list(margins_by_amplitude(Bench(drive, drive)))
    assert len(found) == 24  # its friction is a map: with it and without
    assert all(one.too_long and one.value is None for one in found)
    assert TOO_MANY * drive.controller.period_s < 900.0  # 12 values and more


def test_an_arm_that_falls_while_outer_loops_are_open_takes_no_margin_of_an_inner_loop() -> None:
    """A small deviation without dry friction finds the linear margins; the delay margin was 0."""
    level = load_design("joint").with_values({"load.gravity.offset": "90 deg"})
    found = [one for one in margins_by_amplitude(Bench(level, level)) if one.size == "small"]
    inner = [one for one in found if one.loop == "current" and not one.friction_on]
    assert [one.kind for one in inner] == ["gain", "delay"]
    assert [one.value for one in inner] == [pytest.approx(one.linear, rel=2 * CLOSE) for one in inner]


def test_a_flat_friction_map_is_dry_friction() -> None:
    """The same torque at every speed: a limit acts from the same amplitudes on."""
    dry, none = AMBER.friction.dry_torque_Nm, {"dry_torque_Nm": 0.0}
    plain = changed(AMBER, friction={"viscous_Nms_rad": 0.0})
    flat = changed(plain, friction={**none, "points": stribeck((0.0, dry), (2000.0, dry))})
    found = [large_signals(one, counts=(2, 2)).shift.simulated_rad for one in (plain, flat)]
    assert np.isfinite(found[0]).any()
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)
    assert [rubs(one) for one in (plain, flat, changed(plain, friction=none))] == [True, True, False]
