"""pydantic's findings on the shape of a design file, as one line that a reader can act on."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError

from actuator_lti.design.fields import FIELDS, field_of
from actuator_lti.design.schema import MAX_GEARS, MAX_LIST, document_model
from actuator_lti.design.sections import BY_PATH, children
from actuator_lti.errors import InputError
from actuator_lti.reading import shown
from actuator_lti.tree import Tree

_KEYS = {
    "requirement": ("id", "quantity", "loop", "rotor", "to", "minimum", "maximum", "load", "source", "note"),
    "waiver": ("requirement", "reason", "date"),
    "correlation": ("first", "second", "coefficient"),
    "fact": ("label", "value", "source", "grade"),
    "objects": ("velocity_gain_factor", "values"),
    "tolerance": ("kind", "half_width", "std", "lower", "upper"),
}
_KEYS_OF_TABLES = ("requirement", "waiver", "correlation", "fact", "objects")
_VALUE = ("value", "source", "grade", "tolerance")


def validated(tree: Tree, where: str) -> Any:
    """The tree as the pydantic model of a design file, or the first finding as an InputError."""
    try:
        return document_model().model_validate(tree)
    except ValidationError as error:
        findings = error.errors(include_url=False)
        telling = [item for item in findings if item["type"] in ("extra_forbidden", "literal_error")]
        raise InputError(_line((telling or findings)[0], tree), where=where) from None
    except RecursionError:
        raise InputError("nested too deeply", where=where) from None


def _line(finding: Any, tree: Tree) -> str:
    steps, last = finding["loc"], len(finding["loc"]) - 1
    unknown = (
        finding["type"] == "extra_forbidden"
    )  # then the last step is a key as written, whatever it holds
    location = [
        part
        for k, part in enumerate(steps)
        if isinstance(part, int) or "[" not in part or (unknown and k == last)
    ]
    location = [part for part in location if part not in ("RawTolerance", "str", "int", "float")]
    path = _dotted(location, tree)
    kind, given = finding["type"], shown(finding.get("input"))
    if kind == "extra_forbidden":
        known = known_keys(location[:-1])
        return (
            f"{path} = {given}: unknown key{nearest(str(location[-1]), known)}; allowed: {', '.join(known)}"
        )
    if kind == "missing":
        return f"{path}: missing{_example(path)}"
    if kind == "literal_error":
        return f"{path} = {given}: allowed: {finding['ctx']['expected'].replace(chr(39), chr(34))}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        scalar = len(location) > 1 and _field_name(location) in FIELDS
        return (
            f"{path} = {given}: allowed: {'a number with its unit' if scalar else 'a table'}{_example(path)}"
        )
    if kind == "list_type":
        many = f"[[{path}]] tables" if path in _KEYS or (path in BY_PATH and BY_PATH[path].many) else "a list"
        return f"{path} = {given}: allowed: {many}"
    if kind in ("too_long", "too_short"):
        return f"{path}: allowed: 1 to {MAX_GEARS if path == 'gear' else MAX_LIST} items"
    if location and location[-1] == "tolerance":
        return f'{path} = {given}: allowed: a half width such as "50 %", or a table'
    if location and location[-1] == "value" and len(location) > 1 and location[0] != "fact":
        return f"{path} = {given}: allowed: a number, with its unit as text"
    if kind.startswith("string") or (len(location) and location[-1] in ("source", "grade", "note")):
        return f"{path} = {given}: allowed: text"
    return f"{path} = {given}: allowed: a number with its unit, as text{_example(path)}"


def _field_name(location: list[Any]) -> str:
    return ".".join("*" if isinstance(part, int) else str(part) for part in location)


def _example(path: str) -> str:
    field = field_of(path.replace("[", ".").replace("]", ""))
    if field is None:
        return ""
    return (
        f'; example: {field.key} = "{field.example}" ({field.description})'
        if field.example
        else (f"; it is the {field.description}")
    )


def _dotted(location: list[Any], tree: Tree) -> str:
    """``gear.planetary.ratio`` rather than ``gear.0.ratio``."""
    parts: list[str] = []
    here: Any = tree
    for part in location:
        if isinstance(part, int):
            here = here[part] if isinstance(here, list) and part < len(here) else None
            label = (here.get("name") or here.get("id")) if isinstance(here, dict) else None
            parts.append(shown(label)[1:-1] if isinstance(label, str) else f"[{part + 1}]")
        else:
            here = here.get(part) if isinstance(here, dict) else None
            parts.append(shown(str(part))[1:-1])
    return ".".join(parts).replace(".[", "[")


def known_keys(location: list[Any]) -> list[str]:
    """Keys allowed at a place of the document."""
    section = _field_name(location)
    if not section:
        return ["design", *(item.key for item in children("")), *_KEYS_OF_TABLES]
    names = section.split(".")
    if names[-1] in _KEYS or (names[0] in _KEYS and len(names) == 2):
        return list(_KEYS[names[-1] if names[-1] in _KEYS else names[0]])
    keys = [field.key for field in FIELDS.values() if field.section == section]
    keys += [item.key for item in children(section)]
    return (["name", *keys] if section == "gear.*" else keys) or list(_VALUE)


def nearest(key: str, known: list[str] | tuple[str, ...]) -> str:
    """`` (nearest known: "x")``, or nothing where none is near."""
    near = get_close_matches(key, known, 1, 0.5)
    return f' (nearest known: "{near[0]}")' if near else ""
