"""Controller settings as files, TOML or XML as a CANopen device configuration (``.xdc``)."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args
from xml.etree.ElementTree import Element, ParseError, SubElement, indent, register_namespace, tostring

import tomli_w

from actuator_lti.bounds import TOML_BYTES, TOML_DEPTH
from actuator_lti.design.asked import ControllerObject, ControllerObjects, ObjectFamily, ObjectPlace
from actuator_lti.design.objects import OBJECTS, checked_objects
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.reading import parse_toml, read_text, shown, shown_path

_INTEGER = re.compile(r"(?:[+-]?[0-9]{1,20}|0[xX][0-9A-Fa-f]{1,16})\Z")
_NAMESPACE = "http://www.canopen.org/xml/1.0"
_DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>\n'
_LABEL = re.compile(r"(?:0[xX])?([0-9A-Fa-f]{4})(?:\.([0-9A-Fa-f]{2}))?\Z")


def read_settings(path: str | Path, velocity_gain_factor: float | None = None) -> ControllerObjects:
    return parse_settings(read_text(path, "settings file"), shown_path(path), velocity_gain_factor)


def parse_settings(text: str, where: str, velocity_gain_factor: float | None = None) -> ControllerObjects:
    """Settings from XML where the text begins with ``<``, else from TOML.

    XML: the actual values of its CANopen objects and sub-objects; no DTD, no entities.
    TOML: ``velocity_gain_factor``, and ``"0x2344.01" = 120000`` in a table ``[objects]``.
    The factor is 1 (per rad/s) or 9.549 (per rpm); without it what a TOML file says, else 1.
    """
    with in_file(where):
        if text.lstrip().startswith("<"):
            values = tuple(item for item, _ in _objects_in(parsed_xml(text)))
            result = checked_objects(values, 1.0 if velocity_gain_factor is None else velocity_gain_factor)
            none = "holds no CANopenObject with an actualValue, nor is it an MCConfiguration of a VESC"
        else:
            result = objects_from(parse_toml(text, where), velocity_gain_factor, "objects")
            none = 'objects: missing; allowed: a table with entries such as "0x2344.01" = 344'
        if not result.values:
            raise InputError(none)
    return result


def parse_label(label: str) -> tuple[int, int]:
    match = _LABEL.match(label)
    if match is None:
        raise InputError(f'{shown(label)}: allowed: an object such as "0x2344.01" or "0x6080"')
    return int(match[1], 16), int(match[2] or "0", 16)


def _object_from(label: str, raw: Any) -> ControllerObject:
    index, subindex = parse_label(label)
    table = {"name": "", "data_type": "", **(raw if isinstance(raw, dict) else {"value": raw})}
    value = table.get("value")
    if len(table) > 3 or isinstance(value, bool) or not isinstance(value, int):
        allowed = "a whole number, or a table with value, name, data_type"
        raise InputError(f"{label} = {shown(value)}: allowed: {allowed}")
    if not all(isinstance(table[key], str) for key in ("name", "data_type")):
        raise InputError(f"{label}: name and data_type are texts")
    return ControllerObject(index=index, subindex=subindex, **table)


def object_entry(item: ControllerObject) -> Any:
    more = {key: getattr(item, key) for key in ("name", "data_type") if getattr(item, key)}
    return {"value": item.value, **more} if more else item.value


def objects_from(raw: Any, factor: float | None = None, values: str = "values") -> ControllerObjects:
    """Settings as a table: calibration of the velocity gain, family, and the objects (key ``values``)."""
    known = ("velocity_gain_factor", "family", values)
    table = raw if isinstance(raw, dict) else {"": raw}
    for key in table:
        if key not in known:
            raise InputError(f"{shown(key)}: unknown key; allowed: {', '.join(known)}")
    entries, family = table.get(values, {}), table.get("family", "")
    if not isinstance(entries, dict):
        raise InputError(f"{values} = {shown(entries)}: allowed: a table")
    if family not in get_args(ObjectFamily):
        allowed = " or ".join(f'"{one}"' for one in get_args(ObjectFamily))
        raise InputError(f"family = {shown(family)}: allowed: {allowed}")
    read = tuple(_object_from(label, entry) for label, entry in entries.items())
    factor = table.get("velocity_gain_factor", 1.0) if factor is None else factor
    return replace(checked_objects(read, factor), family=family)


def write_settings_toml(objects: ControllerObjects) -> str:
    lines = [
        "# Settings of the motion controller, in the units of its own objects.",
        f"velocity_gain_factor = {objects.velocity_gain_factor!r}  # 1: 0x2344.01 per rad/s; 9.549: per rpm",
        "",
        "[objects]",
    ]
    for item in objects.values:
        listed = tomli_w.dumps({"x": [object_entry(item)]}, indent=0)  # a list has its tables in one line
        inline = listed.partition("[")[2].rpartition("]")[0].strip().rstrip(",")
        known = OBJECTS.get(item.place)
        comment = f"{known.meaning}, {known.unit}" if known else "kept as it came"
        lines.append(f'"{item.label}" = {inline}  # {comment}')
    return "\n".join(lines) + "\n"


def parsed_xml(text: str) -> Element:
    """Plain XML; no DTD, no entities, at most 1 MiB."""
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    if len(text) > TOML_BYTES.most:
        raise InputError("is larger than allowed: at most 1 MiB")
    try:
        root: Element = fromstring(text.encode(), forbid_dtd=True)
    except DefusedXmlException:
        raise InputError("holds a DTD or an entity; allowed: plain XML") from None
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise InputError(f"not XML: {shown(str(error), 200)[1:-1]}") from None
    return root


def placed(element: Element, depth: int = 0) -> Iterator[tuple[ObjectPlace, Element]]:
    """Every object and sub-object of a device configuration, and the element that it is."""
    if depth > 8 * TOML_DEPTH.most:
        raise InputError("nested too deeply")
    if not _is(element, "CANopenObject"):
        for child in element:
            yield from placed(child, depth + 1)
        return
    index = _hex(element, "index", 4)
    for one in (element, *[child for child in element if _is(child, "CANopenSubObject")]):
        yield ObjectPlace(index=index, subindex=0 if one is element else _hex(one, "subIndex", 2)), one


def _objects_in(root: Element) -> Iterator[tuple[ControllerObject, Element]]:
    for place, one in placed(root):
        if (given := one.get("actualValue")) is None:
            continue
        text, names = given.strip(), {"name": one.get("name", ""), "data_type": one.get("dataType", "")}
        if not _INTEGER.match(text):
            raise InputError(f"{place.label} = {shown(given)}: allowed: a whole number")
        if any(len(name) > 200 for name in names.values()):
            raise InputError(f"{place.label}: a name of more than 200 characters")
        value = int(text, 16 if text[:2] in ("0x", "0X") else 10)
        yield ControllerObject(index=place.index, subindex=place.subindex, value=value, **names), one


def _is(element: Element, name: str) -> bool:
    return str(element.tag).rpartition("}")[2] == name


def _hex(element: Element, attribute: str, digits: int) -> int:
    text = element.get(attribute, "")
    if not re.fullmatch(rf"(?:0[xX])?[0-9A-Fa-f]{{1,{digits}}}", text):
        raise InputError(f"{attribute} = {shown(text)}: allowed: up to {digits} hexadecimal digits")
    return int(text, 16)


def write_settings_xml(objects: ControllerObjects) -> str:
    """Settings as ``.xdc``-style XML that `parse_settings` turns back into the same objects."""
    root = listed = Element("ISO15745ProfileContainer", {"xmlns": _NAMESPACE})
    for tag in ("ISO15745Profile", "ProfileBody", "ApplicationLayers", "CANopenObjectList"):
        listed = SubElement(listed, tag)
    parent: Element | None = None
    for item in objects.values:
        index = f"{item.index:04X}"
        if parent is None or item.subindex == 0 or parent.get("index") != index:
            parent = SubElement(listed, "CANopenObject", {"index": index})
        sub = {"subIndex": f"{item.subindex:02X}"}
        target = SubElement(parent, "CANopenSubObject", sub) if item.subindex else parent
        more = {"name": item.name, "dataType": item.data_type, "actualValue": str(item.value)}
        target.attrib.update({key: value for key, value in more.items() if value})
    indent(root)
    return _DECLARATION + tostring(root, encoding="unicode") + "\n"


def settings_xml(objects: ControllerObjects, into: Path | None = None) -> tuple[str, tuple[str, ...]]:
    """Settings as XML text, alone or put into a device configuration file; and what found no place there."""
    if into is None:
        return write_settings_xml(objects), ()
    with in_file(shown_path(into)):
        return update_settings_xml(read_text(into, "device configuration"), objects)


def update_settings_xml(text: str, objects: ControllerObjects) -> tuple[str, tuple[str, ...]]:
    """The device configuration with other settings, without comments; labels that have no place there."""
    for prefix, uri in re.findall(r'xmlns(?::([A-Za-z][\w.-]*))?\s*=\s*"([^"]*)"', text):
        if not re.fullmatch(r"ns[0-9]+", prefix):
            register_namespace(prefix, uri)
    root = parsed_xml(text)
    left = {item.place: item for item in objects.values}
    for item, element in _objects_in(root):
        value = left.pop(item.place, item).value
        if value != item.value:
            as_hex = element.get("actualValue", "").strip()[:2] in ("0x", "0X") and value >= 0
            element.set("actualValue", f"0x{value:X}" if as_hex else str(value))
    homeless = tuple(item.label for item in left.values())
    return _DECLARATION + tostring(root, encoding="unicode") + "\n", homeless
