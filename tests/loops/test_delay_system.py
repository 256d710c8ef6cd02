"""DelaySystem against the expressions it stands for, and in python-control's own functions."""

from math import e, pi
from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti import DelaySystem, InputError, assemble_loops
from actuator_lti.systems import delay_stepper
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
