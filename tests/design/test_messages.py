"""What a mistyped value is answered with: one line that says what to write instead."""

import pytest

from actuator_lti.design import load_design, read_design_text, write_design
from actuator_lti.design.key_reference import key_reference
from actuator_lti.design.suspicions import warnings_of
from actuator_lti.design.writing import with_overrides
from actuator_lti.errors import InputError

AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("motor.resistance", "0,6 ohm", 'use a decimal point: "0.6 ohm"'),
        ("motor.inductance", "6 ohm", '"ohm" is the unit of a resistance'),
        ("control.position.gain", "20 Hz", "times 2 pi: 125.664 1/s"),
        ("motor.rotor_inertia", "3 kg", r"m \(p/2 pi\)\^2"),
        ("limits.voltage", "3 vots", 'nearest known: "volt'),
    ],
)
def test_a_wrong_unit_is_named_with_what_is_wanted(key: str, value: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        with_overrides(AMBER, {key: value})
    assert key in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_inertia_on_a_linear_axis() -> None:
    with pytest.raises(InputError, match=r"J \(2 pi/p\)\^2"):
        with_overrides(load_design("emps"), {"motor.rotor_inertia": "3 kg*cm^2"})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[motor]\nresistance = 55 mohm\n", 'line 2.*in quotes: resistance = "55 mohm"'),
        ("[motor]\nresistance = 0,6\n", "line 2.*decimal point: resistance = 0.6"),
        ("", "is empty"),
        ("# only a comment\n", "is empty"),
    ],
)
def test_slips_of_syntax(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_design_text(text)


def test_more_load_than_the_drive_can_hold_is_warned_of() -> None:
    held = 5.9e-3 * 12.0 * 2376  # kM i_peak N, without losses
    for moment, warned in ((0.99 * held, False), (1.01 * held, True)):
        design = with_overrides(AMBER, {"load.path": "back-drivable", "load.moment_max": f"{moment} N*m"})
        assert any("load.moment_max" in line for line in warnings_of(design)) is warned


def test_values_in_si_or_with_units_and_where_they_came_from() -> None:
    design = AMBER.with_values(
        {"control.position.gain": "90 1/s", "limits.voltage": 24.0, "friction.law": "tanh"}
    )
    assert (design.controller.position_loop.gain, design.limits.voltage_V) == (90.0, 24.0)
    assert design.friction.law == "tanh"
    assert design.parameters["control.position.gain"].source == "changed from 120 1/s"
    assert read_design_text(write_design(design), design.origin) == design
    with pytest.raises(InputError, match=r"motor\.resistanse.*nearest known"):
        AMBER.with_values({"motor.resistanse": 1.0})


def test_the_key_reference_has_every_key_once() -> None:
    paths = [entry.path for entry in key_reference()]
    assert len(paths) == len(set(paths)) > 100
    assert all(entry.description for entry in key_reference("linear"))
    assert {entry.unit for entry in key_reference("linear")} >= {"kg", "N", "m/s"}
