"""A design written and read again is the same design, whatever its stages and spellings."""

from typing import Any

import pytest
import tomli_w
from design_strategies import design_trees
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actuator_lti.design import (
    design_hash,
    load_design,
    read_design_text,
    shipped_designs,
    tolerances,
    with_values,
    write_design,
)

RELAXED = settings(max_examples=60, suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize("name", shipped_designs())
def test_a_shipped_design_survives_being_written(name: str) -> None:
    design = load_design(name)
    again = read_design_text(write_design(design), name)
    assert again == design
    assert write_design(again) == write_design(design)
    assert design_hash(again) == design_hash(design)


@RELAXED
@given(design_trees())
def test_any_design_survives_being_written(tree: dict[str, Any]) -> None:
    design = read_design_text(tomli_w.dumps(tree), "any")
    again = read_design_text(write_design(design), "any")
    assert again == design
    assert design_hash(again) == design_hash(design)


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
    changed = with_values(design, {path: value * factor for path, value in nominal.items()}, check=False)
    assert read_design_text(write_design(changed), "any") == changed
    back = with_values(changed, nominal, check=False)
    assert design_hash(back) == design_hash(design)
