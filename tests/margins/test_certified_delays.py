"""Exact delays, certified: verdict by the direct method of Walton and Marshall, crossings by a dense grid."""

import math

import control
import numpy as np
import pytest
from margin_families import poly, roots_of, uniform
from margin_truth import behind_delay, facts, unlike
from mpmath import mp, mpf

from actuator_lti import DelaySystem
from actuator_lti.margins import stability_margins

LOOPS = 12


def random_loop(rng: np.random.Generator) -> tuple[control.TransferFunction, float]:
    """Strictly proper, one or two integrators or none, and a delay that matters at the last crossover."""
    n = int(rng.integers(1, 5))
    poles = roots_of(rng, n, 2.0, wrong=0.15) + [0j] * int(rng.integers(0, 3))
    zeros = roots_of(rng, int(rng.integers(0, len(poles))), 2.0)
    num, den = poly(zeros), poly(poles)
    w = uniform(rng, -1.0, 1.0)
    gain = uniform(rng, -0.5, 1.0) / abs(np.polyval(num, 1j * w) / np.polyval(den, 1j * w))
    return control.tf(gain * num, den), uniform(rng, -2.0, 0.7) / w


@pytest.mark.parametrize("seed", range(LOOPS))
def test_verdict_crossovers_and_crossings_under_a_delay(seed: int) -> None:
    rng = np.random.default_rng([seed, 7])
    loop, delay_s = random_loop(rng)
    m = stability_margins(loop, delay_s=delay_s, certify=True)
    assert m.evidence == "certified", m.evidence_reason
    assert m.stable is (m.agreement.unstable_poles == 0)
    expected = behind_delay(loop, delay_s, m.band_rad_s[1])
    assert unlike(facts(m), expected, 1e-8, deg=1e-6) is None
    crossed, nearest = on_a_grid(loop, delay_s, m.band_rad_s[1])
    result = [
        (g.frequency_rad_s, g.ratio) for g in m.gain_margins if g.frequency_rad_s > 0.0 and g.ratio < 100
    ]
    assert len(result) == len(crossed)
    assert result == [(pytest.approx(w, rel=1e-3), pytest.approx(k, rel=0.02)) for w, k in crossed]
    assert m.modulus_margin <= nearest * (1 + 1e-9)


def on_a_grid(
    loop: control.TransferFunction, delay_s: float, top: float
) -> tuple[list[tuple[float, float]], float]:
    """Crossings of the negative real axis down to -40 dB, and the smallest distance to -1."""
    w = np.geomspace(1e-5, max(2 * top, 1e3), 600_000)
    L = np.polyval(loop.num[0][0], 1j * w) / np.polyval(loop.den[0][0], 1j * w) * np.exp(-1j * w * delay_s)
    hit = np.flatnonzero((L.imag[1:] * L.imag[:-1] < 0) & (L.real[1:] < 0) & (L.real[:-1] < 0))
    crossed = [(float(w[k]), float(1 / abs(L[k]))) for k in hit if abs(L[k]) >= 0.01]
    return crossed, float(np.abs(1 + L).min())


def test_many_turns_of_the_delay_are_certified_on_request() -> None:
    loop, delay_s = control.tf([30, 30], [1, 0.2, 0]), 1.1
    m = stability_margins(loop, delay_s=delay_s, band_rad_s=(0.0, 60.0))
    exact = stability_margins(loop, delay_s=delay_s, band_rad_s=(0.0, 60.0), certify=True)
    assert m.agreement.unstable_nyquist == behind_delay(loop, delay_s).unstable
    assert exact.agreement.unstable_poles == exact.agreement.unstable_nyquist == m.agreement.unstable_nyquist
    assert (m.evidence, exact.evidence, m.stable) == ("checked", "certified", False)
    assert [g.ratio for g in m.gain_margins] == pytest.approx([g.ratio for g in exact.gain_margins], rel=1e-9)


def test_delays_inside_and_in_series_are_certified_alike() -> None:
    """T/(1 + T e^(-a s)) behind b: crossovers and crossings on a grid, with L by its closed form."""
    plant = DelaySystem.from_system(control.tf([300], [1 / 80, 1, 0]))
    inner = (plant * DelaySystem.delay(0.002)).feedback()
    outer = inner * DelaySystem.delay(0.001) * DelaySystem.from_system(control.tf([30], [1, 0]))
    m = stability_margins(outer)
    assert m.evidence == "certified"
    w = np.geomspace(1e-2, m.band_rad_s[1], 400_001)
    p = 300.0 / (1j * w * (1j * w / 80.0 + 1.0)) * np.exp(-0.002j * w)
    L = p / (1.0 + p) * np.exp(-0.001j * w) * 30.0 / (1j * w)
    gain = np.flatnonzero((np.abs(L[1:]) > 1.0) != (np.abs(L[:-1]) > 1.0))
    real = np.flatnonzero((L.imag[1:] * L.imag[:-1] < 0.0) & (L.real[1:] < 0.0))
    assert [p.frequency_rad_s for p in m.phase_margins] == pytest.approx(w[gain], rel=1e-4)
    assert [g.ratio for g in m.gain_margins] == pytest.approx(1.0 / np.abs(L[real]), rel=1e-2)
    assert m.modulus_margin == pytest.approx(np.abs(1.0 + L).min(), rel=1e-6)


@pytest.mark.parametrize("certify", [False, True])
@pytest.mark.parametrize("shift", [0.0, 1e-14, -1e-14, 1e-13, -1e-13, 1e-11, -1e-11, 1e-9, -1e-9])
def test_a_delayed_loop_at_its_border_is_told_or_withheld(shift: float, certify: bool) -> None:
    """k exp(-s)/s is stable for k < pi/2, which no double is: never "on the border", never an error."""
    k = 0.5 * math.pi * (1.0 + shift)
    m = stability_margins(control.tf([k], [1, 0]), delay_s=1.0, certify=certify)
    assert not m.agreement.border_poles
    if m.evidence != "withheld":
        with mp.workdps(40):
            assert m.stable is bool(mpf(k) < mp.pi / 2)
    assert m.evidence != "withheld" or abs(shift) < 1e-13


def test_more_unstable_poles_than_collocation_found_are_counted() -> None:
    """A gain of 3 fed back through a delay: an unstable pair for each turn below its crossover."""
    g, T, k = 3.0, 0.15, 0.02
    inner = DelaySystem.from_system(control.tf([g], [1e-3, 1])) * DelaySystem.delay(T)
    loop = DelaySystem.from_system(control.tf([k], [1, 1])) * inner.feedback()
    m = stability_margins(loop, certify=True)
    assert m.stable is False
    corner = 4.0e3  # beyond it the characteristic function follows its highest power

    def characteristic(s: np.ndarray) -> np.ndarray:
        late = g * np.exp(-s * T)
        return (1 + s) * (1 + 1e-3 * s + late) + k * late

    up = 1j * np.linspace(corner, -corner, 400_001)
    arc = corner * np.exp(1j * np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001))
    F = characteristic(np.concatenate((up, arc)))
    count = round(float(np.angle(F[1:] / F[:-1]).sum()) / (2.0 * np.pi))
    assert m.agreement.unstable_poles == count > 100
