"""A design as a design file again, nothing lost but the comments; text overrides; the hash."""

import hashlib
import json
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, is_dataclass, replace
from dataclasses import fields as dataclass_fields
from math import inf, isclose, isfinite
from numbers import Integral, Real
from typing import Any, cast

import tomli_w

from actuator_lti.asked.quantities import unit_words
from actuator_lti.design.access import located, parameter_value, paths_of, stacked, unit_in_file
from actuator_lti.design.asked import ControllerObjects, Parameter, Tolerance, default_deflection
from actuator_lti.design.data_sheet import as_stated
from actuator_lti.design.fields import RECORDS, SECTIONS, TABLES, Section, field_of, fields_in, parts_of
from actuator_lti.design.loader import as_design, design_from_tree, design_text, read_design_text
from actuator_lti.design.mistakes import UNREAD, Findings
from actuator_lti.design.model import Design
from actuator_lti.design.plant import torque_per_command
from actuator_lti.design.reader import Reader
from actuator_lti.design.settings_file import object_entry
from actuator_lti.design.spellings import split_quantity
from actuator_lti.design.tolerances import tolerances
from actuator_lti.design.units import ampere_unit, si_text
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, parse_toml, shown

# Mostly not said, or later than designs that are known by their hash
_WHICH = ("rotor", "to", "locking_gear", "law", "continuous", "speed_rad_s", "current_A", "ramp_s")


def write_design(design: Design) -> str:
    """The design as TOML that :func:`read_design_text` turns back into an equal design, without comments."""
    return tomli_w.dumps(design_tree(as_design(design)))


def write_changed(before: Design, after: Design) -> str:
    """A changed design as its own file with what differs; written anew where that reads as another design."""
    with suppress(InputError):
        raw = parse_toml(design_text(before.origin), before.origin)
        text = tomli_w.dumps(_changed(raw, design_tree(as_design(before.origin)), design_tree(after)))
        if design_hash(read_design_text(text)) == design_hash(after):
            return text
    return f"# What its file derives from a data sheet stands here as computed.\n{write_design(after)}"


def _changed(raw: Tree, old: Tree, new: Tree) -> Tree:
    made = {key: value for key, value in raw.items() if key in new or key not in old}
    for key, value in new.items():
        was, said = old.get(key), raw.get(key)
        if value == was:
            continue
        made[key] = value
        if isinstance(value, dict) and isinstance(was, dict) and isinstance(said, dict):
            made[key] = value if "value" in value else _changed(said, was, value)
        elif isinstance(value, dict) and isinstance(said, str) and "source" in value:
            made[key] = {**value, "source": f"changed from {said}"}
    return made


def design_tree(design: Design) -> Tree:
    """The tree of plain values behind :func:`write_design`."""
    design = by_its_own_numbers(design)
    head = {"name": design.name, "title": design.title, "axis": design.axis}
    head |= {key: getattr(design, key) for key in ("revision", "description") if getattr(design, key)}
    tree: Tree = {"design": head}
    for section, path, part in parts_of(design):
        table = _table(design, part, path, section)
        here = tree
        for name in section.path.split(".")[:-1]:
            here = here.setdefault(name, {})
        if section.many:
            named = {"name": part.name} if section.many == "named" else {}
            here.setdefault(section.key, []).append({**named, **table})
        elif table or section.required or section.optional:
            here[section.key] = table
    for record in RECORDS:
        tree[record.key] = [_table(design, item, "", record) for item in getattr(design, record.attribute)]
    if design.objects != ControllerObjects():
        tree["objects"] = {
            "velocity_gain_factor": design.objects.velocity_gain_factor,
            "values": {item.label: object_entry(item) for item in design.objects.values},
            **({"family": design.objects.family} if design.objects.family else {}),
        }
    return {key: value for key, value in tree.items() if value != []}  # an empty [supply] is one


def by_its_own_numbers(design: Design) -> Design:
    """The same drive as a file can say it: feed-forward as shares of its own numbers, not the nominal's."""
    if design.nominal is None:
        return design
    own = replace(design, nominal=None)
    set_for, now = (_whole_shares(one.controller_model) for one in (design, own))
    there = now.keys() & paths_of(own)
    return stacked(own, {path: parameter_value(own, path) * set_for[path] / now[path] for path in there})


def _whole_shares(model: Design) -> dict[str, Any]:
    """What a share of 1 of each feed-forward is to a controller that is set for this drive."""
    motor, inertia = model.effective_motor, model.inertia_kgm2
    return {
        "control.position.acceleration_feedforward": inertia / torque_per_command(model),
        "control.current.resistance_feedforward": motor.resistance_ohm,
        "control.current.back_emf_feedforward": motor.back_emf_constant_Vs_rad,
    }


def _table(design: Design, part: Any, name: str, section: Section) -> Tree:
    table: Tree = {}
    for field in fields_in(section.template):
        value, path = getattr(part, field.attribute), f"{name}.{field.key}"
        known = design.parameters.get(path)
        if known is not None and known.value == value:
            table[field.key] = _entry(known, unit_in_file(design, path, field))
        elif value is not None and value != inf and (value != field.default or path in design.written):
            unit = unit_in_file(design, path, field)
            if field.kind == "limit":
                unit = ampere_unit("limits.", part.unit, design.motor.constants)
            table[field.key] = _bare(value, unit)
    unsaid = name == "validation" and not any(path.startswith("validation.") for path in design.parameters)
    if unsaid and len(table) == 1 and part.full_deflection_rad == default_deflection(design.axis):
        return {}
    return table


def _bare(value: Any, unit: str) -> Any:
    if isinstance(value, tuple):
        return [_bare(item, unit) for item in value]
    return value if isinstance(value, str | bool) or unit == "1" else si_text(value, unit)


def _written(text: str) -> str | int | float:
    """A number where the text is exactly the number's own spelling, else the text."""
    for kind in (int, float):
        with suppress(ValueError):
            if repr(number := kind(text)) == text:
                return number
    return text


def _entry(known: Parameter, unit: str) -> Any:
    value = _written(known.text)
    more: Tree = {key: getattr(known, key) for key in ("source", "grade") if getattr(known, key)}
    if known.tolerance is not None:
        more["tolerance"] = _tolerance(known.tolerance, unit)
    return {"value": value, **more} if more else value


def _tolerance(tolerance: Tolerance, unit: str) -> Any:
    text = _written(tolerance.text) if tolerance.text else _bare(tolerance.width, unit)
    if tolerance.kind == "uniform":
        return text
    bounds = {key: getattr(tolerance, key) for key in ("lower", "upper") if isfinite(getattr(tolerance, key))}
    return {"kind": tolerance.kind, "std": text, **{key: _bare(bound, unit) for key, bound in bounds.items()}}


def with_overrides(design: Design, overrides: Mapping[str, Any]) -> Design:
    """A copy of a design with keys changed as a design file would write them.

    By dotted path a text, number, list or table: ``{"motor.resistance": "60 mohm", "friction.law": "tanh",
    "gear.worm.ratio": 40}``.  A number replaces the value and drops its source; a table the whole entry;
    None takes the key away. An InputError as of :func:`load_design`, also for an unknown key.
    """
    tree = design_tree(design)
    as_stated(tree, overrides)
    for path, value in overrides.items():
        override(tree, path, _plain(value), design)
    return design_from_tree(tree, design.origin or design.name)


def _plain(value: Any) -> Any:
    """What a file may hold: real numbers of other kinds, as numpy's, are Python's."""
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)


def with_filter(design: Design, stage: str, keys: Mapping[str, Any]) -> Design:
    """A copy of a design with one more filter of the velocity loop, see `Design.add_filter`."""
    if stage != "velocity" or design.controller.velocity is None:
        known = '"velocity"' if design.controller.velocity is not None else "none: no velocity loop"
        raise InputError(f"stage = {shown(stage)}: has no filters; allowed: {known}")
    path = "control.velocity.filter"
    there = design_tree(design)["control"]["velocity"].get("filter", [])
    units = with_units(design, {f"{path}.1.{key}": value for key, value in keys.items()})
    return with_overrides(design, {path: [*there, {at.rpartition(".")[2]: one for at, one in units.items()}]})


def with_units(design: Design, values: Mapping[str, Any]) -> Tree:
    """The same changes as a design file writes them: plain numbers get the SI unit of their key."""
    if not isinstance(values, Mapping):
        raise InputError(f"values = {shown(values)}: allowed: dotted keys with their values, in a mapping")
    result = {path: _plain(value) for path, value in values.items()}
    for path, value in [*result.items()]:
        if not isinstance(path, str):
            raise InputError(f"key = {shown(path)}: allowed: a dotted key, such as limits.voltage")
        if (field := field_of(path)) is not None and field.kind == "quantity":
            unit = unit_in_file(design, path, field)
            if unit != "1" and isinstance(value, int | float) and not isinstance(value, bool):
                result[path] = si_text(float(value), unit)
    return result


def read_value(design: Design, path: str, text: str | float) -> float:
    """A key's value in SI as the file would read a text; a bare number is in SI. InputError: not allowed."""
    field, _ = located(design, path)
    with suppress(ValueError):
        text = with_units(design, {path: float(text)})[path]
    findings = Findings(design.origin or design.name)
    reader = Reader(design_tree(design), findings)
    value = reader.entry(field, text, path, {})
    if value is UNREAD:  # a gain that says what it does with the drive
        value = getattr(located(reader.with_gains(design), path)[1], field.attribute)
    findings.refuse()
    return cast("float", value)


def unit_as_stated(design: Design, path: str) -> tuple[str, float]:
    """The unit in which a design's file states a key, and SI over it.

    That of SI where the file has none, or one in which half the number is not half the value (rpm/V).

    >>> from actuator_lti.design import load_design
    >>> unit, in_SI = unit_as_stated(load_design("ilr33-amber"), "motor.rotor_inertia")
    >>> unit, f"{in_SI:g}"
    ('g*cm^2', '1e-07')
    """
    known = design.parameters.get(path)
    with suppress(ValueError, ZeroDivisionError):
        number, unit = split_quantity("" if known is None else known.text)
        if unit and known is not None:
            half = read_value(design, path, f"{0.5 * number!r} {unit}")
            if isclose(half, 0.5 * known.value, rel_tol=1e-12):
                return unit, known.value / number
    return unit_in_file(design, path, located(design, path)[0]), 1.0


def value_as_stated(design: Design, path: str, value: float) -> str:
    """A value of a key to four digits, in the unit in which the design's file states that key."""
    unit, per_SI = unit_as_stated(design, path)
    return f"{value / per_SI:.4g} {unit_words(unit)}".rstrip()


def override(tree: Tree, path: str, value: Any, design: Design) -> None:
    """Change one key in the tree of a design's file, without a look at the value; ``None`` takes it out."""
    parts = path.split(".")
    here: Any = tree
    lists = [section.path for section in TABLES if section.many]
    for depth, part in enumerate(parts[:-1]):
        if isinstance(here, list):
            here = next((item for k, item in enumerate(here, 1) if _label(item, k) == part), None)
        elif isinstance(here, dict):
            here = here.setdefault(part, [] if ".".join(parts[: depth + 1]) in lists else {})
        if here is None:
            raise InputError(f"{path}: the design {design.name} has no {'.'.join(parts[: depth + 1])}")
    if isinstance(here, list):
        table = path.rpartition(".")[0]
        names = [f"{table}.{_label(item, k)}.{parts[-1]}" for k, item in enumerate(here, 1)]
        raise InputError(f"{path}: which one? allowed: {', '.join(names) or f'none, no [[{table}]]'}")
    if not isinstance(here, dict):
        raise InputError(f"{path}: unknown key; allowed: a key of the design file")
    if value is None:
        here.pop(parts[-1], None)
        return
    old = here.get(parts[-1])
    if isinstance(old, dict) and "value" in old and not isinstance(value, Mapping):
        kept = {"tolerance": old["tolerance"]} if "tolerance" in old and not _width_gone(old, value) else {}
        said = {"source": f"changed from {old['value']}"} if len(old) > 1 else {}
        made = {"value": value, **said, **kept}
        for gone in old.keys() - made.keys():
            del old[gone]
        old.update(made)  # in its place: a text keeps its layout
        return
    here[parts[-1]] = value


def _width_gone(old: Tree, value: Any) -> bool:
    """Whether a relative tolerance would be that of a value of zero, which has none."""
    relative = isinstance(old["tolerance"], str) and old["tolerance"].strip().endswith("%")
    number = re.match(r"\s*[-+]?[\d.]+(e[-+]?\d+)?", str(value), re.IGNORECASE)
    return relative and number is not None and float(number[0]) == 0.0


def _label(item: Tree, number: int) -> str:
    return str(item.get("id", item.get("name", number)))


def design_hash(design: Design) -> str:
    """SHA-256 (hex) of all values in SI to 12 digits, tolerances, requirements; not of titles or sources."""
    design = by_its_own_numbers(as_design(design))
    parts = [section for section in SECTIONS if not section.parent]
    top = {part.place for part in parts if not part.asked or getattr(design, part.place) is not None}
    content = {key: _canonical(getattr(design, key)) for key in ("axis", *sorted(top))}
    content["requirements"] = sorted((_canonical(item) for item in design.requirements), key=str)
    content |= {"waivers": [asdict(item) for item in design.waivers]} if design.waivers else {}
    content["correlations"] = sorted((_canonical(item) for item in design.correlations), key=str)
    content["tolerances"] = {path: _canonical(tolerance) for path, _, tolerance in tolerances(design)}
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _canonical(value: Any) -> Any:
    if is_dataclass(value):
        skipped = ("source", "note", "text", "name")
        names = [item.name for item in dataclass_fields(value) if item.name not in skipped]
        names = [name for name in names if name not in _WHICH or getattr(value, name) is not None]
        return {name: _canonical(getattr(value, name)) for name in names}
    if isinstance(value, tuple):
        return [_canonical(item) for item in value]
    return value if isinstance(value, bool | str | None) else format(float(value), ".12g")
