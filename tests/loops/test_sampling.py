"""The exact hold with delay, against closed forms and against splitting the tick."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuator_lti import InputError
from actuator_lti.drive.blocks import pi
from actuator_lti.systems.sampling import delayed_hold, held_step, split_delay


@given(st.floats(0, 5), st.floats(1e-6, 10))
def test_first_order_lag_behind_any_delay(ticks: float, period: float) -> None:
    """Lag a/(s + a): the modified z-transform, in closed form."""
    a = 0.7 / period
    tick = delayed_hold(np.array([[-a]]), np.array([[a]]), np.array([[a]]), period, ticks * period)
    q, f = split_delay(ticks * period, period)
    assert tick.Phi[0, 0] == pytest.approx(np.exp(-0.7), rel=1e-13)
    new, old = 1 - np.exp(-0.7 * (1 - f)), np.exp(-0.7 * (1 - f)) - np.exp(-0.7)
    assert tick.gains[q][0] == pytest.approx(new, abs=1e-13)
    if f:
        assert tick.gains[q + 1][0] == pytest.approx(old, abs=1e-13)
    assert sum(g[0] for g in tick.gains.values()) == pytest.approx(tick.Gamma_T[0, 0], abs=1e-13)


def test_a_stiff_and_badly_scaled_plant() -> None:
    """Poles -1e8 and -1e-3, couplings of 1e9: the exponential of a triangular matrix, in closed form."""
    A, h = np.array([[-1e8, 1e9], [0.0, -1e-3]]), 1e-3
    Phi, Gamma = held_step(A, np.array([[0.0], [1.0]]), h)
    slow = np.exp(-1e-6)
    assert Phi[1, 1] == pytest.approx(slow, rel=1e-14)
    assert Phi[0, 1] == pytest.approx(1e9 * slow / (1e8 - 1e-3), rel=1e-12)
    assert Gamma[1, 0] == pytest.approx(-np.expm1(-1e-6) / 1e-3, rel=1e-12)


def test_delay_close_to_whole_ticks_is_whole() -> None:
    assert split_delay(0.1 + 0.2, 0.1) == (3, 0.0)
    assert split_delay(2.9999999999e-4, 1e-4) == (3, 0.0)
    with pytest.raises(InputError):
        split_delay(-1e-9, 1.0)


def test_pi_in_z_is_the_recursion() -> None:
    law, z = pi(2.0, 0.05, 0.01), np.exp(1j * 0.3)
    k = np.arange(4000)
    e = z**k
    integral = np.cumsum(2.0 * 0.01 / 0.05 * e)
    v = 2.0 * e + integral
    offset = 2.0 * 0.01 / 0.05 / (1 - z)  # the start's constant, which the response does not contain
    np.testing.assert_allclose(v - offset, law.at_z(np.array([30.0]))[0] * e, rtol=1e-9)
    assert pi(2.0, None, 0.01).at_z(np.array([1.0]))[0] == 2


def test_pi_forms_agree_up_to_half_a_period_of_gain() -> None:
    """PI(z) = PI(s) + Kp T/(2 Tn) + O(s T^2)."""
    law, omega = pi(2.0, 0.05, 0.001), np.array([1.0, 10.0])
    gap = law.at_z(omega) - law.at_s(omega)
    np.testing.assert_allclose(gap, 2.0 * 0.001 / 0.1, rtol=5e-3)
