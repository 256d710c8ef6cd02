"""Large signals: the sawtooth, bandwidth and margins by amplitude, the map and its border against A_k(w)."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_lti import NumericalError, assemble_loops, closed_loop_bandwidth, load_design, onset
from actuator_lti.design import shipped_designs, with_values
from actuator_lti.design.model import Command, Design, Friction
from actuator_lti.drive.operating import rubs
from analyses import large_signals, sawtooth
from analyses.friction_effects.breakaway import static_threshold
from analyses.large_signal import tones
from analyses.large_signal.classify import (
    CAUSES,
    FULL_TRIANGLE,
    STEADY,
    WAVEFORMS,
    causes,
    rate_limited,
    waveforms,
)
from analyses.large_signal.from_rest import CLOSE, TOO_MANY, margins_by_amplitude
from analyses.large_signal.map import (
    MINUS_3DB,
    AmplitudeBode,
    AmplitudeMap,
    _crossing,
    amplitude_bode,
    amplitude_map,
    crossing_range,
)
from analyses.large_signal.result import ROUNDS, limit_shift
from analyses.linear.loop_figures import all_loop_figures
from analyses.validation.places import Bench
from nonlinear import Rows, commands, simulate
from reports.sections.large_signal import _result, _sawtooth
from reports.sections.names import output_unit
from tests.changed import changed
from tests.nonlinear.elastic_drive import drive_f, stribeck
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


PROFILE = {"command.rate": 0.02, "command.acceleration": 10.0, "command.filter_time": 0.05}


@pytest.mark.parametrize(("x", "profile"), [(2.2, {}), (3.0, {}), (6.0, {}), (3.0, PROFILE)])
def test_the_formulas_hold_where_loops_and_torque_are_fast(x: float, profile: dict) -> None:
    """A tenth of the speed limit, so that a tenth of the frequency gives the same x: gain 1 %, lag 1 deg."""
    design = with_values(AMBER, {"limits.speed": 94.25, **profile})
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
    unit = output_unit(AMBER)
    assert "the output becomes a sawtooth" in _sawtooth(result, unit, "N m")["caption"]
    slow = sawtooth(with_values(AMBER, {"limits.acceleration": 2500.0}))
    assert slow.reversal_deg > 180.0
    assert "no sawtooth" in _sawtooth(slow, unit, "N m")["caption"]
    assert "Not steady at a load of 0, 8 N m" in _sawtooth(slow, unit, "N m")["caption"]


def test_the_figures_are_those_of_the_steady_motion_from_any_start() -> None:
    """Begun on a flank, the fourth period of this drive lags by one more degree."""
    joint, periods = replace(load_design("joint"), command=Command()), 20
    result = sawtooth(joint)
    ours, sine = result.runs[0], commands.sine(result.amplitude_rad, result.frequency_hz)
    run = simulate(joint, sine, periods / result.frequency_hz, 0.0)
    last = run.time_s >= (periods - 1) / result.frequency_hz - 1e-9
    turn = np.exp(-2j * np.pi * result.frequency_hz * run.time_s[last])
    fundamental = 2j * np.mean(run.output_angle_rad[last] * turn) / result.amplitude_rad
    assert ours.steady
    assert ours.gain == pytest.approx(abs(fundamental), rel=2e-3)
    assert ours.lag_deg == pytest.approx(-np.degrees(np.angle(fundamental)), abs=0.3)


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


def mapped(design: Design, counts: tuple[int, int] = (2, 9)) -> AmplitudeMap:
    return amplitude_map(design, assemble_loops(design), counts=counts)


@pytest.fixture(scope="module")
def amber_map() -> AmplitudeMap:
    return mapped(AMBER, (17, 16))


@pytest.mark.parametrize("hz", [0.3, 7.77, 100.0, 389.0])
def test_tones_pass_as_many_phases_as_they_have_updates(hz: float) -> None:
    design = load_design("ilr33-amber-multirate")
    result, every = tones.tone(hz, design), design.controller.position.every
    updates = result.ticks // every
    assert result.ticks == updates * every
    assert math.gcd(result.cycles, updates) == 1
    assert updates >= tones.LEAST_UPDATES
    span_s = result.ticks * design.controller.period_s
    assert result.cycles / span_s == pytest.approx(result.frequency_hz, rel=1e-12)
    assert result.frequency_hz == pytest.approx(hz, rel=2.0 / updates)


def test_amplitudes_hold_those_that_the_design_asks_for() -> None:
    values, full = tones.amplitudes(AMBER, 25, 1e-5), AMBER.validation.full_deflection_rad
    assert len(values) == 25
    assert np.all(np.diff(values) > 0.0)
    for fraction in AMBER.validation.amplitude_fractions:
        assert np.min(np.abs(values - fraction * full)) == 0.0


def test_friction_shifts_the_border() -> None:
    shift = limit_shift(AMBER, assemble_loops(AMBER))
    assert len(shift.frequency_hz) >= 12
    assert 0.01 < np.max(np.abs(shift.ratio - 1.0)) < 0.1
    # at low frequency it is the speed command that limits, which friction hardly changes
    assert abs(shift.ratio[0] - 1.0) < 0.005
    assert shift.linear_limiter[0] == shift.simulated_limiter[0] == "speed"


def test_friction_of_nothing_shifts_nothing() -> None:
    """Not by more than the bisection resolves; also in front of a filter of the command."""
    for design in (AMBER, changed(AMBER, command={"filter_time_s": 5e-3})):
        free = changed(design, friction={"dry_torque_Nm": 1e-12})
        shift = limit_shift(free, assemble_loops(free), count=4)
        assert np.max(np.abs(shift.ratio - 1.0)) < shift.resolution


def test_without_friction_the_linear_response_holds_below_the_border() -> None:
    loops = assemble_loops(AMBER)
    sines = tuple(tones.tone(f, AMBER) for f in (1.0, 8.0, 30.0, 120.0))
    omega = np.array([t.omega_rad_s for t in sines])
    start, border = tones.linear_steady_state(loops, omega), onset(loops, omega)
    which = np.arange(4)
    for share, everything in ((0.95, True), (1.1, False)):
        amplitude = share * border.amplitude_rad
        begin = np.minimum(amplitude, 0.9 * border.amplitude_rad)
        result = tones.tone_rows(AMBER, sines, which, amplitude, start, begin, friction_on=False).run()
        linear = result.phasor("output_angle_rad") / amplitude / start.output
        names = [CAUSES[k] for k in causes(result, start.output, amplitude)]
        if everything:
            np.testing.assert_allclose(linear, 1.0, atol=1e-7)
            assert names == ["none"] * 4
        else:
            assert names == list(border.active)


def test_what_the_map_shows(amber_map: AmplitudeMap) -> None:
    cause, waveform, middle = amber_map.cause, amber_map.waveform, len(amber_map.amplitude_rad) // 2
    shown = {row: (CAUSES[cause[row, 0]], WAVEFORMS[waveform[row, 0]]) for row in (-1, 0, middle)}
    assert shown == {-1: ("speed", "triangle"), 0: ("stiction", "stick-slip"), middle: ("none", "sine")}
    changed = amber_map.response[middle, 0] / amber_map.linear[0]
    assert abs(20.0 * np.log10(abs(changed))) < 0.1
    assert abs(np.degrees(np.angle(changed))) < 2.0
    assert amber_map.share("speed", "current", "acceleration") > 0.3
    assert "parabola" in {WAVEFORMS[k] for k in waveform.ravel()}


def test_a_steady_point_is_that_of_a_far_longer_run() -> None:
    """Whose windows agree to 1 % while the phase still turns: 9 % off where two windows were asked."""
    loops = assemble_loops(AMBER)
    sines = tones.tones(AMBER, loops, 28)[12:26]
    start = tones.linear_steady_state(loops, np.array([each.omega_rad_s for each in sines]))
    which, amplitude = np.tile(np.arange(14), 3), np.repeat([0.009, 0.044, 0.087], 14)
    rows = tones.tone_rows(AMBER, sines, which, amplitude, start, 0.1 * amplitude)
    found, change = tones.run_until_steady(rows)
    rows["ticks"] *= 100
    response, wanted = found.phasor("output_angle_rad"), rows.run().phasor("output_angle_rad")
    steady = change <= STEADY
    assert steady.sum() > 30
    assert np.all(np.abs(response - wanted)[steady] <= 2.0 * STEADY * np.abs(wanted[steady]))


def test_a_phase_is_unwrapped_from_the_linear_one(amber_map: AmplitudeMap) -> None:
    """179 deg ahead at the lowest frequency is 181 deg behind: no -90 deg to be crossed above it."""
    late = replace(amber_map, response=np.tile(amber_map.linear * np.exp(-3.13j), (2, 1)))
    wanted = np.degrees(np.unwrap(np.angle(amber_map.linear)) - 3.13)
    assert np.angle(late.response[0, 0]) > 0.0
    assert late.phase_deg == pytest.approx(np.tile(wanted, (2, 1)), abs=1e-9)


def test_limits_act_above_the_lowest_line_only(amber_map: AmplitudeMap) -> None:
    lowest = np.min(list(amber_map.onset_rad.values()), axis=0)
    x = amber_map.amplitude_rad[:, None] / lowest[None, :]
    limited = amber_map.limiter_fraction.max(axis=2) > 0.0
    assert not limited[x < 0.9].any()
    assert limited[x > 1.1].all()


def test_a_command_below_the_threshold_moves_nothing() -> None:
    design = load_design("emps")
    loops, sines = assemble_loops(design), (tones.tone(5.0, design),)
    start = tones.linear_steady_state(loops, np.array([sines[0].omega_rad_s]))
    small = np.array([0.5 * static_threshold(design).smallest_rad])
    result = tones.tone_rows(design, sines, np.array([0]), small, start, 0.0 * small).run()
    assert WAVEFORMS[waveforms(result, np.zeros(1))[0]] == "no motion"
    assert CAUSES[causes(result, start.output, small)[0]] == "stiction"


def test_a_drive_without_limits_has_no_border_and_an_unstable_loop_has_a_map() -> None:
    names = ("voltage_V", "speed_rad_s", "acceleration_rad_s2", "peak_current_A")
    free = changed(AMBER, limits=dict.fromkeys(names, math.inf))
    unstable = with_values(AMBER, {"control.position.gain": 6000.0})
    for design in (free, unstable):
        assert limit_shift(design, assemble_loops(design), count=3) is None
    assert mapped(free, (6, 4)).share("speed", "acceleration", "current", "voltage") == 0.0
    assert np.isfinite(mapped(unstable, (6, 4)).response).all()


def test_every_state_of_a_shipped_drive_is_known_and_every_start_is_one() -> None:
    """A name that no drive has would be passed over, and the run would begin at rest."""
    states = [assemble_loops(name).tick_system.states for name in shipped_designs()]
    assert not any(tones.without_value(each, tones.PLACES, tones.LEFT_AT_REST) for each in states)
    assert set(tones.PLACES) <= {state for each in states for state in each}


def test_a_start_refuses_a_state_that_it_does_not_know() -> None:
    loops = assemble_loops("ilr33-amber")
    system = loops.tick_system
    kept = {name: getattr(system, name) for name in ("outputs", "ticks", "matrices")}
    strange = SimpleNamespace(states=("flux", *system.states[1:]), **kept)
    with pytest.raises(NumericalError, match="state flux of the linear drive"):
        tones.linear_steady_state(replace(loops, tick_system=strange), np.array([10.0]))


def test_a_drive_that_settles_slowly_has_a_coarser_grid_and_says_so(amber_map, monkeypatch) -> None:
    """Work is counted in ticks, so the same drive has the same map on every machine."""
    loops = assemble_loops(AMBER)
    whole = limit_shift(AMBER, loops, count=6)
    assert not amber_map.coarser
    assert not whole.coarser
    monkeypatch.setattr(
        "analyses.large_signal.map.MOST_TICKS", amber_map.ticks // 20
    )  # each runs twice as long at least
    two_thirds = (ROUNDS + 2) * tones.work_ticks(AMBER, loops, 6) * 2 // 3 + 1
    monkeypatch.setattr("analyses.large_signal.result.MOST_TICKS", two_thirds)
    shift = limit_shift(AMBER, loops, count=6)
    assert shift.coarser
    assert shift.frequency_hz.size == 4
    assert shift.frequency_hz[[0, -1]] == pytest.approx(whole.frequency_hz[[0, -1]], rel=1e-12)
    small = mapped(AMBER, (17, 16))
    assert small.coarser
    assert small.cause.size < 0.2 * amber_map.cause.size
    assert small.ticks < amber_map.ticks / 4  # what is not steady is run again, longer


def without_friction(design: Design) -> Design:
    """A drive with its spring, and nothing that is not linear but its limits."""
    sharp = {"counts_per_rev": None}
    rubbing = {"dry_torque_Nm": 0.0, "points": (), "load_coefficient": 0.0, "offset_torque_Nm": 0.0}
    load, tight = {"friction": None, "gravity": None, "path": "back-drivable"}, {"play_rad": 0.0}
    return changed(design, friction=rubbing, load=load, coupling=tight, encoder=sharp, output_encoder=sharp)


def small(design: Design, size: float = 1e-7) -> Design:
    return changed(design, validation={"full_deflection_rad": size, "amplitude_fractions": (1.0,)})


def jerky(design: Design) -> Design:
    """With a command whose jerk is limited: n = 2 a/(j T) = 25 samples."""
    jerk = 200.0 / (25.0 * design.controller.position_loop.every * design.controller.period_s)
    return changed(design, command=Command(acceleration_rad_s2=100.0, jerk_rad_s3=jerk, filter_time_s=2e-3))


SHIPPED = {name: load_design(name) for name in ("ballscrew", "joint", "fin", "ilr33-amber-compliant")}
MADE = {"drive F": drive_f(), "behind a profile": jerky(drive_f())}
SPRINGS = {name: without_friction(design) for name, design in (SHIPPED | MADE).items()}


@pytest.mark.parametrize("name", SPRINGS)
def test_small_sines_are_the_linear_curve_of_the_output(name: str) -> None:
    """Against the response of the loops, times the mean of n samples added up one by one."""
    design = small(SPRINGS[name])
    result, loops = mapped(design), assemble_loops(design)
    path, command = loops.reference_to_output, design.command
    z, samples = np.exp(2j * np.pi * result.frequency_hz * path.dt), 1
    if np.isfinite(command.jerk_rad_s3):
        samples = round(2.0 * command.acceleration_rad_s2 / (command.jerk_rad_s3 * path.dt))
    linear = path(z) * np.mean([z**-k for k in range(samples)], axis=0)
    np.testing.assert_allclose(result.response / result.linear[None, :], 1.0, atol=1e-6)
    # the loops see a slower position loop's updates only, where images of the tone lie as well
    every = design.controller.position_loop.every
    np.testing.assert_allclose(result.linear / (linear if every == 1 else 1.0),
                               1.0 if every == 1 else linear, atol=1e-6)  # fmt: skip
    assert {CAUSES[k] for k in result.cause.ravel()} == {"none"}


@pytest.mark.parametrize(("name", "stage", "hz"), [("fin", "velocity", 12.0), ("joint", "current", 3.0)])
def test_a_full_triangle_of_a_loop_without_an_integral_is_that_of_a_run_from_rest(
    name: str, stage: str, hz: float
) -> None:
    """A P loop has no integral that a run could begin with: it would keep it (fin at 12 Hz: 6 % low)."""
    bare = {"command": Command(), "limits": {"peak_time_s": None, "acceleration_rad_s2": np.inf}}
    design = changed(load_design(name), controller={stage: {"integral_time_s": None}}, **bare)
    one, full = tones.tone(hz, design), np.array([design.validation.full_deflection_rad])
    assert one.omega_rad_s * full[0] > FULL_TRIANGLE * design.limits.speed_rad_s / design.total_ratio
    start = tones.linear_steady_state(assemble_loops(design), np.array([one.omega_rad_s]))
    run = tones.tone_rows(design, (one,), np.zeros(1, dtype=int), full, start, np.zeros(1)).run()
    rest = simulate(
        design, commands.sine(full[0], one.frequency_hz), 40 * one.ticks * design.controller.period_s
    )
    turn = np.exp(-2j * np.pi * one.cycles * np.arange(one.ticks) / one.ticks)
    seen = 2.0 * abs(np.mean(rest.output_angle_rad[-one.ticks :] * turn))
    assert abs(run.phasor("output_angle_rad")[0]) == pytest.approx(seen, rel=1e-3)


def test_no_sine_begins_in_a_triangle_that_the_torque_cannot_turn() -> None:
    """A train of parabolas of the acceleration a has the speed a T/4, here 1 % above the limit, and below."""
    design = changed(AMBER, limits={"acceleration_rad_s2": np.inf})
    limits, rows = design.limits, Rows.of(design, 2)
    push = design.motor.torque_constant_Nm_A * limits.peak_current_A / design.inertia_kgm2
    rows.sine("command", 1.0, push / (4.0 * limits.speed_rad_s * np.array([1.01, 0.99])))
    tones.triangle_start(design, rows, np.full(2, 10.0), np.ones(2, dtype=bool))
    assert list(rows["speed_start"]) == [limits.speed_rad_s, 0.0]


def test_the_bandwidth_of_the_map_is_that_of_the_output() -> None:
    """Behind a soft spring, where the motor's side has another."""
    design = small(without_friction(changed(drive_f(), coupling={"stiffness_Nm_rad": 3.0})))
    bode = amplitude_bode(design, assemble_loops(design), mapped(design, (2, 40)))
    np.testing.assert_allclose(bode.minus3db_hz, bode.linear_minus3db_hz, rtol=1e-5)


@pytest.mark.parametrize(("change", "cause"), [
    ({}, "other"),  # play
    ({"coupling": {"play_rad": 0.0}, "friction": Friction(dry_torque_Nm=5e-3)}, "friction"),
])  # fmt: skip
def test_cells_are_named_after_friction_only_where_it_acts(change: dict[str, Any], cause: str) -> None:
    causes = {CAUSES[k] for k in mapped(small(changed(drive_f(), **change), 0.02), (6, 8)).cause.ravel()}
    assert cause in causes
    assert causes & {"friction", "other"} == {cause}
