"""Cross-check: the assembled sampled loops are sections 2, 6 and 7 of model.md run tick by tick or period."""

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest
from loop_designs import drive_d, emps
from own_laws import laid_bare
from recursion import run

from actuator_lti import assemble_loops
from actuator_lti.design import load_design, model, with_values
from actuator_lti.drive.profile import CommandMean, profile_note
from actuator_lti.loops import PeriodicLoop, exact_margins, periodic_loop
from actuator_lti.loops.periodic import GAINS, first_limit
from actuator_lti.loops.tick import Block, mean_response
from actuator_lti.systems.resolvent import responses
from analyses.linear.loop_figures import all_loop_figures
from nonlinear.bench.operating_motion import on_its_stand, on_the_bench
from tests.validation.random_drives import full_drive
from tests.validation.rich_drives import rich_drive

UNITS = {"position": 1.0, "velocity": 30.0, "current": 2.0, "voltage": 1.0}
CONTACTS = {"driving": 1.0, "driven": -1.0}


def worst(ours: np.ndarray, theirs: np.ndarray, beside: float = 0.0) -> float:
    """The largest error over the largest value, or over what rounds it."""
    return float(np.max(np.abs(ours - theirs)) / max(np.max(np.abs(theirs)), beside))


def agree(design: model.Design, ticks: int, tolerance: float, point: str = "sliding", torque: float = 0.0,
          start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:  # fmt: skip
    """Same command, a constant moment and torque: every signal to a part of its largest value.

    The output's angle to a part of the motor's: it is what the twist, known to rounding, leaves of that.
    """
    t = np.arange(ticks)
    command = UNITS[design.controller.outermost] * (0.2 * np.sin(t / 40) + 1e-3 * t)
    theirs = run(design, command, torque, 0.3, CONTACTS.get(point, 1.0), start)
    system = assemble_loops(design, operating_point=point).tick_system
    named = {name: v for name, v in zip(("i", "w", "th"), start, strict=True) if name in system.states}
    ours = system.respond(command, torque, system.initial_state(named), 0.3)
    motor = float(np.max(np.abs(theirs["th"]))) / design.ratio_to_coupling
    for name in ("th", "w", "u", "phi") if design.coupling is not None else ("th", "w", "u"):
        assert worst(ours[name], theirs[name], motor if name == "phi" else 0.0) < tolerance, name


OPEN = replace(drive_d(), controller=model.Controller(period_s=1e-4, computing_delay_s=1.5e-4))
MOVED = {"torque": -20.0, "start": (0.0, 0.02, 0.001)}
KINDS = {"open-loop voltage": (OPEN, {}), "force source": (emps(delay_s=5e-4), MOVED)}


@pytest.mark.parametrize("name", KINDS)
def test_drives_that_are_not_drawn(name: str) -> None:
    design, moved = KINDS[name]
    agree(design, 4000, 1e-9, **moved)


@pytest.mark.parametrize("seed", range(48))
def test_any_drive_from_any_start_driving_and_driven(seed: int) -> None:
    """Any stage outermost, any plant, delay and speed estimate, any slot of the controller, over decades."""
    design = laid_bare(rich_drive(seed, own_law=False))
    for point in CONTACTS if design.coupling is not None else ("sliding",):
        agree(design, 120, 1e-9, point, torque=-2.25e-3, start=(0.5, 40.0, 0.0))


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


@pytest.mark.parametrize("above", [1e-4, 1e-6, 1e-9])
def test_a_border_is_found_however_narrow_what_lies_behind_it(above: float) -> None:
    """The mode over a period is (1 + above) g (6 - g)/9: beyond 1 near g = 3 alone, and then from 7.24 on."""
    size = (1.0 + above) / 9.0
    first, second = ((np.array([[a]]), np.array([[b]]), np.eye(1)) for a, b in ((0.0, -size), (6.0, 1.0)))
    loop = PeriodicLoop([first, second], 1.0)
    assert loop.radius(1.0) == pytest.approx(5.0 * size, rel=1e-14)
    upper = first_limit(lambda g: loop.radius(g) - 1.0, GAINS, inf, 50)
    assert upper == pytest.approx(3.0 * (1.0 - sqrt(above / (1.0 + above))), rel=1e-7)


@pytest.mark.parametrize("point", ["u", "i_ref", "w_ref"])
def test_the_time_invariant_system_of_the_fundamental_says_the_same(point: str) -> None:
    loops = assemble_loops(load_design("ilr33-amber-multirate"))
    z = np.exp(1j * np.geomspace(1e-4, 3.1, 40))
    whole = responses(loops.break_points[point].plain_open, z)
    np.testing.assert_allclose(periodic_loop(loops, point)(z), whole, rtol=1e-8)


@pytest.mark.parametrize("late", [5, 40, 150])
def test_a_response_behind_many_samples_of_delay_keeps_its_digits(late: int) -> None:
    """z^-d/(z - a) + z^-d/(z - b), alone and stacked, with states of very different size."""
    chain = np.eye(late, k=-1)
    A = np.block([[np.diag([0.5, 0.999]), np.zeros((2, late))], [np.zeros((late, 2)), chain]])
    A[:2, -1] = 1.0, 1e6
    B, C = np.zeros((late + 2, 1)), np.zeros((1, late + 2))
    B[2], C[0, :2] = 1.0, (1.0, 1e-6)
    z = np.exp(1j * np.geomspace(1e-4, 3.1, 60))
    truth = z**-late * (1.0 / (z - 0.5) + 1.0 / (z - 0.999))
    D = np.zeros((1, 1))
    np.testing.assert_allclose(responses(Block(A, B, C, D, ()), z), truth, rtol=1e-12)
    both = (np.stack([A, A])[:, None], B, np.stack([C, 2.0 * C])[:, None], D)
    found = mean_response([both], z[:, None, None])[..., 0, 0]
    np.testing.assert_allclose(found, [truth, 2.0 * truth], rtol=1e-12)


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
