"""Exact delays: against closed forms, whole samples as states, Walton and Marshall, and a dense grid."""

import cmath
import math
from dataclasses import replace
from fractions import Fraction

import control
import numpy as np
import pytest
from margin_truth import behind_delay, facts, truth_of, unlike
from mpmath import mp, mpf
from scipy import signal
from scipy.optimize import brentq

from actuator_lti.margins import stability_margins
from actuator_lti.margins.delays.form import delay_form
from actuator_lti.step.delayed import collocated
from actuator_lti.systems.delay_system import DelaySystem

s = control.tf("s")


def test_nested_loops_with_delays_have_as_many_unstable_poles_as_collocation_finds() -> None:
    rng = np.random.default_rng(8)
    verdicts = []
    for _ in range(14):
        k1, k2 = 10 ** rng.uniform(1, 3), 10 ** rng.uniform(0.5, 2.5)
        t1, t2 = rng.uniform(2e-4, 3e-3, 2)
        inner = (DelaySystem.from_system(k1 / (s * (s / 2000 + 1))) * DelaySystem.delay(t1)).feedback()
        loop = inner * DelaySystem.delay(t2) * DelaySystem.from_system(k2 / s)
        m = stability_margins(loop)
        poles = np.linalg.eigvals(collocated(delay_form(loop.feedback()), 40))
        rightmost = poles[np.argmax(poles.real)]  # that of the exact delays, by its own equation
        exact, h = loop.feedback().characteristic, 1e-4 * abs(rightmost)
        slope = (exact(rightmost + h) - exact(rightmost - h)) / (2.0 * h)
        assert abs(exact(rightmost) / slope) < 1e-6 * abs(rightmost)  # a step of Newton to the zero
        assert m.agreement.unstable_poles == np.count_nonzero(poles.real > 0.0)
        verdicts.append(m.stable)
    assert True in verdicts
    assert False in verdicts


def test_a_far_crossing_is_listed_beside_an_end_on_the_negative_real_axis() -> None:
    """-0.3 exp(-0.3 s)/((s + 1)(1e-8 s + 1)): at rest, then round at w by hand, 34 dB from one."""
    w = brentq(lambda w: 0.3 * w + math.atan(w) + math.atan(1e-8 * w) - 2.0 * math.pi, 10.0, 20.0)
    m = stability_margins(control.tf([-0.3], np.polymul([1.0, 1.0], [1e-8, 1.0])), delay_s=0.3)
    expected = [1.0 / 0.3, math.hypot(1.0, w) * math.hypot(1.0, 1e-8 * w) / 0.3]
    assert [g.ratio for g in m.gain_margins[:2]] == pytest.approx(expected, rel=1e-9)
    assert len(m.gain_margins) == 5
    assert not any("left out" in note for note in m.notes)


THREE_LAGS = control.tf([9e3], np.polymul([1.0, 1e3, 1e6], [1e-3, 1.0]))


@pytest.mark.parametrize("certify", [False, True])
@pytest.mark.parametrize(("loop", "delay_s", "db"), [
    (1 / s, 1e-3, 20 * math.log10(500 * math.pi)),
    (1 / s, 1e-6, 20 * math.log10(5e5 * math.pi)),
    (1e-9 / s, 1.0, 20 * math.log10(5e8 * math.pi)),
    (1e-9 / s, 1e-3, math.inf),  # 243.9 dB
    (THREE_LAGS, 1e-9, 50.45756),  # 8/0.009 at 1000 sqrt(2) rad/s without the delay: 50.45757
    (control.tf([0.5], [1, 1]), 1e6, 20 * math.log10(2.0)),
    (control.tf([0.01], [1, 1]), 1e5, 40.0),
    (control.tf([1.0], [1, 0, 0]) * control.tf([1.0], [1.0, 1.0]), 1e-3, None),
    (20e6 / (s * (s**2 + 0.001 * s + 1e6)), 1e-4, None),  # B2, a thousand times less damped: unstable
    # unstable, close to the negative real axis for decades
    (1e-3 / ((s + 2.05) * (s**2 + 0.2 * s + 0.39) * (s + 0.25) * s**2), 0.05, None),
    # an integrator and a notch in front of a resonance: the gain is low, then high again; above 40 dB in it
    (3 / s * (s**2 + 0.2 * s + 4) / (s**2 + 8 * s + 4) * 400 / (s**2 + 0.1 * s + 400), 2.27, None),
])  # fmt: skip
def test_every_gain_margin_is_found_whatever_its_size(loop, delay_s, db, certify) -> None:
    if certify and delay_s > 1e3:
        pytest.skip("by hand, or by the other way: too many turns for certified intervals")
    m = stability_margins(loop, delay_s=delay_s, certify=certify)
    expected = behind_delay(loop, delay_s, min(m.band_rad_s[1], 600.0 / delay_s))
    assert m.evidence == ("certified" if certify else "checked")
    assert unlike(facts(m), expected, 1e-8, 1e-6) is None
    if db is not None:
        assert m.gain_margin_db == pytest.approx(db, abs=2e-5)


@pytest.mark.parametrize("certify", [False, True])
def test_as_the_delay_goes_to_0_the_lists_are_those_of_the_loop_without_it(certify: bool) -> None:
    """1/(s (s + 1)^2) and a dipole at 30 rad/s: 2 at 1 rad/s, then one beyond 40 dB."""
    loop = 1 / (s * (s + 1) ** 2) * (s**2 + 0.01 * s + 900) / (s**2 - 0.01 * s + 841)
    free = stability_margins(loop)
    assert [g.db > 40.0 for g in free.gain_margins] == [False, True]
    for delay_s in (1e-6, 1e-8, 1e-10):
        m = stability_margins(loop, delay_s=delay_s, certify=certify)
        listed = [g.ratio for g in m.gain_margins if g.frequency_rad_s < 100.0]
        assert listed == pytest.approx([g.ratio for g in free.gain_margins], rel=0.1 * delay_s / 1e-6)
    assert m.band_rad_s == (0.0, math.inf)


def test_default_band_ends_where_the_gain_stays_below_minus_40_db() -> None:
    m = stability_margins(100 / s, delay_s=0.005)
    assert all(g.ratio <= 100.0 for g in m.gain_margins)
    step = 2 * math.pi / 0.005
    assert len(m.gain_margins) == 1 + int((1e4 - 0.25 * step) // step)
    assert any("not listed" in note for note in m.notes)


@pytest.mark.parametrize("delay_s", [500.0, 2e4, 3e5])
def test_a_delay_of_many_turns_is_summarised(delay_s: float) -> None:
    """1/s: crossings of the real axis at w = (2 k + 1/2) pi/delay with ratio w, all by hand."""
    m = stability_margins(control.tf([1.0], [1.0, 0.0]), delay_s=delay_s)
    low, high = m.band_rad_s
    crossings = (2.0 * np.arange(delay_s * max(high, 1.0)) + 0.5) * np.pi / delay_s
    assert m.agreement.unstable_nyquist == 2 * np.count_nonzero(crossings < 1.0)
    assert m.gain_margin is not None
    assert m.gain_margin.ratio == pytest.approx(crossings[np.abs(np.log(crossings)).argmin()], rel=1e-9)
    np.testing.assert_allclose([g.ratio for g in m.gain_margins], crossings[crossings < high], rtol=1e-9)
    assert (low, m.evidence) == (0.0, "checked")
    assert "are not listed" in m.notes[0]
    assert m.modulus_margin == pytest.approx(abs(1.0 - 1.0 / m.gain_margin.ratio), rel=1e-2)  # as delay grows


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
def test_a_delayed_loop_at_its_limit_is_determined_or_withheld(shift: float, certify: bool) -> None:
    """k exp(-s)/s is stable for k < pi/2, which no double is: never "at the limit", never an error."""
    k = 0.5 * math.pi * (1.0 + shift)
    m = stability_margins(control.tf([k], [1, 0]), delay_s=1.0, certify=certify)
    assert not m.agreement.poles_at_limit
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


def test_a_loop_below_the_resolution_of_the_search_is_nearest_where_it_is_real() -> None:
    """1e-9/(s + 1) behind 1 s: w + arctan w = pi, there |1 + L| = 1 - |L|; not "1 at infinity"."""
    result = stability_margins(control.tf([1e-9], [1.0, 1.0]), delay_s=1.0)
    w = brentq(lambda x: x + np.arctan(x) - np.pi, 1.0, 3.0)
    assert result.modulus_frequency_rad_s == pytest.approx(w, rel=1e-9)
    assert 1.0 - result.modulus_margin == pytest.approx(1e-9 / np.hypot(1.0, w), rel=1e-6)


def test_an_unstable_loop_prints_the_delay_margin_that_it_quotes() -> None:
    """10/(s + 1) behind a delay beyond its margin arccos(-0.1)/w, w = sqrt(99): none is left."""
    result = stability_margins(control.tf([10.0], [1.0, 1.0]), delay_s=1.0)
    assert result.delay_margin_s == 0.0
    assert "delay margin: 0 s, as it is not stable" in str(result)
    assert "delay to the stability limit: " in str(result)


@pytest.mark.parametrize("part", [Fraction(1, 2), Fraction(7, 3), Fraction(21, 2)])
@pytest.mark.parametrize("loop", [
    control.tf([0.5], [1.0, -0.5], 1.0),
    control.tf([0.3, 0.2], [1.0, -0.8, 0.3], 1.0),
    control.tf([2.0, -1.5], [1.0, -0.5], 1.0),  # the gain rises from one
    control.tf(*signal.butter(4, 0.2), 1.0),  # it stays at one for long, and within rounding alone
])  # fmt: skip
def test_a_gain_of_one_at_rest_is_no_crossing_behind_part_of_a_sample(
    loop: control.TransferFunction, part: Fraction
) -> None:
    """Lists by exact polynomials, unstable poles by the turn of 1 + L, at the end to the mean."""
    m = stability_margins(loop, delay_s=float(part))
    assert not m.withheld
    inside = replace(facts(m), gains=[g for g in facts(m).gains if g[0] < np.pi], unstable=None)
    assert unlike(inside, replace(truth_of(loop, part), unstable=None), 1e-6, 1e-3) is None
    w = np.linspace(0.0, np.pi, 200_001)
    F = 1.0 + loop(np.exp(1j * w)) * np.exp(-1j * w * float(part))
    turn = float(np.unwrap(np.angle(F))[-1]) + cmath.phase(F[-1].real / F[-1])
    assert m.agreement.unstable_nyquist == round(-turn / np.pi)
