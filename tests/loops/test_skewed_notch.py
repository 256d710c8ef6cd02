"""The skewed notch: zeros on the antiresonance, poles beside it, as a two-mass drive asks for."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.design.model import Filter
from actuator_lti.drive.blocks import biquad
from nonlinear.row.filters import section

RNG = np.random.default_rng(7)


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
