"""DelaySystem against the expressions it stands for, and as a python-control system."""

from __future__ import annotations

from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti import DelaySystem, InputError

S = 1j * np.geomspace(0.01, 1e4, 40)
LAG = control.tf([2.0], [0.1, 1.0])
LEAD = control.tf([0.3, 1.0], [0.01, 1.0])


def lag(s: Any) -> Any:
    return 2 / (0.1 * s + 1)


def test_series_parallel_feedback_are_exact() -> None:
    a = DelaySystem.from_system(LAG) * DelaySystem.delay(0.02)
    b = DelaySystem.delay(0.005) * LEAD
    A, B = lag(S) * np.exp(-0.02 * S), (0.3 * S + 1) / (0.01 * S + 1) * np.exp(-0.005 * S)
    for system, expected in (
        (a * b, A * B),
        (a + b, A + B),
        (a - 3, A - 3),
        (1 - a, 1 - A),
        (-a, -A),
        (2 * a / 4, A / 2),
        (LAG * a, lag(S) * A),
        (a.feedback(), A / (1 + A)),
        (a.feedback(b), A / (1 + A * B)),
        (a.feedback(b, sign=1), A / (1 - A * B)),
        (b.feedback(a.feedback(LAG)), B / (1 + B * A / (1 + A * lag(S)))),
    ):
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
    with pytest.raises(InputError, match="delays"):
        delayed.to_state_space()
    assert delayed.without_delays().poles() == pytest.approx([-10])
    free = DelaySystem.from_system(LAG)
    assert free.delay_free
    assert free.poles() == pytest.approx([-10])


def test_infinite_and_finite_dc_gain() -> None:
    delayed = DelaySystem.from_system(LAG) * DelaySystem.delay(0.1)
    assert delayed.dcgain() == pytest.approx(2)
    integrator = DelaySystem.from_system(control.tf([1], [1, 0])) * DelaySystem.delay(0.1)
    assert np.isinf(integrator(0).real)
    # an open integrator inside a closed loop is no pole of it
    assert integrator.feedback()(0) == pytest.approx(1)


def test_shapes_follow_python_control() -> None:
    system = DelaySystem.from_system(LAG) * DelaySystem.delay(0.1)
    assert np.ndim(system(1j)) == 0
    assert system(np.array([1j, 2j])).shape == (2,)
    assert system([1j, 2j], squeeze=False).shape == (1, 1, 2)


def test_python_control_plots_and_responses_take_it() -> None:
    system = DelaySystem.from_system(LAG) * DelaySystem.delay(0.1)
    omega = np.array([1.0, 10.0, 100.0])
    frd = control.frequency_response(system, omega)
    np.testing.assert_allclose(frd.complex, system(1j * omega))
    control.bode_plot(frd)
    control.bode_plot(control.frequency_response(system))
    plt.close("all")


def test_refusals() -> None:
    with pytest.raises(InputError, match="positive"):
        DelaySystem([], [], [], [], [], [[0]], [[1]], [[1]], [[0]], [-1.0])
    with pytest.raises(InputError, match="sampled"):
        DelaySystem.from_system(control.tf([1], [1, 0.5], 0.1))
    with pytest.raises(InputError, match="algebraic"):
        DelaySystem.from_system(-1.0).feedback()
    with pytest.raises(InputError, match="finite"):
        DelaySystem.from_system(float("nan"))


def test_repr_is_short() -> None:
    assert repr(DelaySystem.delay(0.25)) == "DelaySystem(0 states, delays 250 ms)"
