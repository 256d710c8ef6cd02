"""An effect over the angle is judged by the validation without being named there."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from actuator_lti import load_design
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design
from analyses.validation import CHECKS, validate
from analyses.validation.design_values import design_value_rows
from analyses.validation.places import Bench
from analyses.validation.small_signal import small_signal


def cogging(design: Design, share: float = 1.0) -> Design:
    motor = replace(design.motor, cogging_Nm=4e-3 * share, cogging_periods=12.0, cogging_phase_rad=2.5)
    return replace(design, motor=motor)


def gear_error(design: Design, share: float = 1.0) -> Design:
    load = replace(design.load, gear_error_Nm=0.3 * share, gear_error_periods=3.0, gear_error_phase_rad=2.5)
    return replace(design, load=load)


def verdicts(design: Design, model: Design, place: str) -> list[Verdict]:
    return [row.verdict for row in small_signal(Bench(design, model).place(place))]


@pytest.mark.parametrize(
    ("name", "effect"),
    [("ilr33-amber", cogging), ("fin", cogging), ("fin", gear_error)],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_green_with_it_red_where_one_side_is_one_per_cent_wrong(
    name: str, effect: Callable[..., Design]
) -> None:
    plain = load_design(name)
    design = effect(plain)
    for place in ("velocity", "u"):
        assert set(verdicts(design, design, place)) == {Verdict.MET}
        assert Verdict.NOT_MET in verdicts(design, effect(plain, 1.01), place)
        assert Verdict.NOT_MET in verdicts(effect(plain, 1.01), design, place)
        assert Verdict.NOT_MET in verdicts(design, plain, place)


def test_cogging_in_front_of_a_coupling_with_play() -> None:
    """Every row of the whole drive, not of a place alone."""
    plain = load_design("ilr33-amber-compliant")
    motor = replace(plain.motor, cogging_Nm=2e-3, cogging_periods=5.0)
    result = validate(replace(plain, motor=motor), CHECKS)
    assert plain.coupling.play_rad > 0.0
    assert result.tally.met == result.tally.total > 100
    assert result.passed


def test_every_number_of_a_spring_that_bends_is_confronted() -> None:
    """K1 to T1, K2 to T2, K3 beyond, as the data sheet of a strain wave gear of size 25 has them."""
    keys = {"coupling.torque_1": 14.0, "coupling.stiffness_2": 3.5e4, "coupling.torque_2": 48.0,
            "coupling.stiffness_3": 4.1e4}  # fmt: skip
    design = load_design("joint").with_values(keys)
    assert {row.verdict for row in design_value_rows(design)} == {Verdict.MET}
    for key, value in {**keys, "coupling.stiffness": 2.2e4}.items():
        for drive, model in ((1.0, 1.01), (1.01, 1.0)):
            one, other = (design.with_values({key: factor * value}) for factor in (drive, model))
            assert Verdict.NOT_MET in {row.verdict for row in design_value_rows(one, other)}, key
