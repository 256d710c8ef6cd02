"""Controller settings as files, TOML or XML as a CANopen device configuration (``.xdc``)."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args
from xml.etree.ElementTree import Element, ParseError, SubElement, indent, register_namespace, tostring

from actuator_lti.bounds import TOML_BYTES, TOML_DEPTH
from actuator_lti.design.model import ControllerObject, ControllerObjects, ObjectFamily
from actuator_lti.design.object_dictionary import OBJECTS
from actuator_lti.design.objects import checked_objects
from actuator_lti.errors import InputError
from actuator_lti.files.reading import decode, parse_toml, read_bytes, shown

_INTEGER = re.compile(r"(?:[+-]?[0-9]{1,20}|0[xX][0-9A-Fa-f]{1,16})\Z")
_NAMESPACE = "http://www.canopen.org/xml/1.0"
_DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>\n'
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


def read_settings_xml(text: str, where: str, velocity_gain_factor: float | None = None) -> ControllerObjects:
    """Settings from XML: the actual values of its CANopen objects and sub-objects.

    No DTD, no entities and no external references are accepted.
    """
    values = objects_of_xml(text, where)
    if not values:
        raise InputError(
            "holds no CANopenObject with an actualValue, nor is it an MCConfiguration of a VESC",
            where=where,
        )
    return checked_objects(values, 1.0 if velocity_gain_factor is None else velocity_gain_factor, where)


def objects_of_xml(text: str, where: str) -> tuple[ControllerObject, ...]:
    """The objects of a device configuration that have an actual value."""
    return tuple(item for item, _ in _objects_in(parsed_xml(text, where), where))


def parsed_xml(text: str, where: str) -> Element:
    """Plain XML; no DTD, no entities, at most 1 MiB."""
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    if len(text) > TOML_BYTES.most:
        raise InputError("is larger than allowed: at most 1 MiB", where=where)
    try:
        root: Element = fromstring(text.encode(), forbid_dtd=True)
    except DefusedXmlException:
        raise InputError("holds a DTD or an entity; allowed: plain XML", where=where) from None
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise InputError(f"not XML: {shown(str(error), 200)[1:-1]}", where=where) from None
    return root


def _local(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _objects_in(root: Element, where: str) -> list[tuple[ControllerObject, Element]]:
    """Every object with an actual value, and the element that holds it."""
    result: list[tuple[ControllerObject, Element]] = []
    stack: list[tuple[Element, int]] = [(root, 0)]
    while stack:
        element, depth = stack.pop()
        if depth > 8 * TOML_DEPTH.most:
            raise InputError("nested too deeply", where=where)
        if _local(element) == "CANopenObject":
            index = _hex(element, "index", 4, where)
            result += _values_of(element, index, 0, where)
            for sub in element:
                if _local(sub) == "CANopenSubObject":
                    result += _values_of(sub, index, _hex(sub, "subIndex", 2, where), where)
            continue
        stack.extend((child, depth + 1) for child in reversed(element))
    return result


def _hex(element: Element, attribute: str, digits: int, where: str) -> int:
    text = element.get(attribute, "")
    plain = text[2:] if text[:2] in ("0x", "0X") else text
    if not re.fullmatch(rf"[0-9A-Fa-f]{{1,{digits}}}", plain):
        raise InputError(
            f"{attribute} = {shown(text)}: allowed: up to {digits} hexadecimal digits", where=where
        )
    return int(plain, 16)


def _values_of(
    element: Element, index: int, subindex: int, where: str
) -> list[tuple[ControllerObject, Element]]:
    text = element.get("actualValue")
    if text is None:
        return []
    label = ControllerObject(index=index, subindex=subindex, value=0).label
    if not _INTEGER.match(text.strip()):
        raise InputError(f"{label} = {shown(text)}: allowed: a whole number", where=where)
    value = int(text.strip(), 16) if text.strip()[:2] in ("0x", "0X") else int(text)
    names = {"name": element.get("name", ""), "data_type": element.get("dataType", "")}
    if any(len(name) > 200 for name in names.values()):
        raise InputError(f"{label}: a name of more than 200 characters", where=where)
    return [(ControllerObject(index=index, subindex=subindex, value=value, **names), element)]


def write_settings_xml(objects: ControllerObjects) -> str:
    """Settings as ``.xdc``-style XML that :func:`read_settings_xml` turns back into the same objects."""
    root = Element("ISO15745ProfileContainer", {"xmlns": _NAMESPACE})
    profile = SubElement(root, "ISO15745Profile")
    body = SubElement(SubElement(profile, "ProfileBody"), "ApplicationLayers")
    listed = SubElement(body, "CANopenObjectList")
    parents: dict[int, Element] = {}
    last: int | None = None
    for item in objects.values:
        if item.subindex == 0 or item.index != last:
            parents[item.index] = SubElement(listed, "CANopenObject", {"index": f"{item.index:04X}"})
        last = item.index
        target = parents[item.index]
        if item.subindex:
            target = SubElement(target, "CANopenSubObject", {"subIndex": f"{item.subindex:02X}"})
        more = {"name": item.name, "dataType": item.data_type, "actualValue": str(item.value)}
        target.attrib.update({key: value for key, value in more.items() if value})
    indent(root)
    return _DECLARATION + tostring(root, encoding="unicode") + "\n"


def settings_xml(objects: ControllerObjects, into: Path | None = None) -> tuple[str, tuple[str, ...]]:
    """Settings as XML text, alone or put into a device configuration file; and what found no place there."""
    if into is None:
        return write_settings_xml(objects), ()
    where = shown(str(into), 200)[1:-1]
    return update_settings_xml(decode(read_bytes(into, "device configuration"), where), objects, where)


def update_settings_xml(
    text: str, objects: ControllerObjects, where: str = "settings"
) -> tuple[str, tuple[str, ...]]:
    """Put settings into the device configuration that they came from, which keeps all but its comments.

    Gives the new text, and the labels of objects that it has no place for.
    """
    for prefix, uri in re.findall(r'xmlns(?::([A-Za-z][\w.-]*))?\s*=\s*"([^"]*)"', text):
        if not re.fullmatch(r"ns[0-9]+", prefix):
            register_namespace(prefix, uri)
    root = parsed_xml(text, where)
    values = {(item.index, item.subindex): item.value for item in objects.values}
    for item, element in _objects_in(root, where):
        value = values.pop((item.index, item.subindex), item.value)
        if value != item.value:
            as_hex = element.get("actualValue", "").strip()[:2] in ("0x", "0X") and value >= 0
            element.set("actualValue", f"0x{value:X}" if as_hex else str(value))
    left = tuple(ControllerObject(index=i, subindex=s, value=0).label for i, s in values)
    return _DECLARATION + tostring(root, encoding="unicode") + "\n", left
