"""DelaySystem against what it stands for and in python-control; responses by all ways round the loop."""

from fractions import Fraction
from itertools import pairwise
from math import e, factorial, pi
from typing import Any

import control
import flint
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti import DelaySystem, InputError, assemble_loops, step_figures, unwrapped_phase_deg
from actuator_lti.systems import delay_stepper
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.resolvent import solved_at
from analyses.linear.responses import LARGE, curve, nichols_curve, response_at
from tests.refusals import refused

S = 1j * np.geomspace(0.01, 1e4, 40)
LAG = control.tf([2.0], [0.1, 1.0])
LEAD = control.tf([0.3, 1.0], [0.01, 1.0])
FORMS = ("sampled", "continuous", "ideal")
NAMES = ("current", "velocity", "position")
INTEGRATOR = control.tf([1], [1, 0])


def lag(s: Any) -> Any:
    return 2 / (0.1 * s + 1)


def test_series_parallel_feedback_are_exact() -> None:
    a = DelaySystem.from_system(LAG) * DelaySystem.delay(0.02)
    b = DelaySystem.delay(0.005) * LEAD
    A, B = lag(S) * np.exp(-0.02 * S), (0.3 * S + 1) / (0.01 * S + 1) * np.exp(-0.005 * S)
    for system, expected in (
        (a * b, A * B), (a + b, A + B), (a - 3, A - 3), (1 - a, 1 - A), (-a, -A), (2 * a / 4, A / 2),
        (LAG * a, lag(S) * A), (a.feedback(), A / (1 + A)), (a.feedback(b), A / (1 + A * B)),
        (a.feedback(b, sign=1), A / (1 - A * B)),
        (b.feedback(a.feedback(LAG)), B / (1 + B * A / (1 + A * lag(S)))),
    ):  # fmt: skip
        np.testing.assert_allclose(system(S), expected, rtol=1e-11)


@settings(max_examples=40)
@given(st.lists(st.tuples(st.floats(0.1, 5), st.floats(0, 0.3)), min_size=1, max_size=5))
def test_any_nest_of_delayed_loops(stages: list[tuple[float, float]]) -> None:
    system, expected = DelaySystem.from_system(1.0), np.ones(len(S), dtype=complex)
    for gain, delay in stages:
        system = (DelaySystem.from_system(LAG) * gain * DelaySystem.delay(delay) * system).feedback(0.3)
        expected = lag(S) * gain * np.exp(-S * delay) * expected
        expected = expected / (1 + 0.3 * expected)
    np.testing.assert_allclose(system(S), expected, rtol=1e-8)


def test_characteristic_vanishes_at_the_poles_and_nowhere_else() -> None:
    """k exp(-s)/s with k = pi/2 closed: a pole pair exactly at +-j pi/2."""
    integrator = DelaySystem.from_system(control.tf([1], [1, 0]))
    closed = (integrator * (np.pi / 2) * DelaySystem.delay(1.0)).feedback()
    assert abs(closed.characteristic(1j * np.pi / 2)) < 1e-14
    assert abs(closed.characteristic(1j)) > 0.1
    np.testing.assert_allclose(closed.characteristic(S), S + np.pi / 2 * np.exp(-S), rtol=1e-12)


def test_poles_and_zeros_are_given_only_without_delay() -> None:
    delayed = DelaySystem.from_system(LAG) * DelaySystem.delay(0.1)
    with pytest.raises(NotImplementedError):
        delayed.poles()
    refused(delayed.to_state_space, words="delays")
    assert delayed.without_delays().poles() == pytest.approx([-10])
    free = DelaySystem.from_system(LAG)
    assert free.delay_free
    assert free.poles() == pytest.approx([-10])


def test_infinite_and_finite_dc_gain() -> None:
    delayed = DelaySystem.from_system(LAG) * DelaySystem.delay(0.1)
    assert delayed.dcgain() == pytest.approx(2)
    assert [np.shape(delayed(at)) for at in (1j, np.array([1j, 2j]))] == [(), (2,)]
    assert delayed([1j, 2j], squeeze=False).shape == (1, 1, 2)
    integrator = DelaySystem.from_system(control.tf([1], [1, 0])) * DelaySystem.delay(0.1)
    assert np.isinf(integrator(0).real)
    # an open integrator inside a closed loop is no pole of it
    assert integrator.feedback()(0) == pytest.approx(1)


def test_refusals() -> None:
    refused(DelaySystem, [], [], [], [], [], [[0]], [[1]], [[1]], [[0]], [-1.0], words="positive")
    refused(DelaySystem.from_system, control.tf([1], [1, 0.5], 0.1), words="sampled")
    refused(DelaySystem.from_system(-1.0).feedback, words="algebraic")
    refused(DelaySystem.from_system, float("nan"), words="finite")


@pytest.fixture(scope="module")
def loops() -> dict:
    return {form: assemble_loops("ilr33-amber", form=form) for form in FORMS}


@pytest.fixture(autouse=True)
def _closed_figures():
    yield
    plt.close("all")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", NAMES)
def test_the_functions_of_every_day_take_every_loop(form: str, name: str, loops: dict) -> None:
    loop = getattr(loops[form], name)
    for system in (loop.open_loop, loop.closed_loop, loop.sensitivity):
        drawn = control.bode_plot(system)
        x, y = drawn.lines[0, 0][0].get_data()
        points = np.exp(1j * x * system.dt) if system.isdtime(strict=True) else 1j * x
        np.testing.assert_allclose(y, np.abs(system(points)), rtol=1e-9)
        assert len(set(system.state_labels)) == system.nstates
        assert not any("." in label or label.startswith("x[") for label in system.state_labels)
    control.nyquist_plot(loop.open_loop, warn_encirclements=False)
    control.nichols_plot(loop.open_loop)
    times = np.arange(200) * (loop.period_s or 1e-4)
    response = control.step_response(loop.closed_loop, times)
    assert response.y.shape == (1, 1, 200)
    assert np.isfinite(response.y).all()
    assert response.output_labels == loop.closed_loop.output_labels
    pade = getattr(loop.closed_loop, "pade", None)
    if pade is not None:
        assert pade(3).nstates == loop.closed_loop.nstates + 3 * len(loop.closed_loop.delays_s)
        assert set(pade(3).state_labels) > set(loop.closed_loop.state_labels)


@pytest.mark.filterwarnings("ignore:stability_margins. Falling back", "ignore:Badly conditioned filter")
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", NAMES)
def test_the_margins_of_python_control_fulfil_their_definitions(form: str, name: str, loops: dict) -> None:
    system = getattr(loops[form], name).open_loop
    gain, phase, at_180, at_1 = control.margin(system)
    turn = (lambda w: np.exp(1j * w * system.dt)) if system.isdtime(strict=True) else (lambda w: 1j * w)
    assert abs(system(turn(at_1))) == pytest.approx(1.0, rel=1e-4)
    assert np.degrees(np.angle(-system(turn(at_1)))) == pytest.approx(phase, rel=1e-4)
    if np.isfinite(gain):
        assert gain * system(turn(at_180)) == pytest.approx(-1.0, rel=1e-4)


@pytest.mark.parametrize(("gain", "delay"), [(1.0, 0.1), (300.0, 1e-3), (2e-3, 40.0)])
def test_an_integrator_behind_a_delay(gain: float, delay: float) -> None:
    loop = DelaySystem.from_system(gain * INTEGRATOR) * DelaySystem.delay(delay)
    result = control.margin(loop)
    wanted = (pi / (2 * gain * delay), 90.0 - np.degrees(gain * delay), pi / (2 * delay), gain)
    np.testing.assert_allclose(result, wanted, rtol=1e-5)


def test_jumps_at_too_many_instants_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """y = u - 0.33 (y(t - 1) + y(t - sqrt 2) + y(t - e)): three sums of delays that never fade."""
    monkeypatch.setattr(delay_stepper, "MOST_PIECES", 3000)
    ring = sum((0.33 * DelaySystem.delay(d) for d in (1.0, 2**0.5, e)), DelaySystem.from_system(0.0))
    closed = DelaySystem.from_system(1.0).feedback(ring)
    assert np.isfinite(control.step_response(closed, np.linspace(0.0, 9.0, 10)).y).all()
    with pytest.raises(InputError, match=r"3000 pieces between the instants at which jumps return.*fewer"):
        control.step_response(closed, np.linspace(0.0, 900.0, 10))


def test_any_input_and_the_states() -> None:
    system = DelaySystem.from_system(control.ss([[0]], [[1]], [[1]], [[0]])) * DelaySystem.delay(0.5)
    times = np.linspace(0.0, 2.0, 41)
    response = control.forced_response(system, times, times)
    wanted = np.maximum(times - 0.5, 0.0) ** 2 / 2.0
    np.testing.assert_allclose(response.y[0] if response.y.ndim > 1 else response.y, wanted, atol=1e-9)
    np.testing.assert_allclose(np.ravel(response.x), wanted, atol=1e-9)
    from_two = control.forced_response(system, times, 0.0 * times, [2.0])
    np.testing.assert_allclose(np.ravel(from_two.y), 2.0, atol=1e-12)


def test_a_pade_quotient_is_near_and_stable() -> None:
    loop = DelaySystem.from_system(INTEGRATOR) * DelaySystem.delay(1e-3)
    near = (300 * loop).feedback().pade(6)
    assert isinstance(near, control.StateSpace)
    assert near.poles().real.max() < 0.0
    omega = np.geomspace(1.0, 2000.0, 50)
    np.testing.assert_allclose(near(1j * omega), (300 * loop).feedback()(1j * omega), rtol=1e-6)


def test_what_needs_a_finite_state_space_is_refused() -> None:
    delay = DelaySystem.delay(0.1) * DelaySystem.from_system(INTEGRATOR)
    for order in (0, 13, 2.5, True):
        refused(delay.pade, order, words="allowed: a whole number, 1 to 12")
    refused(delay.linearize, 0.0, 0.0, words="take system.pade")
    plant = control.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], name="plant", inputs="a", outputs="b")
    part = DelaySystem.from_system(INTEGRATOR) * DelaySystem.delay(0.1)
    part.update_names(name="late", inputs="b", outputs="c")
    joined = control.interconnect([plant, part], inputs="a", outputs="c")
    refused(control.input_output_response, joined, np.linspace(0, 1, 5), np.ones(5), words="take system.pade")


def test_products_with_itself_are_exact_and_what_looks_ahead_is_refused() -> None:
    late = DelaySystem.from_system(control.tf([2.0], [1.0, 1.0])) * DelaySystem.delay(0.5)
    at = 2.0 / (1.0 + 3.0j) * np.exp(-1.5j)
    for power in (0, 1, 3):
        assert (late**power)(3j) == pytest.approx(at**power, rel=1e-12)
    plain = control.ss(-1.0, 1.0, 1.0, 0.0)
    for call in (
        lambda: late / 0, lambda: late / plain, lambda: late / late, lambda: late / "a", lambda: plain / late,
        lambda: 1.0 / late, lambda: late**-1, lambda: late**0.5, lambda: DelaySystem.delay("a"),
    ):  # fmt: skip
        refused(call)


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
