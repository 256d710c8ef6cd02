"""A loop over one period of the drive, and the mean that limits the jerk of a command."""

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest

from actuator_lti.design import load_design, with_values
from actuator_lti.drive.profile import CommandMean, profile_note
from actuator_lti.loops import PeriodicLoop, assemble_loops, exact_margins, periodic_loop
from actuator_lti.systems.resolvent import responses
from analyses.linear.loop_figures import all_loop_figures
from nonlinear.bench.operating_motion import on_its_stand, on_the_bench
from tests.validation.random_drives import full_drive

SYSTEMS = [  # of one state, by turns
    (np.array([[0.9]]), np.array([[0.3]]), np.array([[1.0]])),
    (np.array([[0.7]]), np.array([[0.1]]), np.array([[2.0]])),
    (np.array([[1.1]]), np.array([[0.2]]), np.array([[0.5]])),
]


@pytest.mark.parametrize("angle", [0.01, 0.4, 2.9])
def test_the_fundamental_is_that_of_a_long_run(angle: float) -> None:
    """e = d - y tick by tick, by hand, until it is steady; T is what y holds of ``exp(j angle k)``."""
    x, turns, y = 0.0 + 0.0j, np.exp(1j * angle * np.arange(3 * 400)), []
    for k, d in enumerate(turns):
        A, B, C = (part.item() for part in SYSTEMS[k % 3])
        y.append(C * x)
        x = A * x + B * (d - C * x)
    T = np.mean(np.array(y)[-300:] / turns[-300:])
    L = PeriodicLoop(SYSTEMS, 1.0)(np.exp(1j * angle))
    assert complex(L) == pytest.approx(T / (1.0 - T), rel=1e-12)


def test_its_modes_are_those_of_a_product() -> None:
    wanted = (0.9 - 2.0 * 0.3) * (0.7 - 2.0 * 0.2) * (1.1 - 2.0 * 0.1)
    assert PeriodicLoop(SYSTEMS, 1.0).modes(2.0) == pytest.approx([wanted], rel=1e-14)


@pytest.mark.parametrize("point", ["u", "i_ref", "w_ref"])
def test_the_time_invariant_system_of_the_fundamental_says_the_same(point: str) -> None:
    loops = assemble_loops(load_design("ilr33-amber-multirate"))
    z = np.exp(1j * np.geomspace(1e-4, 3.1, 40))
    whole = responses(loops.break_points[point].plain_open, z)
    np.testing.assert_allclose(periodic_loop(loops, point)(z), whole, rtol=1e-8)


def test_a_slow_filter_of_the_command_moves_no_margin() -> None:
    """The border of the current loop is not moved by what stands in front of it."""
    design = load_design("ilr33-amber")
    slow = with_values(design, {"command.filter_time": 1000.0, "command.filter_order": 2}, check=False)
    plain, filtered = (exact_margins(assemble_loops(one), "u") for one in (design, slow))
    assert filtered.gain_upper == pytest.approx(plain.gain_upper, rel=1e-9)
    assert filtered.delay_s == pytest.approx(plain.delay_s, rel=1e-9)


@pytest.mark.parametrize(("seed", "gain"), [(90004, 6.1718), (90006, 4.5869)])
def test_a_rest_that_an_integral_holds_is_no_border(seed: int, gain: float) -> None:
    """A damped load on a spring (or a pendulum): rounding of its rest was taken for a border at 1.145."""
    found = exact_margins(assemble_loops(on_its_stand(on_the_bench(full_drive(seed)))), "u")
    assert found.gain_upper == pytest.approx(gain, rel=1e-4)  # what runs in time show
    assert found.spectral_radius < 0.999


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
