"""Exact delays, in series and inside: against closed forms, and against whole samples as states."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from actuator_lti.errors import InputError
from actuator_lti.margins import stability_margins
from actuator_lti.margins.delays.collocation import state_matrix
from actuator_lti.margins.delays.form import delay_form
from actuator_lti.systems.delay_system import DelaySystem

s = control.tf("s")


def test_inner_delay_is_the_series_delay_where_it_is_one() -> None:
    plant = control.ss(40 / (s * (s / 30 + 1) * (s**2 / 1e4 + 0.02 * s / 100 + 1)))
    series = stability_margins(plant, delay_s=0.004)
    inner = stability_margins(DelaySystem.from_system(plant) * DelaySystem.delay(0.004))
    both = stability_margins(DelaySystem.from_system(plant) * DelaySystem.delay(0.003), delay_s=0.001)
    for other in (inner, both):
        assert other.stable is series.stable
        assert other.gain_margin_db == pytest.approx(series.gain_margin_db, abs=1e-9)
        assert [p.deg for p in other.phase_margins] == pytest.approx(
            [p.deg for p in series.phase_margins], abs=1e-7
        )
        assert other.modulus_margin == pytest.approx(series.modulus_margin, rel=1e-7)
        assert other.disk_margin.alpha == pytest.approx(series.disk_margin.alpha, rel=1e-7)


def test_gain_crossovers_under_delay_are_those_without() -> None:
    loop = 8.75 * (4 * s**2 + 0.4 * s + 1)
    loop = loop / ((100 * s + 1) * (s**2 + 0.22 * s + 1) * (s**2 / 100 + 0.008 * s + 1))
    free, late = stability_margins(loop), stability_margins(loop, delay_s=0.7)
    assert [p.frequency_rad_s for p in late.phase_margins] == pytest.approx(
        [p.frequency_rad_s for p in free.phase_margins], rel=1e-9
    )
    for a, b in zip(free.phase_margins, late.phase_margins, strict=True):
        lost = a.deg - math.degrees(0.7 * a.frequency_rad_s) - b.deg
        assert lost / 360 == pytest.approx(round(lost / 360), abs=1e-9)


def test_a_resonance_between_grid_points_is_found_under_delay() -> None:
    loop = 20e6 / (s * (s**2 + 0.001 * s + 1e6))  # B2, a thousand times less damped
    m = stability_margins(loop, delay_s=1e-4)
    assert len(m.phase_margins) == 3
    assert m.stable is False
    assert m.agreement.agree


@pytest.mark.parametrize("samples", [1, 2, 5])
def test_whole_samples_of_delay_become_states_and_a_fraction_lies_between(samples: int) -> None:
    loop = control.tf([0.1, 0.02], [1, -1.6, 0.65], 0.001)
    late = control.tf([0.1, 0.02], [1, -1.6, 0.65, *[0] * samples], 0.001)
    a, b = stability_margins(loop, delay_s=samples * 0.001), stability_margins(late)
    assert a.stable is b.stable
    assert [g.ratio for g in a.gain_margins] == pytest.approx([g.ratio for g in b.gain_margins], rel=1e-9)
    near = stability_margins(loop, delay_s=(samples + 1e-6) * 0.001)
    assert near.stable is b.stable
    assert near.agreement.unstable_poles is None  # the Nyquist curve alone tells
    assert near.phase_margin_deg == pytest.approx(b.phase_margin_deg, abs=1e-3)


def test_delay_margin_in_a_sampled_loop_brings_the_verdict_to_change() -> None:
    loop = control.tf([0.5], [1, -1], 0.001)
    limit = stability_margins(loop).delay_margin_s
    assert stability_margins(loop, delay_s=0.99 * limit).stable
    assert stability_margins(loop, delay_s=1.01 * limit).stable is False


def test_a_double_integrator_close_to_the_negative_axis_takes_no_endless_splitting() -> None:
    den = [1.0]
    for factor in ([1, 2.05], [1, 0.2, 0.39], [1, 0.25], [1, 0, 0]):
        den = np.polymul(den, factor)
    m = stability_margins(control.tf([1e-3], den), delay_s=0.05)
    assert m.stable is False
    assert m.agreement.unstable_poles == 2


def test_collocated_poles_are_those_of_the_exact_delay() -> None:
    closed = (DelaySystem.from_system(control.tf([100], [1, 0])) * DelaySystem.delay(0.005)).feedback()
    values = np.linalg.eigvals(state_matrix(delay_form(closed), 24))
    rightmost = values[np.argmax(values.real)]
    assert abs(rightmost + 100 * np.exp(-0.005 * rightmost)) < 1e-7  # s + K exp(-s T) = 0


def test_nested_loops_with_delays_have_as_many_unstable_poles_as_collocation_finds() -> None:
    rng = np.random.default_rng(8)
    verdicts = []
    for _ in range(25):
        k1, k2 = 10 ** rng.uniform(1, 3), 10 ** rng.uniform(0.5, 2.5)
        t1, t2 = rng.uniform(2e-4, 3e-3, 2)
        inner = (DelaySystem.from_system(k1 / (s * (s / 2000 + 1))) * DelaySystem.delay(t1)).feedback()
        loop = inner * DelaySystem.delay(t2) * DelaySystem.from_system(k2 / s)
        m = stability_margins(loop)
        poles = np.linalg.eigvals(state_matrix(delay_form(loop.feedback()), 40))
        assert m.agreement.unstable_poles == np.count_nonzero(poles.real > 0.0)
        verdicts.append(m.stable)
    assert True in verdicts
    assert False in verdicts


def test_direct_feedthrough_behind_a_delay_is_refused() -> None:
    with pytest.raises(InputError, match="neutral"):
        stability_margins(control.tf([2, 1], [1, 5]), delay_s=0.1)


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
