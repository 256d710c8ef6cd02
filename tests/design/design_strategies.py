"""Random design files for the property tests: any drive, pedigree and further keys."""

import copy
from collections.abc import Iterator
from typing import Any

from hypothesis import assume
from hypothesis import strategies as st

from actuator_lti.design import Design, design_tree, load_design, shipped_designs
from actuator_lti.design.access import unit_in_file
from actuator_lti.design.field import BIG, Field, Structure
from actuator_lti.design.fields import FIELDS, field_of, template_of
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.writing import _override
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


def _numbers(tree: Any, path: str = "") -> Iterator[tuple[Any, str, Field, float]]:
    """Each number of a tree in SI that may have a tolerance of 5 %: its table, its key there, what it is."""
    for key, value in tree.items():
        here = f"{path}.{key}".lstrip(".")
        if isinstance(value, dict) and "value" not in value:
            yield from _numbers(value, here)
        elif isinstance(value, list) and all(isinstance(item, dict) for item in value):
            for number, item in enumerate(value, 1):
                yield from _numbers(item, f"{here}.{item.get('name', number)}")
        elif (
            (field := field_of(here)) is not None and field.kind == "quantity" and not isinstance(value, dict)
        ):
            number = float(f"{value}".partition(" ")[0])
            if number and field.accepts(0.94 * number) and field.accepts(1.06 * number):
                yield tree, key, field, number


def _with(tree: Any, values: dict[str, Any], design: Design) -> Any:
    """The tree with other values where a file may have them, else None."""
    grown = copy.deepcopy(tree)
    try:
        for path, value in values.items():
            _override(grown, path, value, design)
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
