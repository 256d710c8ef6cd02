"""The mean that limits the jerk of a command: its response against the simulator, and the word about it."""

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest
from loop_designs import amber

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Command
from actuator_lti.drive.profile import CommandMean, command_mean, profile_note
from analyses.linear.loop_figures import all_loop_figures


def test_the_mean_is_what_the_running_drive_does_to_a_command() -> None:
    """Both runs are linear, so their ratio at the command's frequency is the mean's response."""
    from nonlinear import commands, simulate

    base = amber()
    base = replace(base, friction=replace(base.friction, dry_torque_Nm=0.0, load_coefficient=0.0))
    period = base.controller.position_loop.every * base.controller.period_s
    jerk = 2.0 * 50.0 / (40 * period)
    shaped = replace(base, command=Command(acceleration_rad_s2=50.0, jerk_rad_s3=jerk))
    mean = command_mean(shaped)
    assert mean == CommandMean(40, period)
    hertz = 25.0
    omega, count = 2 * pi * hertz, round(10.0 / hertz / period)
    angles = []
    for design in (base, shaped):
        run = simulate(design, commands.sine(1e-4, hertz), duration_s=0.8, limits_on=True)
        kept = run.output_angle_rad[-count:]
        angles.append(np.sum(kept * np.exp(-1j * omega * run.time_s[-count:])))
    assert angles[1] / angles[0] == pytest.approx(complex(mean.response(np.array(omega))), rel=1e-6)


def test_its_delay_and_bandwidth() -> None:
    """Two samples: (1 + z^-1)/2 = cos(w T/2) exp(-j w T/2), -3 dB at a quarter of the sampling rate."""
    mean = CommandMean(2, 1e-3)
    assert mean.minus3db_rad_s == pytest.approx(pi / 2 / 1e-3)
    assert mean.delay_s == 0.5e-3
    omega = np.array([0.0, 100.0, 2000.0])
    assert mean.response(omega) == pytest.approx(0.5 * (1 + np.exp(-1j * omega * 1e-3)))
    wide = CommandMean(1000, 1e-5)
    assert wide.minus3db_rad_s * 1e-2 == pytest.approx(2 * 1.39155737825, rel=1e-5)  # sin x = x/sqrt(2)
    assert abs(wide.response(np.array(wide.minus3db_rad_s))) == pytest.approx(sqrt(0.5))


def test_the_margins_say_what_the_response_to_the_command_leaves_out() -> None:
    design = load_design("ballscrew")
    figures = all_loop_figures(assemble_loops(design), step=False)
    assert any("command.jerk" in note for note in figures["position"].notes)
    assert not any("command.jerk" in note for note in figures["velocity"].notes)
    assert profile_note(replace(design, command=replace(design.command, jerk_rad_s3=inf))) == ""
