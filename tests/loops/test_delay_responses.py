"""Responses of loops with several delays, by the series of all ways round the loop; and as they are drawn."""

from fractions import Fraction
from itertools import pairwise
from math import factorial

import control
import flint
import numpy as np
import pytest

from actuator_lti import DelaySystem, assemble_loops, step_figures, unwrapped_phase_deg
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.resolvent import solved_at
from analyses.linear.responses import LARGE, curve, nichols_curve, response_at

Rational = tuple[np.ndarray, np.ndarray]
POINTS = 61
BENDS = (0, 10, 11, 25, 60)  # samples at which the input changes its slope


def random_loop(rng: np.random.Generator, feedthrough: bool) -> tuple[list[Rational], np.ndarray]:
    """Gains and lags of first and second order, each behind a delay of its own."""
    delays, parts = rng.uniform(0.3, 2.0, int(rng.integers(1, 4))), []
    for _ in delays:
        w, zeta = rng.uniform(0.5, 4.0), rng.uniform(0.1, 0.9)
        dens = ([1.0, 0.0], [1.0, rng.uniform(0.2, 5.0)], [1.0, 2.0 * zeta * w, w**2])
        den = np.array(dens[rng.integers(3)])
        num = rng.uniform(0.1, 0.8, den.size - 1) / delays.size
        if feedthrough:
            num = np.polyadd(num, rng.uniform(-0.8, 0.8) / delays.size * den)
        parts.append((num, den))
    return parts, delays


def in_powers(num: np.ndarray, den: np.ndarray) -> flint.arb_series:
    """num/den as a series in 1/s, of doubles taken exactly."""
    full = np.concatenate((np.zeros(len(den) - len(num)), num))
    return flint.arb_series([float(v) for v in full]) / flint.arb_series([float(v) for v in den])


def round_the_loop(parts: list[Rational], delays: np.ndarray, end: float) -> dict[float, flint.arb_series]:
    """By delay the sum of all products of -P_j that come by the end."""
    passes = [-in_powers(*part) for part in parts]
    found: dict[tuple[int, ...], flint.arb_series] = {}
    level = {(0,) * len(parts): flint.arb_series([1])}
    while level:
        found |= level
        longer: dict[tuple[int, ...], flint.arb_series] = {}
        for often, series in level.items():
            for j, once in enumerate(passes):
                key = tuple(k + (i == j) for i, k in enumerate(often))
                if np.dot(key, delays) <= end:
                    longer[key] = longer.get(key, 0) + series * once
        level = longer
    return {float(np.dot(often, delays)): series for often, series in found.items()}


def in_one_loop(parts: list[Rational], delays: np.ndarray) -> DelaySystem:
    loop = DelaySystem.from_system(0.0)
    for part, delay in zip(parts, delays, strict=True):
        loop += DelaySystem.from_system(control.tf(*part)) * DelaySystem.delay(delay)
    return loop


def truth(parts, delays, times, u, patch) -> np.ndarray:
    """Response of 1/(1 + L) to an input that jumps to its first value and is straight between its bends."""
    fastest, end = max(np.abs(np.roots(den)).max() for _, den in parts), times.max()
    patch.setattr(flint.ctx, "cap", int(4.0 * fastest * end) + 80)
    patch.setattr(flint.ctx, "prec", 900)
    y = np.zeros(times.size)
    slopes = [(u[b] - u[a]) / (times[b] - times[a]) for a, b in pairwise(BENDS)]
    changes = np.diff(slopes, prepend=0.0)
    begins = [(0.0, 0, u[0]), *((times[b], 1, k) for b, k in zip(BENDS, changes, strict=False))]
    for late, series in round_the_loop(parts, delays, end).items():
        for begin, order, size in begins:
            terms = [series[k] * size / factorial(k + order) for k in range(flint.ctx.cap)]
            response = flint.arb_poly(terms)
            for i in np.flatnonzero(times >= begin + late):
                t = flint.arb(times[i] - begin - late)
                y[i] += float(response(t) * t**order)
    return y


@pytest.mark.parametrize("feedthrough", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_loops_of_delays_without_a_common_measure(feedthrough, seed, monkeypatch):
    rng = np.random.default_rng([seed, feedthrough])
    parts, delays = random_loop(rng, feedthrough)
    times = np.linspace(0.0, rng.uniform(2.0, 6.0) * delays.max(), POINTS)
    u = np.interp(times, times[list(BENDS)], rng.uniform(-1.0, 1.0, len(BENDS)))
    closed = DelaySystem.from_system(1.0).feedback(in_one_loop(parts, delays))
    wanted = truth(parts, delays, times, u, monkeypatch)
    found = control.forced_response(closed, times, u).y
    assert np.ravel(found) == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())
    late = control.forced_response(closed, 2.0**20 + times, u).y  # a record's own clock
    assert np.ravel(late) == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())


@pytest.mark.parametrize("seed", range(5))
def test_step_figures_of_loops_of_delays_without_a_common_measure(seed: int, monkeypatch: pytest.MonkeyPatch):
    parts, delays = random_loop(np.random.default_rng([seed, 2]), False)
    f = step_figures(in_one_loop(parts, delays).feedback())
    early = np.flatnonzero(f.time_s < 4.0 * delays.max())
    special = [t for t in (f.peak_time_s, f.settling_time_s) if t < 4.0 * delays.max()]
    chosen = f.time_s[early[np.linspace(0, early.size - 1, POINTS).astype(int)]]
    times = np.concatenate((special, chosen))
    wanted = 1.0 - truth(parts, delays, times, np.ones(times.size), monkeypatch)  # L/(1 + L)
    found, size = np.interp(times, f.time_s, f.response), np.abs(wanted).max()
    assert found[len(special) :] == pytest.approx(wanted[len(special) :], abs=1e-7 * size)
    for t, value in zip(special, wanted, strict=False):
        if t == f.peak_time_s:
            assert f.peak_value == pytest.approx(value, rel=1e-7)
        else:
            assert abs(value / f.final_value - 1.0) == pytest.approx(0.02, abs=1e-7)


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
