"""What a simulation ended in: said in words where it is not rest on the command."""

import re
from dataclasses import replace
from math import radians

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design import with_values
from analyses.motion import Asked, Motion
from analyses.motion.settling import conduct, outcome, settle
from nonlinear import commands, simulate
from nonlinear.settling.rest import PERIODS
from reports.sections.simulate import section

AMBER = load_design("ilr33-amber")


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


@pytest.mark.parametrize(("millionths", "verdict"), [(0.5, "at rest"), (2.0, "limit cycle")])
def test_a_swing_too_small_to_count_is_rest_for_all_who_ask(millionths: float, verdict: str) -> None:
    """The joint hunts by its counts; beside a full deflection of two or half a million such swings."""
    joint, step = load_design("joint"), 1e-3
    run = simulate(joint, commands.step(step), 0.5)
    swing = settle(joint, 0.0, step).swing_rad
    full = 1e6 * swing / millionths
    design = replace(joint, validation=replace(joint.validation, full_deflection_rad=full))
    assert settle(design, 0.0, step).rest.verdict == "limit cycle"  # as the drive moves, whoever looks
    assert outcome(design, 0.0, step).rest.verdict == verdict
    said, result = section(Motion(design, Asked(), run)), conduct(run, full)
    assert result.status == ("comes to rest" if verdict == "at rest" else verdict)
    assert result.detail.startswith("a swing of ±") == (verdict == "at rest")
    assert result.status in said["result"]
    assert said["status"] == ("info" if result.wanted else "warn")


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


def test_the_command_line_says_it(cli) -> None:
    """In the figures that passages through the middle of a long run give."""
    arguments = ["simulate", "--amplitude", "3", "--duration", "0.5", "--quiet"]
    arguments += ["--set", "control.position.gain=4000 1/s"]
    assert "status limit cycle (" in cli.text(*arguments)
    facts = cli.data(*arguments)
    assert facts["status"] == "limit cycle"
    found = re.fullmatch(
        r"±(\S+) deg at (\S+) Hz \((\d+) periods seen, (.*) limit acting\)", facts["status_detail"]
    )
    run = simulate(with_values(AMBER, {"control.position.gain": 4000.0}), commands.step(radians(3.0)), 4.0)
    late = np.degrees(run.output_angle_rad[run.time_s.size // 2 :])
    above = late > 0.5 * (late.max() + late.min())
    passages = np.flatnonzero(above[1:] & ~above[:-1]) * run.period_s
    assert float(found[1]) == pytest.approx(0.5 * np.ptp(late), rel=5e-3)  # of three digits
    assert float(found[2]) == pytest.approx(1.0 / np.diff(passages).mean(), rel=5e-3)
    assert int(found[3]) >= PERIODS
    acting = [name for name, use in run.limits.items() if use.fraction > 0.0]
    assert found[4].split(" and ") == acting


@pytest.mark.parametrize(
    ("gain", "command", "status"),
    [
        (None, commands.step(0.02), "info"),
        (None, commands.sine(0.01, 5.0), "info"),
        (4000.0, commands.step(0.05), "warn"),
    ],
)
def test_only_what_nobody_wants_is_marked(gain: float | None, command: commands.Command, status: str) -> None:
    design = AMBER if gain is None else with_values(AMBER, {"control.position.gain": gain})
    assert section(Motion(design, Asked(), simulate(design, command, 0.3)))["status"] == status
