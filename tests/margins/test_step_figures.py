"""Step figures against closed forms, and with delays against the method of steps."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from actuator_lti.errors import InputError
from actuator_lti.step import step_figures
from actuator_lti.systems.delay_system import DelaySystem

s = control.tf("s")


def test_first_order() -> None:
    f = step_figures(control.tf([3], [0.5, 1]))
    assert f.rise_time_s == pytest.approx(0.5 * math.log(9), rel=1e-9)
    assert f.settling_time_s == pytest.approx(0.5 * math.log(50), rel=1e-9)
    assert f.overshoot_percent == 0.0
    assert f.final_value == pytest.approx(3.0)
    assert f.peak_time_s == math.inf


@pytest.mark.parametrize("zeta", [0.05, 0.2, 0.5, 0.8])
def test_second_order(zeta: float) -> None:
    f = step_figures(control.ss(100 / (s**2 + 20 * zeta * s + 100)))
    root = math.sqrt(1 - zeta**2)
    assert f.overshoot_percent == pytest.approx(100 * math.exp(-math.pi * zeta / root), rel=1e-8)
    assert f.peak_time_s == pytest.approx(math.pi / (10 * root), rel=1e-5)
    t = np.linspace(0, 8 / (10 * zeta), 2_000_001)
    y = 1 - np.exp(-10 * zeta * t) * (np.cos(10 * root * t) + zeta / root * np.sin(10 * root * t))
    outside = np.flatnonzero(np.abs(y - 1) > 0.02)[-1]
    assert f.settling_time_s == pytest.approx(t[outside], abs=2 * t[1])
    assert f.rise_time_s == pytest.approx(t[np.argmax(y > 0.9)] - t[np.argmax(y > 0.1)], abs=2 * t[1])


def test_stiff_modes_and_a_slow_tail() -> None:
    f = step_figures((1.0 / (1e-6 * s + 1)) * (0.95 / (1e-3 * s + 1) + 0.05 / (5 * s + 1)))
    assert f.settling_time_s == pytest.approx(5 * math.log(0.05 / 0.02), rel=1e-4)
    assert f.rise_time_s == pytest.approx(1e-3 * (math.log(0.95 / 0.05) - math.log(0.95 / 0.85)), rel=1e-2)


def test_sampled_figures_are_times_of_samples() -> None:
    f = step_figures(control.tf([0.5], [1, -0.5], 0.01))
    assert f.response[:4] == pytest.approx([0, 0.5, 0.75, 0.875])
    assert f.rise_time_s == pytest.approx(0.03)  # 10 % at the 1st, 90 % at the 4th sample
    assert f.settling_time_s == pytest.approx(0.06)  # 1 - 2^-6 = 0.984
    assert f.period_s == 0.01


@pytest.mark.parametrize("KT", [0.2, 0.5, 1.2])
def test_integrator_with_delay_by_the_method_of_steps(KT: float) -> None:
    T = 0.005
    closed = (DelaySystem.from_system((KT / T) / s) * DelaySystem.delay(T)).feedback()
    f = step_figures(closed)

    def exact(t: np.ndarray) -> np.ndarray:
        error = np.zeros_like(t)
        for k in range(60):
            past = np.maximum(t - k * T, 0.0)
            error += np.where(t >= k * T, (-KT / T) ** k * past**k / math.factorial(k), 0.0)
        return 1 - error

    early = f.time_s < 25 * T
    assert f.response[early] == pytest.approx(exact(f.time_s[early]), abs=1e-6)
    t = np.linspace(0, 25 * T, 1_000_001)
    y = exact(t)
    assert f.overshoot_percent == pytest.approx(max(100 * (y.max() - 1), 0), abs=0.01)
    assert f.rise_time_s == pytest.approx(t[np.argmax(y > 0.9)] - t[np.argmax(y > 0.1)], rel=2e-4)
    if KT < 1:
        assert f.settling_time_s == pytest.approx(t[np.flatnonzero(np.abs(y - 1) > 0.02)[-1]], rel=1e-3)


def test_small_delays_approach_the_loop_without() -> None:
    plant = 200 * (s / 20 + 1) / (s * (s / 3 + 1) * (s / 400 + 1))
    free = step_figures(control.feedback(plant, 1))
    late = step_figures((DelaySystem.from_system(plant) * DelaySystem.delay(2e-6)).feedback())
    assert late.overshoot_percent == pytest.approx(free.overshoot_percent, rel=1e-3)
    assert late.settling_time_s == pytest.approx(free.settling_time_s, rel=1e-3)


def test_an_integrator_nobody_sees_does_not_matter() -> None:
    A = np.array([[-2.0, 0.0], [1.0, 0.0]])
    f = step_figures(
        control.StateSpace(A, [[2.0], [0.0]], [[1.0, 0.0]], [[0.0]], remove_useless_states=False)
    )
    assert f.settling_time_s == pytest.approx(0.5 * math.log(50), rel=1e-6)


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (1 / (s - 1), "not stable"),
        (1 / s, "integrates"),
        (1 / (s**2 + 1), "not stable"),
        (s / (s + 1), "zero"),
        (control.tf([1], [1, -1.1], 0.1), "not stable"),
        ((DelaySystem.from_system(400 / s) * DelaySystem.delay(0.005)).feedback(), "not stable"),
    ],
)
def test_refusals(system: control.LTI, message: str) -> None:
    with pytest.raises(InputError, match=message):
        step_figures(system)
