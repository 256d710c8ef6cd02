"""The range of a slider: it holds the value, both signs of one below zero, whole numbers from 1."""

import pytest

from actuator_lti import load_design
from reports.live.keys import SLIDER_FACTOR, followed

AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize("value", [-1e-3, 1e-3])
def test_a_value_below_zero_has_both_signs(value: float) -> None:
    design = AMBER.with_values({"friction.offset_torque": value})
    one = next(s for s in followed(design).free if s["path"] == "friction.offset_torque")
    ends = (-SLIDER_FACTOR * abs(value), SLIDER_FACTOR * abs(value))
    if value < 0.0:
        assert (one["low"], one["high"]) == pytest.approx(ends)
    else:
        assert (one["low"], one["high"]) == pytest.approx((value / SLIDER_FACTOR, ends[1]))


def test_whole_numbers_and_all_values_lie_inside() -> None:
    for one in followed(AMBER).free:
        assert one["low"] <= one["value"] <= one["high"]
        if one["whole"]:
            assert one["low"] >= 1.0
            assert one["high"] > one["low"]
