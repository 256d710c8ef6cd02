"""A current sampled at the ticks against the current between them, by exact solutions of the winding."""

from __future__ import annotations

import numpy as np
import pytest

from analyses.identification.sampled_current import HeldVoltage

FINE = 4000


def _current(a: float, T: float, d: float, w: float) -> tuple[np.ndarray, np.ndarray]:
    """Times within one tick and i(t) of 1/(1 + s/a) under exp(j w k T), switched d after each tick.

    Settled; the sum over every earlier step of the voltage, (u_k - u_(k-1)) (1 - exp(-a (t - t_k))).
    """
    t = (np.arange(FINE) + 0.5) * T / FINE
    back = np.arange(-round(60.0 / (a * T)) - 20, 1)
    u = np.exp(1j * w * np.arange(back[0] - 1, 1) * T)
    steps, when = np.diff(u), back * T + d
    since = np.maximum(t[:, None] - when, 0.0)
    return t, u[0] + (steps * -np.expm1(-a * since)).sum(axis=1)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("a", [500.0, 9e3, 4e4])
def test_the_mean_current_over_its_samples(a: float, share: float) -> None:
    T, w = 1e-4, 2.0 * np.pi * 180.0
    d = share * T
    t, i = _current(a, T, d, w)
    line = np.mean(i * np.exp(-1j * w * t))  # every tick repeats the one before, turned by exp(j w T)
    sample = _at_zero(a, T, d, w)
    held = HeldVoltage(rate_1_s=a, period_s=T, delay_s=d, back_emf_A_per_rad_s=0.0)
    assert held.mean_over_sample(np.array([w]))[0] == pytest.approx(line / sample, rel=1e-6)


def _at_zero(a: float, T: float, d: float, w: float) -> complex:
    back = np.arange(-round(60.0 / (a * T)) - 20, 1)
    u = np.exp(1j * w * np.arange(back[0] - 1, 1) * T)
    since = np.maximum(-(back * T + d), 0.0)
    return complex(u[0] + (np.diff(u) * -np.expm1(-a * since)).sum())


def test_the_lead_in_the_limits() -> None:
    """A slow winding goes straight from sample to sample; a quick one stands still between switches."""
    T = 1e-4
    for d in (0.0, 0.4 * T, T, 1.4 * T):
        slow = HeldVoltage(rate_1_s=1.0, period_s=T, delay_s=d, back_emf_A_per_rad_s=0.0)
        assert slow.lead_s == pytest.approx(0.0, abs=1e-4 * T)
    for d in (0.1 * T, 0.4 * T, 0.9 * T):
        quick = HeldVoltage(rate_1_s=1e7, period_s=T, delay_s=d, back_emf_A_per_rad_s=0.0)
        assert quick.lead_s == pytest.approx(d - 0.5 * T, abs=2e-3 * T)
