"""The map of large signals: its border against A_k(w), what acts, what the output looks like."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actuator_lti import NumericalError, assemble_loops, load_design, onset
from actuator_lti.design import shipped_designs, with_values
from actuator_lti.design.model import Command, Design, Friction
from analyses.friction_effects.breakaway import static_threshold
from analyses.large_signal import tones
from analyses.large_signal.classify import CAUSES, WAVEFORMS, causes, waveforms
from analyses.large_signal.map import AmplitudeMap, amplitude_bode, amplitude_map
from analyses.large_signal.result import ROUNDS, limit_shift
from tests.changed import changed
from tests.nonlinear.elastic_drive import drive_f

AMBER = load_design("ilr33-amber")


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
        result = tones.run_tones(AMBER, sines, which, amplitude, start, begin, friction_on=False)
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
    result = tones.run_tones(design, sines, np.array([0]), small, start, 0.0 * small)
    assert WAVEFORMS[waveforms(result)[0]] == "no motion"
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
    monkeypatch.setattr("analyses.large_signal.map.MOST_TICKS", amber_map.ticks // 9)
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
