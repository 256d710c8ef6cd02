"""From the tree of a design file to a :class:`Design` in SI units: one walk over the declared keys.

A mistake is noted and the walk goes on, so that all are told at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from datetime import date
from math import isinf, pi, sqrt
from typing import Any

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design import model
from actuator_lti.design.data_sheet import WORDS, DataSheet, sheet_fields
from actuator_lti.design.field import Field, Structure
from actuator_lti.design.fields import FIELDS, fields_in
from actuator_lti.design.law_sources import PARTS, read_law
from actuator_lti.design.mistakes import Findings, nearest
from actuator_lti.design.parameters import FrozenMap
from actuator_lti.design.sections import RECORDS, Section, children
from actuator_lti.design.settings_file import objects_from
from actuator_lti.design.tolerances import read_tolerance
from actuator_lti.design.units import ampere_unit, parse_limit, parse_quantity, si_text
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown
from actuator_lti.files.tree import Tree

MAX_GEARS = 20
MAX_LIST = 200
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")
_ENTRY = ("value", "source", "grade", "tolerance")
_FIELD_OF_LEAD = FIELDS["screw.lead"]
_CONVENTION = re.compile(r"(?<=[AV])[ _]?(rms|eff|peak|pk)\b", re.IGNORECASE)
_DIRECT = re.compile(r"(?<=A)[ _]?dc\b", re.IGNORECASE)
_AMPERE = re.compile(r"\bA\b")
_DC_PER = {"rms-line": sqrt(1.5), "peak-phase": sqrt(3.0) / 2.0}  # section 1 of model.md
_UPSIDE_DOWN = {"motor.back_emf_constant": (1.0, "{angle}/(V*s)"), "control.period": (2.0 * pi, "rad/s")}


def read_tree(tree: Tree, origin: str, findings: Findings) -> model.Design:
    """The design of a tree; relations between its keys are checked by `checks.check_design`.

    Raises
    ------
    InputError
        All mistakes at once: file, line, key, value and what is allowed.
    """
    reader = Reader(tree, findings)
    values = reader.values("design", tree.get("design"), "design")
    tables = ["design", *(item.key for item in children("")), *(item.key for item in RECORDS), "objects"]
    meant = reader.known(tree, tables, "")
    parts = reader.tables("", tree, meant)
    records = {record.attribute: reader.items(record, tree.get(record.key, [])) for record in RECORDS}
    objects = reader.objects(tree.get("objects"))
    sheet = DataSheet(reader.stated, tree)
    findings.extend(sheet.refusals())
    findings.refuse()
    # 10 deg (0.01 m) without a load where the file does not say what to validate
    fallback = model.Validation(full_deflection_rad=model.default_deflection(reader.structure.axis))
    values["title"] = values.get("title") or values["name"]
    design = model.Design(
        **{**values, "validation": fallback, **parts, **records},
        objects=objects,
        origin=origin,
        parameters=FrozenMap(reader.parameters),
    )
    return sheet.read_into(design)


class Reader:
    """Reads one tree; what it cannot read it notes and leaves out."""

    def __init__(self, tree: Tree, findings: Findings) -> None:
        self.findings = findings
        self.parameters: dict[str, model.Parameter] = {}
        self.stated: dict[str, model.Parameter] = {}
        head, control = (
            tree[key] if isinstance(tree.get(key), dict) else {} for key in ("design", "control")
        )
        axis: Any = head.get("axis", "rotary")
        self.structure = Structure(
            axis if axis == "linear" else "rotary", "velocity" in control, "current" in control
        )
        motor = tree.get("motor")
        self.constants: Any = motor.get("constants", "dc") if isinstance(motor, dict) else "dc"
        self.travel_m_rad: float | None = None
        self.travel_m_rad = self._travel(tree.get("screw"))

    def refuse(self, path: str, value: object, reason: str) -> None:
        """Note the mistake of one key."""
        self.findings.note(path, shown(value), reason)

    def missing(self, path: str, field: Field | None = None) -> None:
        """Note that a key is missing."""
        self.findings.note(path, "", f"missing{_example(field)}")

    def known(self, table: Tree, known: Iterable[str], path: str) -> list[str]:
        """Note unknown keys; gives the known ones that they are near to."""
        known, meant = list(known), []
        for key in table:
            if key not in known:
                hint = f" (it is {WORDS[key]})" if key in WORDS else nearest(key, known)
                where = f"{path}.{key}" if path else key
                self.refuse(where, table[key], f"unknown key{hint}; allowed: {', '.join(known)}")
                meant += [one for one in known if f'"{one}"' in hint]
        return meant

    def values(self, template: str, table: Any, path: str, inner: Iterable[str] = ()) -> Tree:
        """Attributes and values of the keys that stand in one table."""
        if not isinstance(table, dict):
            self.missing(path) if table is None else self.refuse(path, table, "allowed: a table")
            return {}
        fields, stated = fields_in(template), sheet_fields(template)
        meant = self.known(table, (*(field.key for field in (*fields, *stated)), *inner), path)
        for field in stated:
            where = f"{path}.{field.key}"
            if field.key in table and self.entry(field, table[field.key], where) is not None:
                self.stated[where] = self.parameters.pop(where)
        values: Tree = {}
        for field in fields:
            where = f"{path}.{field.key}"
            if field.key in table:
                values[field.attribute] = self.value(field, table, where)
            elif field.required and field.key not in meant and not (field.key == "gain" and "law" in table):
                self.missing(where, field)
        return values

    def value(self, field: Field, table: Tree, path: str) -> Any:
        """One value as the design has it; None where it is refused."""
        raw = table[field.key]
        if field.kind == "limit":
            return self.limit(table.get("quantity"), raw, path)
        if field.kind in ("quantity", "integer"):
            return self.entry(field, raw, path) if field.path in FIELDS else self.number(field, raw, path)
        if field.kind == "quantities":
            return self.numbers(field, raw, path)
        if field.kind == "matrix":
            return self.rows(field, raw, path)
        raw = raw.isoformat() if field.kind == "day" and isinstance(raw, date) else raw
        if field.kind == "names":
            return self.words(field, raw, path)
        if not _fits(field, raw):
            hint = (
                nearest(raw, field.choices).strip() + "; " if field.choices and isinstance(raw, str) else ""
            )
            self.refuse(path, raw, f"{hint.removeprefix('; ')}allowed: {field.allowed('1')}")
        return raw

    def words(self, field: Field, raw: Any, path: str) -> tuple[str, ...]:
        """Some of the words that a key may have, each once."""
        known = raw if isinstance(raw, list) and all(isinstance(word, str) for word in raw) else []
        for word in known:
            if word not in field.choices:
                hint = nearest(word, field.choices)
                self.refuse(path, word, f"unknown{hint}; allowed: {', '.join(field.choices)}")
        if not known or len({*known}) != len(known):
            self.refuse(path, raw, f"allowed: a list of {', '.join(field.choices)}, each at most once")
        return tuple(known)

    def entry(self, field: Field, raw: Any, path: str) -> float | int | None:
        """A value with its pedigree, which is kept."""
        table = raw if isinstance(raw, dict) else {"value": raw}
        self.known(table, _ENTRY, path)
        if "value" not in table:
            self.missing(f"{path}.value", field)
            return None
        for key in ("source", "grade"):
            if not isinstance(table.get(key, ""), str):
                self.refuse(f"{path}.{key}", table[key], "allowed: text")
        value = self.number(field, table["value"], path)
        if value is None:
            return None
        unit = field.unit(self.structure)
        self.parameters[path] = model.Parameter(
            path=path,
            text=raw if isinstance(raw := table["value"], str) else si_text(raw, unit),
            value=value,
            unit=unit,
            symbol=field.symbol,
            source=table.get("source", ""),
            grade=table.get("grade", ""),
            tolerance=self.tolerance(field, table.get("tolerance"), value, f"{path}.tolerance"),
        )
        return value

    def tolerance(self, field: Field, raw: Any, value: float, path: str) -> model.Tolerance | None:
        """How far a value may lie from what is written."""
        if raw is None:
            return None
        unit = field.unit(self.structure)
        try:
            return read_tolerance(raw, value, lambda text: self.quantity(text, field), field, unit)
        except InputError as error:
            at = f"{path}.{error.where}" if error.where else path
            self.refuse(at, raw if error.where is None else raw[error.where], error.message)
        return None

    def numbers(self, field: Field, raw: Any, path: str) -> tuple[float | None, ...]:
        """A list of numbers."""
        if not isinstance(raw, list):
            self.refuse(path, raw, "allowed: a list")
            return ()
        if not 0 < len(raw) <= MAX_LIST:
            self.findings.note(path, "", f"allowed: 1 to {MAX_LIST} items")
        return tuple(self.number(field, one, f"{path}[{k}]") for k, one in enumerate(raw[:MAX_LIST], 1))

    def rows(self, field: Field, raw: Any, path: str) -> tuple[tuple[float | None, ...], ...]:
        """A list of rows of numbers."""
        if not isinstance(raw, list) or not all(isinstance(row, list) for row in raw):
            self.refuse(path, raw, "allowed: a list of rows, each a list of numbers")
            return ()
        return tuple(self.numbers(field, row, f"{path}[{k}]") for k, row in enumerate(raw[:MAX_LIST], 1))

    def number(self, field: Field, raw: Any, path: str) -> float | int | None:
        """A number in SI; None where it is refused."""
        unit = field.unit(self.structure)
        if isinstance(raw, bool) or not isinstance(raw, str | int | float):
            self.refuse(path, raw, f"allowed: a number with its unit, as text{_example(field)}")
            return None
        try:
            value = self.quantity(raw, field)
        except InputError as error:
            self.refuse(path, raw, error.message)
            return None
        if field.kind == "integer" and value != int(value):
            self.refuse(path, raw, "allowed: a whole number")
        elif not field.accepts(value):
            self.refuse(path, raw, f"allowed: {field.allowed(unit)}")
        return int(value) if field.kind == "integer" else value

    def quantity(self, text: Any, field: Field) -> float:
        """The SI value of a text; behind a screw also from the units of a rotary axis.

        A speed constant is read as the back-EMF constant that it is upside down, a sampling rate as its
        period, amperes rms or peak as those of the motor that the model has.
        """
        unit, power = field.unit(self.structure), field.travel_power()
        if isinstance(text, str) and (convention := _CONVENTION.search(text)):
            plain = _CONVENTION.sub(" dc", text)
            return self.quantity(plain, field) * self._amperes(field, unit, convention[1].lower())
        rotary = field.unit(replace(self.structure, axis="rotary"))
        factors = {unit: 1.0}
        if self.travel_m_rad is not None and power and rotary != unit and isinstance(text, str):
            factors = {rotary: self.travel_m_rad**power, unit: 1.0}
        refused: list[InputError] = []
        for one, factor in factors.items():
            try:
                value = parse_quantity(text, one) * factor
            except InputError as error:
                refused.append(error)
            else:
                return self._said(text, field, value)
            if field.path in _UPSIDE_DOWN and (turned := _turned(field.path, text, one)) is not None:
                return turned * factor
        raise refused[-1]

    def _said(self, text: Any, field: Field, value: float) -> float:
        """The value, unless an AC motor has several amperes that the text may mean."""
        unit = field.unit(self.structure)
        which = ampere_unit(field.path, unit, self.constants)
        if which == unit or value == 0.0 or isinf(value) or not isinstance(text, str) or _DIRECT.search(text):
            return value
        own = "rms" if self.constants == "rms-line" else "peak"
        raise InputError(
            "which amperes of the AC motor is not said; "
            f"allowed: {which.replace('dc', own)} (its data sheet's) or {which} (the model's)"
        )

    def _amperes(self, field: Field, unit: str, convention: str) -> float:
        """From amperes rms or peak to those of the model: i = sqrt(3/2) I_rms = sqrt(3)/2 I_peak."""
        given = "rms-line" if convention in ("rms", "eff") else "peak-phase"
        if self.constants == "dc" or (field.section == "motor" and self.constants != given):
            raise InputError(f'allowed: with motor.constants = "{given}"')
        above, _, below = unit.partition("/")
        power = len(_AMPERE.findall(above)) - len(_AMPERE.findall(below))
        if field.section != "motor" and not power:
            raise InputError(f"allowed: a number with a unit like {unit}, as the model has it")
        return 1.0 if field.section == "motor" else float(_DC_PER[given] ** power)

    def limit(self, quantity: Any, raw: Any, path: str) -> float | None:
        """A limit in the unit in which its quantity is reported."""
        known = QUANTITIES.get(quantity) if isinstance(quantity, str) else None
        if isinstance(raw, bool) or not isinstance(raw, str | int | float):
            self.refuse(path, raw, "allowed: a number with its unit, as text")
        elif known is not None:
            try:
                return parse_limit(raw, known.unit_for(self.structure.axis))
            except (InputError, ValueError) as error:
                self.refuse(path, raw, getattr(error, "message", str(error)))
        return None

    def part(self, section: Section, raw: Any, path: str) -> Any:
        """What one table becomes, with the tables inside it; None once there are mistakes."""
        inner = children(section.path)
        raw = self.law(raw, path) if section.kind is model.Law else raw
        names = [*(item.key for item in inner), *(["name"] if section.many == "named" else [])]
        values = {**self.values(section.template, raw, path, names), **self.tables(section.path, raw)}
        if self.findings.found:
            return None
        if section.many == "named":
            values["name"] = raw["name"]
        if section.kind is model.Requirement:
            values["unit"] = QUANTITIES[raw["quantity"]].unit_for(self.structure.axis)
        return section.kind(**values)

    def law(self, raw: Any, path: str) -> Any:
        """The table of a law, with what stands in its file."""
        if not isinstance(raw, dict):
            return raw
        flat = {key: raw[key] for key in ("C", "D", "L") if _one_row(raw.get(key))}
        raw = {**raw, **{key: [each for row in value for each in row] for key, value in flat.items()}}
        if "file" not in raw:
            return raw
        file, rest = raw["file"], {key: value for key, value in raw.items() if key != "file"}
        twice = [key for key in (*PARTS, "L", "period") if key in rest]
        if not isinstance(file, str) or twice:
            self.refuse(f"{path}.file", file, f"allowed: a file's name, without {', '.join(twice) or 'more'}")
            return rest
        try:
            return {**read_law(self.findings.folder / file), **rest}
        except InputError as error:
            self.refuse(f"{path}.file", file, error.message)
        return rest

    def tables(self, path: str, table: Any, meant: Iterable[str] = ()) -> Tree:
        """The parts of the tables that lie in a table (``""``: in the file), where they are written."""
        result: Tree = {}
        for section in children(path) if isinstance(table, dict) else ():
            if section.many:
                result[section.attribute] = self.items(section, table.get(section.key, []))
            elif section.key in table or (section.required and section.key not in meant):
                result[section.attribute] = self.part(section, table.get(section.key), section.path)
        return result

    def items(self, section: Section, raw: Any) -> tuple[Any, ...]:
        """The parts of repeated tables, each known by its name, id or number."""
        most = MAX_GEARS if section.many == "named" else MAX_LIST
        if not isinstance(raw, list):
            self.refuse(section.path, raw, f"allowed: [[{section.path}]] tables")
        elif len(raw) > most:
            self.findings.note(section.path, "", f"allowed: 1 to {most} items")
        else:
            paths: list[str] = []
            for index, table in enumerate(raw):
                paths.append(self._label(section, table, index, paths))
            return tuple(self.part(section, *item) for item in zip(raw, paths, strict=True))
        return ()

    def _label(self, section: Section, table: Any, index: int, before: list[str]) -> str:
        """The dotted path of a repeated table; the name of one that is known by it is checked."""
        key = "name" if section.many == "named" else section.label
        name = table.get(key) if isinstance(table, dict) else None
        path, numbered = f"{section.path}.{name}", f"{section.path}[{index + 1}]"
        if not key:
            return f"{section.path}.{index + 1}"
        if section.label or not isinstance(table, dict):
            return path if isinstance(name, str) else numbered
        if name is None:
            self.missing(f"{numbered}.name")
        elif not (isinstance(name, str) and _NAME.match(name)):
            self.refuse(
                f"{numbered}.name", name, "allowed: 1 to 64 letters, digits, - and _, no dot or space"
            )
        elif path in before:
            self.refuse(f"{numbered}.name", name, "allowed: each name once")
        else:
            return path
        return numbered

    def objects(self, raw: Any) -> model.ControllerObjects:
        """The settings that the design was imported from."""
        try:
            return model.ControllerObjects() if raw is None else objects_from(raw, self.findings.where)
        except InputError as error:
            self.findings.note("objects", "", error.message)
        return model.ControllerObjects()

    def _travel(self, screw: Any) -> float | None:
        """p of the screw, needed before anything else is read; None without one."""
        if screw is None:
            return None
        if self.structure.axis != "linear":
            self.refuse("screw", screw, 'allowed with design.axis = "linear"')
        lead: Any = screw.get("lead") if isinstance(screw, dict) else None
        lead = lead.get("value") if isinstance(lead, dict) else lead
        try:
            return model.Screw(lead_m=parse_quantity(lead, _FIELD_OF_LEAD.unit(self.structure))).travel_m_rad
        except (InputError, TypeError):
            return None  # told where the lead itself is read


def _one_row(value: Any) -> bool:
    """Whether a list is one row or one column of numbers, written as a matrix."""
    rows = isinstance(value, list) and value and all(isinstance(row, list) for row in value)
    return bool(rows) and (len(value) == 1 or all(len(row) == 1 for row in value))


def _fits(field: Field, raw: Any) -> bool:
    """Whether a value that is no number is what its key takes."""
    if field.kind == "flag":
        return isinstance(raw, bool)
    if not isinstance(raw, str):
        return False
    if field.kind == "day":
        try:
            return bool(date.fromisoformat(raw))
        except ValueError:
            return False
    return bool(raw.strip()) if field.kind == "label" else not field.choices or raw in field.choices


def _example(field: Field | None) -> str:
    if field is None:
        return ""
    example = f'example: {field.key} = "{field.example}" ({field.description})'
    return f"; {example if field.example else f'it is the {field.description}'}"


def _turned(path: str, text: Any, unit: str) -> float | None:
    """A value that data sheets state upside down: ``"83.4 rpm/V"``, ``"16 kHz"``."""
    one, turned = _UPSIDE_DOWN[path]
    try:
        value = parse_quantity(text, turned.format(angle=unit.rpartition("/")[2]))
    except InputError:
        return None
    return one / value if value > 0.0 else None
