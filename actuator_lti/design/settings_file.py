"""Files of controller settings: found out, read and written; the XML kind in its own module."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from actuator_lti.design.model import ControllerObject, ControllerObjects, ObjectFamily
from actuator_lti.design.object_dictionary import OBJECTS
from actuator_lti.design.objects import checked_objects
from actuator_lti.design.settings_xml import read_settings_xml
from actuator_lti.errors import InputError
from actuator_lti.files.reading import decode, parse_toml, read_bytes, shown

_LABEL = re.compile(r"(?:0[xX])?([0-9A-Fa-f]{4})(?:\.([0-9A-Fa-f]{2}))?\Z")


def read_settings(path: str | Path, velocity_gain_factor: float | None = None) -> ControllerObjects:
    """Read a settings file; XML where it begins with ``<``, else TOML.

    The factor is 1 (per rad/s) or 9.549 (per rpm); without it what a TOML file says, else 1.
    """
    where = shown(str(path), 200)[1:-1]
    text = decode(read_bytes(Path(path), "settings file"), where)
    read = read_settings_xml if text.lstrip().startswith("<") else read_settings_toml
    return read(text, where, velocity_gain_factor)


def parse_label(label: str, where: str) -> tuple[int, int]:
    """Index and subindex of ``"0x2344.01"`` or ``"0x6080"``."""
    match = _LABEL.match(label)
    if match is None:
        raise InputError(f'{shown(label)}: allowed: an object such as "0x2344.01" or "0x6080"', where=where)
    return int(match.group(1), 16), int(match.group(2) or "0", 16)


def object_from(label: str, raw: Any, where: str) -> ControllerObject:
    """One object from its entry in TOML: an integer, or a table with value, name and data_type."""
    index, subindex = parse_label(label, where)
    table = raw if isinstance(raw, dict) else {"value": raw}
    unknown = set(table) - {"value", "name", "data_type"}
    value = table.get("value")
    if unknown or isinstance(value, bool) or not isinstance(value, int):
        raise InputError(
            f"{label} = {shown(value)}: allowed: a whole number, or a table with value, name, data_type",
            where=where,
        )
    texts = {key: table.get(key, "") for key in ("name", "data_type")}
    if not all(isinstance(text, str) for text in texts.values()):
        raise InputError(f"{label}: name and data_type are texts", where=where)
    return ControllerObject(index=index, subindex=subindex, value=value, **texts)


def object_entry(item: ControllerObject) -> Any:
    """The entry of one object in TOML."""
    more = {key: getattr(item, key) for key in ("name", "data_type") if getattr(item, key)}
    return {"value": item.value, **more} if more else item.value


def objects_from(
    raw: Any, where: str, factor: float | None = None, values: str = "values"
) -> ControllerObjects:
    """Settings as a table: the calibration of the velocity gain, the family, and the objects.

    ``values`` is the key of the objects: in ``[objects]`` of a design file ``"values"``.
    """
    known = ("velocity_gain_factor", "family", values)
    table = raw if isinstance(raw, dict) else {"": raw}
    for key in table:
        if key not in known:
            raise InputError(f"{shown(key)}: unknown key; allowed: {', '.join(known)}", where=where)
    entries, family = table.get(values, {}), table.get("family", "")
    if not isinstance(entries, dict):
        raise InputError(f"{values} = {shown(entries)}: allowed: a table", where=where)
    if family not in get_args(ObjectFamily):
        allowed = " or ".join(f'"{one}"' for one in get_args(ObjectFamily))
        raise InputError(f"family = {shown(family)}: allowed: {allowed}", where=where)
    read = tuple(object_from(label, entry, where) for label, entry in entries.items())
    factor = table.get("velocity_gain_factor", 1.0) if factor is None else factor
    return replace(checked_objects(read, factor, where), family=family)


def read_settings_toml(text: str, where: str, velocity_gain_factor: float | None = None) -> ControllerObjects:
    """Settings from TOML: ``velocity_gain_factor``, and ``"0x2344.01" = 120000`` in a table ``[objects]``."""
    result = objects_from(parse_toml(text, where), where, velocity_gain_factor, "objects")
    if not result.values:
        allowed = 'allowed: a table with entries such as "0x2344.01" = 344'
        raise InputError(f"objects: missing; {allowed}", where=where)
    return result


def write_settings_toml(objects: ControllerObjects) -> str:
    """Settings as TOML, each known object with its meaning and unit beside it."""
    import tomli_w

    lines = [
        "# Settings of the motion controller, in the units of its own objects.",
        f"velocity_gain_factor = {objects.velocity_gain_factor!r}  # 1: 0x2344.01 per rad/s; 9.549: per rpm",
        "",
        "[objects]",
    ]
    for item in objects.values:
        entry = object_entry(item)
        text = tomli_w.dumps({"x": [entry]}, indent=0) if isinstance(entry, dict) else ""
        inline = text.partition("[")[2].rpartition("]")[0].strip().rstrip(",") if text else str(entry)
        known = OBJECTS.get((item.index, item.subindex))
        comment = f"  # {known.meaning}, {known.unit}" if known else "  # kept as it came"
        lines.append(f'"{item.label}" = {inline}{comment}')
    return "\n".join(lines) + "\n"
