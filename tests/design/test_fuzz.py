"""What is taken of a design survives being written, in any order, changed and changed back."""

from typing import Any

import pytest
import tomli_w
from design_strategies import design_trees
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from actuator_lti.design import (
    Design,
    design_hash,
    load_design,
    read_design_text,
    shipped_designs,
    tolerances,
    with_values,
    write_design,
)
from actuator_lti.errors import InputError

RELAXED = settings(max_examples=60, suppress_health_check=list(HealthCheck))


@RELAXED
@given(st.text(max_size=40))
def test_any_name_of_a_design(name: str) -> None:
    """What a file may hold is damaged in tests/hardness."""
    said = ""
    try:
        load_design(name)
    except InputError as error:
        said = str(error)
    assert all(line.isprintable() and len(line) < 2000 for line in said.split("\n"))


def survives(design: Design) -> None:
    again = read_design_text(write_design(design), design.origin)
    assert again == design
    assert write_design(again) == write_design(design)
    assert design_hash(again) == design_hash(design)


@pytest.mark.parametrize("name", shipped_designs())
def test_a_shipped_design_survives_being_written(name: str) -> None:
    survives(load_design(name))


NEEDING_OTHERS: dict[str, object] = {
    "coupling.torque_1": "14 N*m", "coupling.stiffness_2": "2e4 N*m/rad",
    "coupling.torque_2": "48 N*m", "coupling.stiffness_3": "3e4 N*m/rad",
    "limits.current_rate": "2000 A/s", "limits.continuous_current": "1.5 A", "limits.release": 0.8,
    "control.current.anti_windup": "back-calculation", "control.current.tracking_time": "3 ms",
    "control.current.resistance_feedforward": 0.4, "load.moment_damping": "0.02 N*m*s/rad",
    "load.friction.offset_torque": "0.3 N*m", "load.friction.breakaway_ratio": 1.5,
    "temperature": {"winding": "80 degC", "magnet": "60 degC", "magnet_coefficient": "-0.2 %/K"},
}  # fmt: skip


OF_AN_INTEGRAL: dict[str, object] = {
    "control.velocity.anti_windup": "back-calculation", "control.velocity.tracking_time": "7 ms",
    "control.velocity.filter": [
        {"kind": "skewed-notch", "zero": "80 Hz", "pole": "90 Hz", "width": "20 Hz", "depth": 0.1},
        {"kind": "lowpass", "frequency": "300 Hz", "order": 2, "damping": 0.6, "on": "speed"},
    ],
}  # fmt: skip


def test_keys_that_need_others_and_tables_without_keys_survive() -> None:
    """None of them is drawn alone: each is refused, or means nothing, without its neighbour."""
    for name, values in (("joint", NEEDING_OTHERS), ("ilr33-amber", OF_AN_INTEGRAL)):
        survives(load_design(name).with_values(values))
    empty: dict[str, object] = {name: {} for name in ("supply", "temperature", "failure", "duty")}
    drive = load_design("ilr33-amber").with_values(empty)
    assert None not in [getattr(drive, name) for name in empty]
    survives(drive)


@RELAXED
@given(design_trees())
def test_any_design_survives_being_written(tree: dict[str, Any]) -> None:
    survives(read_design_text(tomli_w.dumps(tree), "any"))


@RELAXED
@given(design_trees(), st.randoms(use_true_random=False))
def test_the_order_of_keys_does_not_matter(tree: dict[str, Any], random: Any) -> None:
    def shuffled(value: Any) -> Any:
        if not isinstance(value, dict):
            return [shuffled(item) for item in value] if isinstance(value, list) else value
        items = list(value.items())
        random.shuffle(items)
        return {key: shuffled(item) for key, item in items}

    first = read_design_text(tomli_w.dumps(tree), "any")
    second = read_design_text(tomli_w.dumps(shuffled(tree)), "any")
    assert design_hash(first) == design_hash(second)


@RELAXED
@given(design_trees(), st.floats(0.9, 1.1))
def test_a_changed_design_survives_too_and_can_be_changed_back(tree: dict[str, Any], factor: float) -> None:
    design = read_design_text(tomli_w.dumps(tree), "any")
    nominal = {path: value for path, value, _ in tolerances(design)}
    try:
        changed = with_values(design, {path: value * factor for path, value in nominal.items()})
    except InputError:  # a supply that no longer reaches the speed, say
        reject()
    assert read_design_text(write_design(changed), "any") == changed
    back = with_values(changed, nominal, check=False)
    assert design_hash(back) == design_hash(design)
