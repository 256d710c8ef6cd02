"""Changing a design by dotted path, its tolerances, its hash and its warnings."""

import pickle
from contextlib import nullcontext

import pytest

from actuator_lti.design import (
    design_hash,
    load_design,
    parameter_value,
    paths_of,
    read_design_text,
    tolerances,
    with_overrides,
    with_values,
)
from actuator_lti.design.loader import design_text
from actuator_lti.errors import InputError

AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize("path", paths_of(AMBER))
def test_every_numeric_key_can_be_read_and_changed(path: str) -> None:
    value = parameter_value(AMBER, path)
    factor = 1.0 if path in ("encoder.difference_samples", "friction.breakaway_ratio") else 2.0
    factor = 0.5 if path in ("limits.continuous_current", "limits.speed", "limits.release") else factor
    changed = with_values(AMBER, {path: value * factor}, check=False)
    assert parameter_value(changed, path) == value * factor
    others = {p: parameter_value(changed, p) for p in paths_of(changed) if p != path}
    assert others == {p: parameter_value(AMBER, p) for p in paths_of(AMBER) if p != path}


def test_a_changed_value_says_what_it_was_with_its_relative_tolerance_or_the_absolute_one() -> None:
    parameter = with_values(AMBER, {"motor.resistance": 0.06}).parameters["motor.resistance"]
    assert (parameter.value, parameter.text) == (0.06, "0.06 ohm")
    assert parameter.source == "changed from 55 mohm"
    relative = with_values(AMBER, {"load.inertia": 4e-4}).parameters["load.inertia"].tolerance
    assert relative.half_width == pytest.approx(2e-4)
    emps = load_design("emps")
    absolute = with_values(emps, {"motor.rotor_inertia": 200.0}).parameters["motor.rotor_inertia"].tolerance
    assert absolute == emps.parameters["motor.rotor_inertia"].tolerance


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"motor.resistence": 1.0}, 'nearest known: "motor.resistance"'),
        ({"gear.bevel.ratio": 2.0}, "has no gear.bevel"),
        ({"gear.ratio": 2.0}, "unknown parameter"),
        ({"friction.law": 1.0}, "unknown parameter"),
        ({"motor.resistance": -1.0}, "above 0"),
        ({"motor.resistance": float("nan")}, "above 0"),
        ({"motor.resistance": True}, "a number"),
        ({"control.velocity.every": 1.5}, "whole number"),
        ({"motor.back_emf_constant": 0.01}, "within 10 %"),
    ],
)
def test_an_impossible_change_is_refused(values: dict[str, float], says: str) -> None:
    """Relations may be left unchecked for sampling, but not ranges."""
    with pytest.raises(InputError, match=says):
        with_values(AMBER, values)
    with nullcontext() if says == "within 10 %" else pytest.raises(InputError, match=says):
        with_values(AMBER, values, check=False)


def test_text_overrides_change_any_key_as_a_file_would() -> None:
    changed = with_overrides(
        AMBER,
        {
            "motor.resistance": "60 mohm",
            "gear.worm.ratio": 40,
            "friction.law": "tanh",
            "control.velocity.every": 2,
            "control.position.every": 10,
            "validation.loads": ["0 N*m", "4 N*m"],
            "requirement.position-bandwidth.minimum": "20 Hz",
            "design.name": "variant",
            "load.inertia": {"value": "1e-4 kg*m^2", "source": "weighed"},
        },
    )
    assert changed.motor.resistance_ohm == 0.06
    assert changed.total_ratio == 66 * 40
    assert changed.friction.law == "tanh"
    assert changed.controller.position.every == 10
    assert changed.validation.loads_Nm == (0.0, 4.0)
    assert {r.id: r.minimum for r in changed.requirements}["position-bandwidth"] == 20.0
    assert changed.name == "variant"
    assert changed.parameters["load.inertia"].source == "weighed"
    assert changed.parameters["load.inertia"].tolerance is None


@pytest.mark.parametrize(
    "path", ["motor.resistence", "gear.bevel.ratio", "x", "design", "motor.resistance.a.b", "gear.worm", ""]
)
def test_an_override_of_an_unknown_key_is_refused(path: str) -> None:
    with pytest.raises(InputError):
        with_overrides(AMBER, {path: "1 ohm"})


def test_the_hash_sees_values_and_requirements_and_nothing_else() -> None:
    respelled = with_overrides(AMBER, {"motor.inductance": "0.006 mH", "motor.resistance": "0.055 ohm"})
    assert design_hash(respelled) == design_hash(AMBER)
    text = "# mine\n" + design_text("ilr33-amber").replace('source = "tuned here"', 'source = "elsewhere"')
    assert design_hash(read_design_text(text, "elsewhere")) == design_hash(AMBER)
    for change in (
        {"motor.inductance": "6.1 uH"},
        {"requirement.gain-margin.minimum": "7 dB"},
        {"load.inertia": {"value": "2e-4 kg*m^2", "tolerance": "40 %"}},
        {"friction.law": "tanh"},
    ):
        assert design_hash(with_overrides(AMBER, change)) != design_hash(AMBER)


def test_designs_can_be_sent_to_workers_and_kept_in_caches() -> None:
    copy = pickle.loads(pickle.dumps(AMBER))
    assert copy == AMBER
    assert hash(copy) == hash(AMBER)


def test_tolerances_are_listed_in_the_order_of_the_file() -> None:
    listed = [(path, nominal, width.half_width / nominal) for path, nominal, width in tolerances(AMBER)]
    assert listed == [
        ("gear.planetary.input_inertia", 1e-7, pytest.approx(0.5)),
        ("gear.planetary.output_inertia", 5e-7, pytest.approx(0.5)),
        ("gear.worm.input_inertia", 5e-7, pytest.approx(0.5)),
        ("load.inertia", 2e-4, pytest.approx(0.5)),
    ]
