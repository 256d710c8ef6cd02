"""What a simulation ended in: said in words where it is not rest on the command."""

import re
from math import radians

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.motion import Asked, Motion
from analyses.motion.settling import conduct, outcome, settle
from nonlinear import commands, simulate
from nonlinear.settling.rest import PERIODS
from reports.sections.simulate import section
from tests.changed import changed

AMBER = load_design("ilr33-amber")
LOUD = changed(AMBER, controller={"position": {"gain": 4000.0}})  # beyond the gain margin
PEAK_NM = AMBER.limits.peak_current_A * (AMBER.motor.torque_constant_Nm_A or 0.0)
STEP, SINE = commands.step(0.02), commands.sine(0.01, 5.0)


@pytest.mark.parametrize(
    ("parts", "command", "duration_s", "ends"),
    [
        ({}, STEP, 0.02, "comes to rest"),  # what a step ends in is no matter of the run
        ({}, STEP, 0.4, "comes to rest"),
        ({"instruments": {"current_noise_A": 0.05}}, STEP, 0.3, "comes to rest"),  # noise is no limit cycle
        ({}, SINE, 0.5, "following"),
        ({}, commands.ramp(1.75), 1.0, "following"),  # 100 deg/s, of which the motor gives 22.7
        # limits hold the growing oscillation: it neither dies out nor runs away
        ({"controller": LOUD.controller}, commands.step(0.05), 0.5, "limit cycle"),
        # the rotor stays, the current is at its limit
        ({"friction": {"dry_torque_Nm": 2.0 * PEAK_NM}}, commands.step(0.1), 0.5, "sits on a limit"),
    ],
)
def test_what_a_run_ends_in_and_only_what_nobody_wants_is_marked(parts, command, duration_s, ends):
    design = changed(AMBER, **parts)
    run = simulate(design, command, duration_s)
    result = conduct(run)
    assert result.status == ends
    assert ("Hz" in result.detail) == (ends == "limit cycle")
    assert (result.detail == "") is (ends == "comes to rest")
    assert ("limited, of the time: speed 99" in result.detail) is (command.kind == "ramp")
    assert bool(result.later) == (duration_s == 0.02)  # 20 ms into a step that takes longer
    wanted = ends in ("comes to rest", "following")
    assert section(Motion(design, Asked(), run))["status"] == ("info" if wanted else "warn")


def test_a_period_longer_than_the_run_is_seen_beyond_it(cli) -> None:
    """The joint hunts in minutes after 3 deg: two periods at 0.00478 Hz are 418 s, the run is 0.3 s."""
    said = cli.data("simulate", "joint", "--amplitude", "3 deg", "--duration", "0.3")["status_detail"]
    words = r"followed for (\S+) s beyond the run; ±.* at (\S+) Hz \((\d+) periods seen\)"
    beyond, hertz, periods = re.fullmatch(words, said).groups()
    assert float(beyond) > int(periods) / float(hertz) > 100.0


@pytest.mark.parametrize(("millionths", "verdict"), [(0.5, "at rest"), (2.0, "limit cycle")])
def test_a_swing_too_small_to_count_is_rest_for_all_who_ask(millionths: float, verdict: str) -> None:
    """The joint hunts by its counts; beside a full deflection of two or half a million such swings."""
    joint, step = load_design("joint"), 1e-3
    run = simulate(joint, commands.step(step), 0.5)
    swing = settle(joint, 0.0, step).swing_rad
    full = 1e6 * swing / millionths
    design = changed(joint, validation={"full_deflection_rad": full})
    assert settle(design, 0.0, step).rest.verdict == "limit cycle"  # as the drive moves, whoever looks
    assert outcome(design, 0.0, step).rest.verdict == verdict
    said, result = section(Motion(design, Asked(), run)), conduct(run, full)
    assert result.status == ("comes to rest" if verdict == "at rest" else verdict)
    assert result.detail.startswith("a swing of ±") == (verdict == "at rest")
    assert result.status in said["result"]
    assert said["status"] == ("info" if result.wanted else "warn")


def test_the_command_line_says_it(cli) -> None:
    """In the figures that passages through the middle of a long run give."""
    arguments = ["simulate", "--amplitude", "3", "--duration", "0.5", "--quiet"]
    arguments += ["--set", "control.position.gain=4000 1/s"]
    assert "status limit cycle (" in cli.text(*arguments)
    facts = cli.data(*arguments)
    assert facts["status"] == "limit cycle"
    words = r"±(\S+) deg at (\S+) Hz \((\d+) periods seen, (.*) limit acting\)"
    found = re.fullmatch(words, facts["status_detail"])
    run = simulate(LOUD, commands.step(radians(3.0)), 4.0)
    late = np.degrees(run.output_angle_rad[run.time_s.size // 2 :])
    above = late > 0.5 * (late.max() + late.min())
    passages = np.flatnonzero(above[1:] & ~above[:-1]) * run.period_s
    assert float(found[1]) == pytest.approx(0.5 * np.ptp(late), rel=5e-3)  # of three digits
    assert float(found[2]) == pytest.approx(1.0 / np.diff(passages).mean(), rel=5e-3)
    assert int(found[3]) >= PERIODS
    acting = [name for name, use in run.limits.items() if use.fraction > 0.0]
    assert found[4].split(" and ") == acting
