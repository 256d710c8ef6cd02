"""The response of a system of many states against its closed form, and at a pole of it."""

import numpy as np
import pytest

from actuator_lti.systems.plain_system import PlainSystem
from analyses.linear.responses import LARGE, response_at

PERIOD_S = 1e-3


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
