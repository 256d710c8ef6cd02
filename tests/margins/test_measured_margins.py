"""Measured data: bounds between neighbouring points, or a refusal; never a guess."""

from __future__ import annotations

import control
import numpy as np
import pytest

from actuator_lti.errors import InputError
from actuator_lti.margins import stability_margins

A1 = control.tf([25], [1, 10, 10, 10])


def test_crossings_lie_in_their_brackets_and_figures_in_their_ranges() -> None:
    exact = stability_margins(A1)
    for count in (15, 60, 400):
        m = stability_margins(control.frd(A1, np.geomspace(0.2, 8, count)))
        assert m.stable is None
        assert m.verdict == "undecided"
        (gain,), (phase,) = m.gain_margins, m.phase_margins
        assert gain.bracket_rad_s is not None
        assert gain.ratio_range is not None
        assert phase.bracket_rad_s is not None
        assert phase.deg_range is not None
        assert gain.bracket_rad_s[0] <= exact.gain_margins[0].frequency_rad_s <= gain.bracket_rad_s[1]
        assert phase.bracket_rad_s[0] <= exact.phase_margins[0].frequency_rad_s <= phase.bracket_rad_s[1]
        assert gain.ratio_range[0] <= 3.6 <= gain.ratio_range[1]
        assert phase.deg_range[0] <= 29.1104 <= phase.deg_range[1]
        assert m.modulus_margin is not None
        assert exact.modulus_margin is not None
        assert m.modulus_margin >= exact.modulus_margin


def test_ranges_shrink_with_the_grid() -> None:
    def width(count: int) -> float:
        (phase,) = stability_margins(control.frd(A1, np.geomspace(0.2, 8, count))).phase_margins
        assert phase.deg_range is not None
        assert abs(phase.deg - 29.1103691304) < 0.02 * (phase.deg_range[1] - phase.deg_range[0])
        return phase.deg_range[1] - phase.deg_range[0]

    assert width(600) == pytest.approx(0.1 * width(60), rel=0.1)


def test_a_resonance_jumped_over_is_refused() -> None:
    loop = control.tf([20e6], [1, 1, 1e6, 0])  # B2
    with pytest.raises(InputError, match="too coarse between"):
        stability_margins(control.frd(loop, np.geomspace(1, 1e4, 50)))


def test_no_crossing_in_the_band_is_not_called_an_infinite_margin() -> None:
    m = stability_margins(control.frd(A1, np.geomspace(0.01, 1, 50)))
    assert m.gain_margins == ()
    assert m.gain_margin_db is None
    assert m.phase_margin_deg is None
    assert m.delay_margin_s is None


def test_delay_is_applied_exactly_to_data() -> None:
    m = stability_margins(control.frd(control.tf([100], [1, 0]), np.geomspace(20, 500, 2000)), delay_s=0.005)
    assert m.gain_margins[0].db == pytest.approx(9.9430, abs=1e-3)
    assert m.phase_margins[0].deg == pytest.approx(61.3521, abs=1e-3)


@pytest.mark.parametrize(
    ("omega", "values", "message"),
    [
        ([1.0], [1.0], "two points"),
        ([1.0, 2.0, 3.0], [1.0, np.nan, 0.5], "finite"),
        ([1.0, 2.0, 3.0], [1.0, 0.0, 0.5], "not zero"),
        ([1.0, 2.0, 3.0], [1.0, -1.0, 0.5], "too coarse"),
    ],
)
def test_unusable_data(omega: list[float], values: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        stability_margins(control.frd(np.array(values, dtype=complex), omega))
