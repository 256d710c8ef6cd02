"""Responses as they are drawn: of many states, at a pole, and the branch of the phase."""

from fractions import Fraction

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops, unwrapped_phase_deg
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.resolvent import solved_at
from analyses.linear.responses import LARGE, curve, nichols_curve, response_at

PERIOD_S = 1e-3
SIGNED = [(1, [1, 1]), (-1, [1, 1]), (1, [1, 0]), (-1, [1, 1, 0]), (1, [1, 1, 0, 0]), (1, [1, 1, 0, 0, 0])]
OMEGA = np.geomspace(1e-2, 1e3, 60)


def late_lag(pole: float, delay: int) -> PlainSystem:
    """z^-delay / (z - pole) as a chain of states."""
    n = delay + 1
    A = np.diag(np.ones(n - 1), -1)
    A[0, 0] = pole
    B, C = np.eye(n)[:, :1], np.eye(n)[-1:]
    return PlainSystem(A, B, C, np.zeros((1, 1)), PERIOD_S)


@pytest.mark.parametrize("delay", [3, LARGE - 2, LARGE + 40])
def test_a_delayed_lag_of_many_states(delay: int) -> None:
    omega = np.geomspace(1.0, 3000.0, 50)
    z = np.exp(1j * omega * PERIOD_S)
    assert response_at(late_lag(0.9, delay), omega) == pytest.approx(z**-delay / (z - 0.9), rel=1e-11)


@pytest.mark.parametrize("delay", [3, LARGE + 40])
def test_at_a_pole_it_is_infinite_and_nowhere_else(delay: int) -> None:
    omega = np.concatenate([[0.0], np.geomspace(1.0, 3000.0, 50)])
    values = response_at(late_lag(1.0, delay), omega)
    assert not np.isfinite(values[0])
    assert np.isfinite(values[1:]).all()


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-12, 1e-9, -1e-9])
def test_speed_against_a_spring_begins_at_90_deg_whatever_rounding_does_to_its_zero(off: float) -> None:
    """A zero at 1 + off: outside of the circle its phase begins at 180 deg, below any frequency drawn."""
    loop = control.tf([1.0, -1.0 - off], [1.0, -1.7, 0.72], PERIOD_S)
    phase = curve(loop, OMEGA).phase_deg
    assert phase[0] == pytest.approx(90.0, abs=1.0)
    assert (np.abs(np.diff(phase)) < 180.0).all()


def test_a_resonance_is_round_in_a_nichols_chart() -> None:
    """1/(s^2 + 0.01 s + 1): most of half a turn lies within 1 rad/s +- 1 %, two points of the coarse grid."""
    drawn = nichols_curve(control.tf([1.0], [1.0, 1e-2, 1.0]), np.geomspace(0.1, 10.0, 240), 60.0)
    assert np.abs(np.diff(drawn.phase_deg)).max() < 7.0
    assert np.abs(np.diff(drawn.magnitude_db)).max() < 1.01
    assert drawn.magnitude_db.max() == pytest.approx(40.0, abs=0.1)


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-12, -1e-12])
def test_what_rounding_leaves_of_a_zero_at_rest_turns_no_phase(off: float) -> None:
    """(z - 1)/((z - 0.8)(z - 0.9)): of z - 1 a quarter turn and half the angle, of z - p its angle."""
    omega = np.linspace(1e-3, 3000.0, 20_001)
    z = np.exp(1j * omega * PERIOD_S)
    expected = 0.5 * np.pi + 0.5 * omega * PERIOD_S - np.angle(z - 0.8) - np.angle(z - 0.9)
    loop = control.tf([1.0, -1.0 - off], [1.0, -1.7, 0.72], PERIOD_S)
    for form in (loop, control.ss(loop)):
        assert unwrapped_phase_deg(form, omega) == pytest.approx(np.degrees(expected), abs=1e-4)


@pytest.mark.parametrize("name", ["fin", "joint"])
def test_speed_of_a_held_load_begins_at_90_deg_and_never_jumps(name: str) -> None:
    """Against a load that springs back the speed at rest is none: a zero at z = 1."""
    loop = assemble_loops(name).velocity
    omega = np.linspace(1e-4, 0.9999, 5001) * np.pi / loop.open_loop.dt
    phase = unwrapped_phase_deg(loop.open_loop, np.append(1e-3, omega))
    assert phase[0] == pytest.approx(90.0, abs=0.1)
    assert (np.abs(np.diff(phase[1:])) < 180.0).all()


@pytest.mark.parametrize(("sign", "den"), SIGNED)
def test_integrators_and_signs_keep_their_branch(sign: float, den: list[float]) -> None:
    """A quarter turn for each integrator, half a turn for a sign."""
    begin = -90.0 * den.count(0.0) - (180.0 if sign < 0.0 else 0.0)
    assert curve(control.tf([sign], den), OMEGA * 1e-2).phase_deg[0] == pytest.approx(begin, abs=1.0)


@pytest.mark.parametrize("seed", range(40))
def test_each_equation_of_a_response_is_met_to_rounding_of_its_own_terms(seed: int) -> None:
    """Oettli and Prager's measure, in fractions: |b - M x| over |M| |x| + |b|, equation by equation.

    Rows and columns over decades; a plain elimination reaches 25 units of rounding.
    """
    rng = np.random.default_rng(seed)
    M = rng.standard_normal((6, 6)) * 10.0 ** rng.uniform(-6, 6, (6, 1)) * 10.0 ** rng.uniform(-3, 3, 6)
    b = rng.standard_normal(6) * 10.0 ** rng.uniform(-6, 6, 6)
    x = list(map(Fraction, solved_at(M[None], b[None, :, None])[0, :, 0].tolist()))
    for row, right in zip(M.tolist(), map(Fraction, b.tolist()), strict=True):
        terms = [Fraction(a) * each for a, each in zip(row, x, strict=True)]
        size = sum(map(abs, terms)) + abs(right)
        assert abs(right - sum(terms)) <= 2.0 * np.finfo(float).eps * size
