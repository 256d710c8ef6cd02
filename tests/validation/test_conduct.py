"""What a simulation ended in: said in words where it is not rest on the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.conduct import conduct
from nonlinear import Trajectory, commands, simulate
from reports.cli.main import main

AMBER = load_design("ilr33-amber")
CONDITIONAL = Path(__file__).with_name("conditional.toml")


def test_a_step_that_settles_is_ok() -> None:
    result = conduct(simulate(AMBER, commands.step(0.02), 0.4))
    assert (result.status, result.detail) == ("ok", "")


def test_a_step_cut_on_its_way_has_not_settled() -> None:
    assert conduct(simulate(AMBER, commands.step(0.02), 0.02)).status == "has not settled"


def test_a_linear_loop_beyond_its_gain_margin_keeps_oscillating() -> None:
    """Limits hold the growing oscillation: it neither dies out nor runs away."""
    control = AMBER.controller
    loud = replace(AMBER, controller=replace(control, position=replace(control.position, gain=4000.0)))
    result = conduct(simulate(loud, commands.step(0.05), 0.5))
    assert result.status == "keeps oscillating"
    assert "Hz" in result.detail


def test_a_drive_that_is_held_sits_on_its_limit() -> None:
    """Dry friction beyond the torque of the current limit: the rotor stays, the current is at its limit."""
    limits = AMBER.limits
    most = limits.peak_current_A * (AMBER.motor.torque_constant_Nm_A or 0.0)
    stuck = replace(AMBER, friction=replace(AMBER.friction, dry_torque_Nm=2.0 * most))
    result = conduct(simulate(stuck, commands.step(0.1), 0.5))
    assert result.status == "sits on a limit"


def test_following_a_sine_is_no_oscillation() -> None:
    assert conduct(simulate(AMBER, commands.sine(0.01, 5.0), 0.5)).status == "ok"


def _swinging(swing: np.ndarray) -> Trajectory:
    """A run of a second whose output ends in a given deviation from 1 rad."""
    run = simulate(AMBER, commands.step(1.0), 1.0, limits_on=False)
    n = run.time_s.size
    output = np.where(np.arange(n) < n // 8, np.linspace(0.0, 8.0, n), 1.0) + swing
    return replace(run, output_angle_rad=np.where(np.arange(n) < n // 8, output, 1.0 + swing))


@pytest.mark.parametrize("amplitude", [0.02, 2.5e-3, 5e-4])
def test_stick_slip_of_two_and_a_half_periods_is_an_oscillation(amplitude: float) -> None:
    """Jumps between two places of rest, 5 Hz: the last quarter holds little more than a period."""
    time = np.arange(10_000) * 1e-4
    result = conduct(_swinging(amplitude * np.sign(np.sin(2.0 * np.pi * 5.0 * time + 0.3))))
    assert result.status == "keeps oscillating"
    size, hertz = result.detail.split(" deg at ")
    assert float(size) == pytest.approx(np.degrees(amplitude), rel=0.01)
    assert float(hertz.removesuffix(" Hz")) == pytest.approx(5.0, rel=0.01)


def test_noise_is_no_oscillation() -> None:
    noise = 1e-4 * np.random.default_rng(5).standard_normal(10_000)
    assert conduct(_swinging(noise)).status == "ok"


def test_the_command_line_says_it(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "--amplitude", "3", "--duration", "0.5", "--quiet"]
    arguments += ["--set", "control.position.gain=4000 1/s"]
    assert main(arguments) == 0
    assert "status keeps oscillating (" in capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["status"] == "keeps oscillating"
    assert facts["status_detail"].endswith("Hz")
