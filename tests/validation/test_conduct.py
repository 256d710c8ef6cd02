"""What a simulation ended in: said in words where it is not rest on the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from actuator_lti import load_design
from analyses.conduct import conduct
from nonlinear import commands, simulate
from reports.cli.main import main

AMBER = load_design("ilr33-amber")
CONDITIONAL = Path(__file__).with_name("conditional.toml")


@pytest.mark.parametrize("duration", [0.02, 0.4])
def test_what_a_step_ends_in_is_no_matter_of_the_run(duration: float) -> None:
    result = conduct(simulate(AMBER, commands.step(0.02), duration))
    assert (result.status, result.detail) == ("comes to rest", "")


def test_a_linear_loop_beyond_its_gain_margin_keeps_oscillating() -> None:
    """Limits hold the growing oscillation: it neither dies out nor runs away."""
    control = AMBER.controller
    loud = replace(AMBER, controller=replace(control, position=replace(control.position, gain=4000.0)))
    result = conduct(simulate(loud, commands.step(0.05), 0.5))
    assert result.status == "limit cycle"
    assert "Hz" in result.detail


def test_a_drive_that_is_held_sits_on_its_limit() -> None:
    """Dry friction beyond the torque of the current limit: the rotor stays, the current is at its limit."""
    limits = AMBER.limits
    most = limits.peak_current_A * (AMBER.motor.torque_constant_Nm_A or 0.0)
    stuck = replace(AMBER, friction=replace(AMBER.friction, dry_torque_Nm=2.0 * most))
    result = conduct(simulate(stuck, commands.step(0.1), 0.5))
    assert result.status == "sits on a limit"


def test_a_sine_is_followed() -> None:
    assert conduct(simulate(AMBER, commands.sine(0.01, 5.0), 0.5)).status == "following"


def test_noise_is_no_limit_cycle() -> None:
    noisy = replace(AMBER, instruments=replace(AMBER.instruments, current_noise_A=0.05))
    assert conduct(simulate(noisy, commands.step(0.02), 0.3)).status == "comes to rest"


def test_the_command_line_says_it(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "--amplitude", "3", "--duration", "0.5", "--quiet"]
    arguments += ["--set", "control.position.gain=4000 1/s"]
    assert main(arguments) == 0
    assert "status limit cycle (" in capsys.readouterr().out
    assert main([*arguments, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["status"] == "limit cycle"
    assert facts["status_detail"].startswith("±0.16 deg at 16.2 Hz (9 periods seen")
