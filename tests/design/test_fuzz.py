"""What is taken of a design survives being written, in any order, changed and changed back.

Random design files: any drive, pedigree and further keys.
"""

import copy
from collections.abc import Iterator
from typing import Any

import pytest
import tomli_w
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from actuator_lti.design import (
    Design,
    design_hash,
    design_tree,
    load_design,
    read_design_text,
    shipped_designs,
    tolerances,
    with_values,
    write_design,
)
from actuator_lti.design.access import unit_in_file
from actuator_lti.design.field import BIG, Field, Structure
from actuator_lti.design.fields import FIELDS, field_of, template_of
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.writing import override
from actuator_lti.errors import InputError
from tests.validation.random_drives import full_drive

_texts = st.text(st.characters(min_codepoint=32, max_codepoint=0x24F, exclude_categories=("C",)), max_size=20)
_factors = st.floats(0.25, 4.0).map(lambda x: float(f"{x:.6g}"))
_KINDS = {"choice", "text", "flag", "integer", "quantities", "quantity"}
_PLAIN = [path for path in FIELDS if ".law." not in path and "*" not in path]
_GROWN = [
    *((path,) for path in _PLAIN if FIELDS[path].kind in _KINDS),
    *((f"gear.g0.{key}",) for key in ("input_inertia", "output_inertia")),
    ("coupling.torque_1", "coupling.stiffness_2"),
    ("coupling.torque_1", "coupling.stiffness_2", "coupling.torque_2", "coupling.stiffness_3"),
    ("load.gravity.mass", "load.gravity.arm", "load.path"),
    ("encoder.speed", "encoder.bandwidth"),
    ("supply.regenerative", "supply.capacitance"),
]  # fmt: skip
_LIMITS = {"gain_margin": "6.5 dB", "bandwidth": "90 rpm", "delay_margin": "3 ms", "overshoot": "12 %",
           "modulus_margin": 0.4, "motor_current": "0.4 A dc"}  # fmt: skip


@st.composite
def written_value(draw: st.DrawFn, unit: str, number: float) -> Any:
    """A number with or without a pedigree; other spellings are those of shipped designs."""
    text = number if unit == "1" else f"{number!r} {unit}"
    if draw(st.booleans()):
        return text
    width = st.sampled_from(["5 %", {"kind": "normal", "std": "1 %"}, {"half_width": "0.5 %"}])
    more = {"source": _texts, "grade": st.sampled_from("ABCDX"), "tolerance": width}
    return {"value": text, **draw(st.fixed_dictionaries({}, optional=more))}


def _value(field: Field, structure: Structure) -> st.SearchStrategy[Any]:
    """What a key may have."""
    if field.kind in ("choice", "text", "flag"):
        plain = {"choice": st.sampled_from(field.choices or ("",)), "text": _texts, "flag": st.booleans()}
        return plain[field.kind]
    if field.kind == "integer":
        return st.integers(1, int(min(4, field.high)))
    unit = field.unit(structure)
    middle = 1.0 if field.high == BIG else min(1.0, field.high / 5)  # four times that, and 5 % more, fits
    if field.low < 0.0 and field.high < 1.0:  # a coefficient that is negative as a rule
        middle = -middle / 100
    if field.kind == "quantities":
        items = _factors.map(lambda x: x * middle if unit == "1" else f"{x * middle!r} {unit}")
        return st.lists(items, min_size=1, max_size=4)
    low = 4 * field.low if field.low >= 1.0 else 0.0
    return _factors.flatmap(lambda x: written_value(unit, max(x * middle, low)))


def leaves(tree: Any, path: str = "") -> Iterator[tuple[str, Any, str]]:
    """Each key of a tree that is a number with a unit or a word of a few: path, its table, its key there."""
    for key, value in tree.items():
        here = f"{path}.{key}".lstrip(".")
        if isinstance(value, list) and all(isinstance(item, dict) for item in value):
            for number, item in enumerate(value, 1):
                yield from leaves(item, f"{here}.{item.get('name', number)}")
        elif (field := field_of(here)) is not None:
            if field.kind in ("quantity", "integer", "choice", "flag") and here != "design.axis":
                yield here, tree, key
        elif isinstance(value, dict):
            yield from leaves(value, here)


def _numbers(tree: Any) -> Iterator[tuple[Any, str, Field, float]]:
    """Each number of a tree in SI that may have a tolerance of 5 %: its table, its key there, what it is."""
    for path, table, key in leaves(tree):
        field = FIELDS[template_of(path)]
        if field.kind == "quantity" and not isinstance(table[key], dict):
            number = float(f"{table[key]}".partition(" ")[0])
            if number and field.accepts(0.94 * number) and field.accepts(1.06 * number):
                yield table, key, field, number


def _with(tree: Any, values: dict[str, Any], design: Design) -> Any:
    """The tree with other values where a file may have them, else None."""
    grown = copy.deepcopy(tree)
    try:
        for path, value in values.items():
            override(grown, path, value, design)
        design_from_tree(grown, "any")
    except InputError:
        return None
    return grown


@st.composite
def design_trees(draw: st.DrawFn) -> dict[str, Any]:
    """A tree of a design file that is accepted."""
    drives = st.integers(0, 10**5).map(full_drive) | st.sampled_from(shipped_designs()).map(load_design)
    design: Design = draw(drives)
    structure, tree = Structure.of(design), design_tree(design)
    for table, key, field, number in [] if design.parameters else _numbers(tree):
        unit = unit_in_file(design, field.path, field)
        if draw(st.booleans()):
            table[key] = draw(written_value(unit, number))
    assume(_with(tree, {}, design))
    for paths in draw(st.lists(st.sampled_from(_GROWN), max_size=4)):
        values = {path: draw(_value(FIELDS[template_of(path)], structure)) for path in paths}
        tree = _with(tree, values, design) or tree
    sides = st.sampled_from(["minimum", "maximum"])
    limited = draw(st.lists(st.sampled_from(sorted(_LIMITS)), max_size=4))
    tree["requirement"] = [
        {"id": f"r{number}", "quantity": one, "source": draw(_texts), draw(sides): _LIMITS[one]}
        | ({"load": 0} if one == "motor_current" else {"loop": "every"})
        for number, one in enumerate(limited)
    ]
    tree["fact"] = draw(st.lists(st.fixed_dictionaries({"label": _texts, "value": _texts}), max_size=2))
    return {key: value for key, value in tree.items() if key != "waiver"}


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


def _shuffled(value: Any, random: Any) -> Any:
    if not isinstance(value, dict):
        return [_shuffled(item, random) for item in value] if isinstance(value, list) else value
    items = list(value.items())
    random.shuffle(items)
    return {key: _shuffled(item, random) for key, item in items}


@RELAXED
@given(design_trees(), st.randoms(use_true_random=False), st.floats(0.9, 1.1))
def test_any_design_survives_being_written_in_any_order_changed_and_changed_back(tree, random, factor):
    design = read_design_text(tomli_w.dumps(tree), "any")
    survives(design)
    assert design_hash(read_design_text(tomli_w.dumps(_shuffled(tree, random)), "any")) == design_hash(design)
    nominal = {path: value for path, value, _ in tolerances(design)}
    try:
        changed = with_values(design, {path: value * factor for path, value in nominal.items()})
    except InputError:  # a supply that no longer reaches the speed, say
        return
    assert read_design_text(write_design(changed), "any") == changed
    assert design_hash(with_values(changed, nominal, check=False)) == design_hash(design)
