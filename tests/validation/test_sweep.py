"""Frequency response by injection meets the assembled loops: asked for 0.01 dB, 0.1 deg to Nyquist/3."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import InputError, assemble_loops, load_design
from analyses.validation import sweep as module
from analyses.validation.at_rest import free_amplitude, sweep_from_rest
from analyses.validation.coherent import coherent, hold_factor
from analyses.validation.response import sweep_errors
from analyses.validation.sweep import frequency_response, stepped_sine
from analyses.validation.tones import multisine_response
from nonlinear.loop_setup import LoopSetup, loop_setup
from nonlinear.operating_motion import operating_motion_at

DESIGNS = ("ilr33-amber", "ilr33-amber-multirate")
LOOPS = ("current", "velocity", "position", "u", "i_ref", "w_ref", "output")


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("loop", LOOPS)
def test_every_loop_and_break_point_up_to_a_third_of_nyquist(name: str, loop: str) -> None:
    design = load_design(name)
    loops = assemble_loops(design)
    linear = loops.present.get(loop) or loops.break_points[loop]
    sweep = frequency_response(design, loop, np.geomspace(3.0, 0.5 / 3.0 / linear.period_s, 25))
    assert sweep.valid.all()
    assert sweep.speed_rad_s > 100.0  # on its operating motion
    for response in ("open_loop", "closed_loop", "sensitivity"):
        errors = sweep_errors(sweep, linear, response)
        # the simulator is exact: a hundredth of what is asked for, limited by what has not died out
        assert errors.worst_gain_db < 1e-4, response
        assert errors.worst_phase_deg < 1e-3, response


@pytest.mark.parametrize("name", ["ctms-motor-position", "emps"])
def test_other_drives(name: str) -> None:
    design = load_design(name)
    for loop, linear in assemble_loops(design).present.items():
        sweep = frequency_response(design, loop, np.geomspace(1.0, 0.5 / 3.0 / linear.period_s, 12))
        errors = sweep_errors(sweep, linear)
        assert sweep.valid.all()
        assert errors.worst_gain_db < 1e-6
        assert errors.worst_phase_deg < 1e-5


def test_a_wrong_loop_is_seen() -> None:
    """The gate can fail: a tenth of a tick more delay in the linear loop is far outside the tolerance."""
    design = load_design("ilr33-amber")
    control = design.controller
    slower = replace(control, computing_delay_s=control.computing_delay_s + 0.1 * control.period_s)
    linear = assemble_loops(replace(design, controller=slower)).current
    errors = sweep_errors(frequency_response(design, "current", [1500.0]), linear)
    assert errors.worst_phase_deg > 0.1


def test_plant_response_of_the_same_run() -> None:
    """L is the controller times the plant that the same run measured (single rate)."""
    design = load_design("ilr33-amber")
    result = frequency_response(design, "velocity", [20.0, 80.0, 400.0])
    velocity = design.controller.velocity
    T, z = result.period_s, np.exp(2j * np.pi * result.frequency_hz * result.period_s)
    controller = velocity.gain * (1.0 + T / velocity.integral_time_s * z / (z - 1.0))
    assert np.abs(controller * result.plant / result.open_loop - 1.0).max() < 1e-6


def test_amplitudes_keep_clear_of_limits_and_reversal() -> None:
    design = load_design("ilr33-amber")
    sweep = frequency_response(design, "position", np.geomspace(5.0, 300.0, 8))
    assert sweep.valid.all()
    # large enough to be measured on a bench: the speed moves by several percent of the operating motion
    moved = np.abs(sweep.plant * sweep.sensitivity) * sweep.amplitude
    assert moved.max() > 0.05 * sweep.speed_rad_s


def test_a_point_that_has_not_settled_is_not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rule H3: two windows that differ are not called steady; extended, the same point is."""
    setup = loop_setup(load_design("ilr33-amber"), "velocity")
    monkeypatch.setattr(module, "EXTENSIONS", 0)
    hasty = stepped_sine(setup, np.array([150.0]), 1)
    assert hasty.reason == ("not steady",)
    assert np.isnan(hasty.open_loop).all()
    assert hasty.unsteadiness[0] > module.STEADY
    monkeypatch.setattr(module, "EXTENSIONS", 5)
    patient = stepped_sine(setup, np.array([150.0]), 50)
    assert patient.reason == ("",)


def test_a_limit_that_acts_is_not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    setup = loop_setup(load_design("ilr33-amber"), "velocity")
    monkeypatch.setattr(module, "EXTENSIONS", 0)
    loud = stepped_sine(setup, np.array([150.0]), 2000, amplitude=np.array([30.0]))
    assert loud.reason == ("current limit",)
    monkeypatch.setattr(module, "EXTENSIONS", 3)
    adjusted = stepped_sine(setup, np.array([150.0]), 2000, amplitude=np.array([30.0]))
    assert adjusted.reason == ("",)
    assert adjusted.amplitude[0] < 30.0


def test_a_reversal_is_not_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """A operating motion so slow that a sine which no limit notices turns the rotor back."""
    design = load_design("ilr33-amber")
    setup = LoopSetup(design, "position", operating_motion_at(design, 20.0))
    monkeypatch.setattr(module, "EXTENSIONS", 0)
    loud = stepped_sine(setup, np.array([60.0]), 2000, amplitude=np.array([60.0]))
    assert loud.reason == ("speed reversal",)


def test_distortion_is_that_of_the_signal() -> None:
    """Linear on the operating motion: nothing but the fundamental; with a limit acting: harmonics."""
    setup = loop_setup(load_design("ilr33-amber"), "velocity")
    clean = stepped_sine(setup, np.array([50.0]), 2000)
    assert clean.distortion[0] < 1e-5
    loud = stepped_sine(setup, np.array([50.0]), 2000, amplitude=np.array([60.0]))
    assert loud.reason == ("",)  # adjusted until no limit acts
    assert loud.distortion[0] < 1e-5


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("loop", ["current", "velocity", "position"])
def test_multisine(name: str, loop: str) -> None:
    design = load_design(name)
    linear = assemble_loops(design).present[loop]
    result = multisine_response(design, loop, np.geomspace(5.0, 0.5 / 3.0 / linear.period_s, 20), seed=3)
    errors = sweep_errors(result, linear)
    assert result.reason == ""
    assert errors.worst_gain_db < 1e-4
    assert errors.worst_phase_deg < 1e-3
    assert result.coherence.min() > 1.0 - 1e-6
    assert result.unsteadiness < 1e-6


@pytest.mark.parametrize("name", DESIGNS)
def test_from_rest_the_describing_function_holds(name: str) -> None:
    """Dry friction at every reversal: the describing function fits, the sliding loop does not."""
    design = load_design(name)
    f = np.geomspace(2.0, 40.0, 6)
    amplitude = free_amplitude(design, assemble_loops(design), f, 0.05)
    result = sweep_from_rest(design, f, amplitude, 4000)
    described, sliding = (
        20.0 * np.log10(np.abs(result.measured / line)) for line in (result.described, result.sliding)
    )
    assert np.abs(described).max() < 0.02  # a describing function neglects harmonics
    assert np.abs(np.degrees(np.angle(result.measured / result.described))).max() < 0.2
    assert np.abs(sliding).max() > 0.15
    assert not any(result.limiter)


def test_coherent_frequencies_fill_whole_ticks() -> None:
    result = coherent(np.geomspace(0.7, 1600.0, 30), 1e-4, base_ticks=10)
    assert (result.ticks % 10 == 0).all()
    assert np.allclose(result.frequency_hz * result.ticks * 1e-4, result.cycles, rtol=1e-14)
    assert np.abs(result.frequency_hz / np.geomspace(0.7, 1600.0, 30) - 1.0).max() < 1.3e-3


def test_hold_factor_is_that_of_a_held_sine() -> None:
    k = np.arange(4000)
    held = np.sin(2.0 * np.pi * 35.0 * (k // 8 * 8) * 1e-4)
    result = 2j * np.mean(held * np.exp(-2j * np.pi * 35.0 * k * 1e-4))
    # 4000 ticks hold 14 whole periods
    assert abs(result - hold_factor(35.0, 1e-4, 8)[0]) < 1e-12


@pytest.mark.parametrize("bad", [[0.0], [-1.0], [6000.0], [float("nan")], []])
def test_bad_frequencies(bad: list[float]) -> None:
    with pytest.raises(InputError, match="Nyquist"):
        frequency_response(load_design("ilr33-amber"), "current", bad)


def test_unknown_loop() -> None:
    with pytest.raises(InputError, match="one of current, velocity"):
        frequency_response(load_design("ilr33-amber"), "torque", [10.0])
    with pytest.raises(InputError, match="one of position, u, output"):
        frequency_response(load_design("ctms-motor-position"), "i_ref", [10.0])
    with pytest.raises(InputError, match="one of current"):
        multisine_response(load_design("ilr33-amber"), "u", [10.0])
