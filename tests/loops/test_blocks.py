"""The blocks of a loop: the exact hold with delay, PI, skewed notch; the budget of delays that they make."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_designs import amber, ctms_position, emps
from test_stacked import everything

from actuator_lti import InputError, assemble_loops, delay_budget
from actuator_lti.design.model import Design, Filter
from actuator_lti.drive.blocks import biquad
from actuator_lti.systems.sampling import delayed_hold, held_step, split_delay
from nonlinear.row.filters import section
from tests.validation.random_drives import full_drive

RNG = np.random.default_rng(7)


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


def skewed(zero: float, pole: float, width: float, depth: float) -> Filter:
    return Filter(kind="skewed-notch", zero_rad_s=zero, pole_rad_s=pole, width_rad_s=width, depth=depth)


@pytest.mark.parametrize("decade", range(-1, 5))
def test_both_writings_keep_its_closed_form(decade: int) -> None:
    """At its centre the formula holds, at DC the gain is 1, at Nyquist that of infinity, (w_p/w_z)^2."""
    for _ in range(20):
        wz, wp, width = 10.0**decade * RNG.uniform(0.5, 2.0, 3)
        depth, w0 = RNG.uniform(0.0, 1.0), np.sqrt(wz * wp)
        T = RNG.uniform(0.01, 0.9) * np.pi / max(wz, wp)
        item, s = skewed(wz, wp, width, depth), 1j * w0
        truth = (wp / wz) ** 2 * (s**2 + depth * width * s + wz**2) / (s**2 + width * s + wp**2)
        block = biquad(item, T)
        assert block.at_s(np.array([w0]))[0] == pytest.approx(truth, rel=1e-12)
        assert block.at_z(np.array([w0]))[0] == pytest.approx(truth, rel=1e-10)
        b0, b1, b2, a1, a2 = section(item, T)
        z = np.exp(1j * w0 * T)
        assert (b0 + b1 / z + b2 / z**2) / (1 + a1 / z + a2 / z**2) == pytest.approx(truth, rel=1e-10)
        assert (b0 + b1 + b2) / (1 + a1 + a2) == pytest.approx(1.0, rel=1e-9)
        assert (b0 - b1 + b2) / (1 - a1 + a2) == pytest.approx((wp / wz) ** 2, rel=1e-10)


def test_with_one_frequency_it_is_the_notch() -> None:
    one = skewed(640.0, 640.0, 320.0, 0.1)
    notch = replace(one, kind="notch", frequency_rad_s=640.0, zero_rad_s=None, pole_rad_s=None)
    assert section(one, 2e-4) == pytest.approx(section(notch, 2e-4), rel=1e-12)


@pytest.mark.parametrize("fraction", [0.02, 0.2, 0.7])
@pytest.mark.parametrize("design", [everything(), full_drive(90_104), full_drive(90_105)], ids=range(3))
def test_items_sum_to_the_phase_of_the_exact_loop(design: Design, fraction: float) -> None:
    for name, loop in assemble_loops(design).present.items():
        omega = fraction * np.pi / loop.period_s
        budget = delay_budget(design, name, omega)
        assert sum(budget.items.values()) == pytest.approx(budget.total_deg, abs=1e-9)
        exact = np.angle(loop.open_loop(np.exp(1j * omega * loop.period_s)), deg=True)
        assert (budget.total_deg - exact + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(
    ("design", "loop", "omega", "items"),
    [
        # computing delay w d, hold w Ts/2, one more sample w Ts, PI atan(1/(w Ti)): -89.66 deg in all
        (amber(), "current", 2737.0, {"computing_delay": 0.2737, "hold": 0.13685, "one_more_sample": 0.2737,
                                      "controller": np.arctan(1 / (2737.0 * 150e-6)), "measurement": 0.0}),
        # a difference over two samples is one sample old
        (emps(), "velocity", 100.0,
         {"measurement": 0.1, "controller": 0.0, "computing_delay": 0.0, "one_more_sample": 0.1}),
        # a long delay is not wrapped
        (ctms_position(delay_s=0.02), "position", 900.0 * np.pi, {"computing_delay": 18.0 * np.pi}),
    ],
    ids=["current loop", "EMPS", "long delay"],
)  # fmt: skip
def test_items_by_hand(design: Design, loop: str, omega: float, items: dict[str, float]) -> None:
    """Lags in rad; the totals as they were computed apart from this."""
    budget = delay_budget(design, loop, omega)
    for name, lag_rad in items.items():
        assert getattr(budget, f"{name}_deg") == pytest.approx(-np.degrees(lag_rad), abs=1e-9)
    assert loop != "current" or budget.total_deg == pytest.approx(89.66 - 180, abs=0.02)
    assert loop != "position" or budget.total_deg < -3000


def test_refusals() -> None:
    with pytest.raises(InputError, match="one of position"):
        delay_budget(ctms_position(), "velocity", 10.0)
    with pytest.raises(InputError, match="Nyquist"):
        delay_budget(ctms_position(), "position", 1e4)
