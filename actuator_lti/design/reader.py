"""From the tree of a design file to a `Design` in SI: one walk over the declared keys, past mistakes."""

import re
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from dataclasses import replace
from datetime import date
from difflib import get_close_matches
from math import inf
from typing import Any

from actuator_lti.asked.quantities import LOOPS, QUANTITIES
from actuator_lti.design import fields as schema
from actuator_lti.design import model
from actuator_lti.design.asked import FrozenMap, default_deflection
from actuator_lti.design.checks_plant import with_stand_ins
from actuator_lti.design.data_sheet import DataSheet, sheet_fields
from actuator_lti.design.field import MANY, Field, Structure
from actuator_lti.design.hint_numbers import BARE, hint_of, ticks_of, with_numbers
from actuator_lti.design.law import GAIN_REPLACED
from actuator_lti.design.law_sources import PARTS, read_law
from actuator_lti.design.mistakes import UNREAD, Findings, UnreadError, meant_of, nearest
from actuator_lti.design.plant import torque_per_command
from actuator_lti.design.settings_file import objects_from
from actuator_lti.design.sheet_words import key_for
from actuator_lti.design.stated import Frame
from actuator_lti.design.tolerances import read_tolerance
from actuator_lti.design.units import ampere_unit, si_text
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, shown

MAX_GEARS = 20
MAX_LIST = 200
_NAME = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9 _/:+()-]{0,62}[A-Za-z0-9_+)-])?\Z")
_ENTRY = ("value", "source", "grade", "tolerance")
_BANDWIDTH = re.compile(r"[Hh](?:z|ertz)\b|\brad")  # a speed in rpm is none
_FORMULA = re.compile(r"= [^,;]*")  # integral_time = gain/integral gain
_OF_COUNTS = ("a number without a unit", 'counts, as 4096, "1024 lines" or "12 bit"')
_VERY_NEAR = 0.85  # of a misspelled key whose value is checked
_ASIDE = re.compile(r", (?:which takes|in|with) ")  # what a hint says beside the one key that it names
Per = Callable[[model.Design], Any]  # what a gain is per unit of what is stated


GAINS: dict[str, dict[str, Per]] = {
    "control.current.gain": {"rad/s": lambda design: design.effective_motor.inductance_H or UNREAD},
    "control.position.gain": {"rad/s": lambda _: 1.0},
    "control.velocity.gain": {
        "rad/s": lambda design: design.inertia_kgm2 / torque_per_command(design),
        "{torque}*s/{angle}": lambda design: 1.0 / torque_per_command(design),
    },
}
"""Gains that controllers state by what they do, the loop's bandwidth or a torque: unit, gain per that."""


def read_tree(tree: Tree, origin: str, findings: Findings) -> model.Design:
    """The design of a tree, `UNREAD` where there are findings; relations between its keys are `checks`."""
    reader = Reader(tree, findings)
    head, _ = reader.values("design", tree.get("design"), "design")
    tables = [item.key for item in (schema.HEAD, *schema.children(""), *schema.RECORDS)]
    parts = reader.tables("", tree, reader.known(tree, [*tables, "objects"], ""))
    records = {record.attribute: reader.items(record, tree.get(record.key, [])) for record in schema.RECORDS}
    objects = reader.objects(tree.get("objects"))
    # 10 deg (0.01 m) without a load where the file does not say what to validate
    fallback = model.Validation(full_deflection_rad=default_deflection(reader.structure.axis))
    name, title = head.setdefault("name", UNREAD), head.get("title")
    head["title"] = title if title is UNREAD else title or name
    design = reader.with_gains(
        model.Design(**{**head, "validation": fallback, **parts, **records}, objects=objects, origin=origin)
    )
    design = replace(design, parameters=FrozenMap(reader.parameters), written=frozenset(reader.written))
    sheet = DataSheet(reader.stated, tree)
    contradicted = tuple(sheet.refusals(design))
    findings.extend(contradicted)
    with suppress(UnreadError):
        return replace(design, friction=UNREAD) if contradicted else sheet.read_into(design)
    return replace(design, friction=UNREAD)


class Reader:
    """Reads one tree; what it cannot read it notes, and has `UNREAD` for it."""

    def __init__(self, tree: Tree, findings: Findings) -> None:
        self.findings, self.tree = findings, tree
        self.guessed: set[str] = set()
        self.written: set[str] = set()
        self.ticks: dict[str, int] = {}
        self.parameters: dict[str, model.Parameter] = {}
        self.stated: dict[str, model.Parameter] = {}
        self.gains: dict[str, tuple[Field, Tree, float, Per]] = {}
        tables = (tree.get(key) for key in ("design", "control", "motor"))
        head, control, motor = (each if isinstance(each, dict) else {} for each in tables)
        stages = {meant_of(f"{key}", LOOPS) or key_for("control", f"{key}") for key in control}
        self.structure = Structure(_meant(head, "design.axis"), "velocity" in stages, "current" in stages)
        self.frame = Frame(self.structure, _meant(motor, "motor.constants"))
        self.frame = replace(self.frame, travel_m_rad=self._travel(tree.get("screw")))

    def _travel(self, screw: Any) -> float | None:
        """p of the screw, needed before anything else is read; None without one."""
        if screw is None:
            return None
        if self.structure.axis != "linear":
            self.refuse("screw", screw, 'allowed with design.axis = "linear"')
        lead: Any = screw.get("lead") if isinstance(screw, dict) else None
        lead = lead.get("value") if isinstance(lead, dict) else lead
        field, lead_m = schema.FIELDS["screw.lead"], 0.01
        with suppress(InputError, TypeError):  # told where the lead itself is read
            value = self.frame.quantity(lead, field)
            lead_m = value if field.accepts(value) else lead_m
        return model.Screw(lead_m=lead_m).travel_m_rad

    def refuse(self, path: str, value: object, reason: str) -> Any:
        """Note the mistake of one key, which is unread."""
        return self.unread(path, reason, shown(value))

    def unread(self, path: str, reason: str, value: str = "") -> Any:
        self.findings.note(path, value, reason)
        return UNREAD

    def known(self, table: Tree, known: Collection[str], path: str) -> dict[str, str]:
        """Note unknown keys; gives those that they are near to, with what only renames one."""
        meant: dict[str, str] = {}
        for key in (key for key in table if key not in known):
            word = key_for(path, key, known)
            word = with_numbers(word, path, key, table, self.tree, self.frame, self.takes)
            said = f" ({word})" if word.startswith("not ") else f" (it is {word})"
            hint = said if word else nearest(key, known)
            where = f"{path}.{key}" if path else key
            self.refuse(where, table[key], f"unknown key{hint or '; allowed: ' + ', '.join(known)}")
            if word.startswith("every,") and (ticks := ticks_of(path, table[key], self.tree)):
                self.ticks[f"{path}.every"] = ticks
            only = _ASIDE.split(word)[0] if word else meant_of(key, known)
            if only in known:
                near = word or meant_of(key, [only], _VERY_NEAR)
                meant[only] = meant.get(only) or (key if near else "")
                self.guessed |= set() if word else {f"{path}.{only}"}
                continue
            named = "" if word.startswith("not needed") else _FORMULA.sub("", hint)  # that stand for it
            for one in known:
                if re.search(rf"(?<![\[.])(?<!over )\b{one}\b(?! of)", named):
                    meant.setdefault(one, "")
        return meant

    def values(
        self, template: str, table: Any, path: str, inner: Iterable[str] = ()
    ) -> tuple[Tree, Collection[str]]:
        """Attributes and values of the keys of one table, and the keys that unknown ones are near to.

        What stands under another name is read as well, so that all that is wrong with it is told at once; the
        value of a word that is only near to a key is unread all the same, and unseen unless very near.
        """
        if not isinstance(table, dict):
            word = key_for(path.rpartition(".")[0], path.rpartition(".")[2])
            number = f"; a number of that name is {word}" if word else ""
            allowed = f"allowed: a table{f', [{path}]' if path in schema.BY_PATH else ''}{number}"
            self.unread(path, "missing") if table is None else self.refuse(path, table, allowed)
            return {}, ()
        fields, stated = schema.fields_in(template), sheet_fields(template)
        meant = self.known(table, (*(field.key for field in (*fields, *stated)), *inner), path)
        for field in stated:
            if field.key in table:
                self.entry(field, table[field.key], f"{path}.{field.key}", self.stated)
            elif field.key in meant:
                self.stated[f"{path}.{field.key}"] = UNREAD
        values: Tree = {}
        for field in fields:
            where, replaced = f"{path}.{field.key}", field.key == "gain" and "law" in table
            if replaced and field.key in table:
                said = GAIN_REPLACED.format(stage=path)
                values[field.attribute] = self.refuse(where, table[field.key], said)
            elif field.key in table:
                self.written.add(where)
                values[field.attribute] = self.value(field, table, where)
            elif meant.get(field.key):
                self.findings.alias(where, f"{path}.{meant[field.key]}")
                values[field.attribute] = self.value(field, {field.key: table[meant[field.key]]}, where)
                if where in self.guessed:
                    self.gains.pop(where, None)
                    values[field.attribute] = self.parameters[where] = UNREAD
            elif field.key in meant:
                self.parameters[where] = UNREAD
                values[field.attribute] = self.ticks.get(where, UNREAD)
            elif field.required and not replaced:
                values[field.attribute] = self.unread(where, f"missing{_example(field)}")
        return values, meant

    def value(self, field: Field, table: Tree, path: str) -> Any:
        raw = table[field.key]
        if raw is UNREAD:
            return UNREAD
        if field.kind == "limit":
            return self.limit(table.get("quantity"), raw, path)
        if field.is_number and field.path in schema.FIELDS:
            return self.entry(field, raw, path, self.parameters)
        lists = {"quantities": self.numbers, "matrix": self.rows, "names": self.words}
        if reads := self.number if field.is_number else lists.get(field.kind):
            return reads(field, raw, path)
        raw = raw.isoformat() if field.kind == "day" and isinstance(raw, date) else raw
        if _fits(field, raw):
            return raw
        hint = nearest(raw, field.choices).strip() if isinstance(raw, str) else ""
        near = get_close_matches(str(raw), field.choices, cutoff=0.0) if len(field.choices) > MANY else []
        allowed = f"{field.allowed('1')}{', such as ' * bool(near)}{', '.join(near)}"
        return self.refuse(path, raw, f"{hint}{'; ' * bool(hint)}allowed: {allowed}")

    def words(self, field: Field, raw: Any, path: str) -> Any:
        known, allowed = raw if isinstance(raw, list) else [], ", ".join(field.choices)
        if not known or not all(isinstance(word, str) for word in known) or len({*known}) != len(known):
            return self.refuse(path, raw, f"allowed: a list of {allowed}, each at most once")
        strange = [word for word in known if word not in field.choices]
        for word in strange:
            self.refuse(path, word, f"unknown{nearest(word, field.choices)}; allowed: {allowed}")
        return UNREAD if strange else tuple(known)

    def entry(self, field: Field, raw: Any, path: str, into: dict[str, model.Parameter]) -> Any:
        into[path] = UNREAD
        table = raw if isinstance(raw, dict) else {"value": raw}
        self.known(table, _ENTRY, path)
        if "value" not in table:
            return self.unread(f"{path}.value", f"missing{_example(field)}")
        for key in ("source", "grade"):
            if not isinstance(table.get(key, ""), str):
                self.refuse(f"{path}.{key}", table[key], "allowed: text")
        if (gain := self.as_stated(field, table["value"])) is not None:
            self.gains[path] = field, table, *gain
            return UNREAD
        return self.kept(field, table, self.number(field, table["value"], path), path, into)

    def as_stated(self, field: Field, text: Any) -> tuple[float, Per] | None:
        """A gain that is stated by what it does: that, and the gain per that."""
        for template, per in GAINS.get(field.path, {}).items() if isinstance(text, str) else ():
            outer = field.section != "control.position" or self.structure.has_velocity
            if template == "rad/s" and not (outer and _BANDWIDTH.search(text)):
                continue
            with suppress(InputError):
                # by a path of its own: that of the position gain has a unit whatever the template
                said = replace(field, path=f"{field.path}, as stated", unit_template=template)
                return self.frame.quantity(text, said), per
        return None

    def takes(self, path: str, text: str) -> bool:
        """Whether a key that holds a number reads a text as it stands."""
        field = schema.field_of(re.sub(r"\[([0-9]+)\]", r".\1", path))  # gear[1], without a name
        with suppress(InputError):
            if field is not None:
                gain = self.as_stated(field, text)
                value = gain[0] if gain else self.frame.quantity(text, field)
                return field.accepts(value) and (field.kind != "integer" or value == int(value))
        return False

    def kept(self, field: Field, table: Tree, value: Any, path: str, into: dict[str, model.Parameter]) -> Any:
        if value is UNREAD:
            return UNREAD
        unit = field.unit(self.structure)
        tolerance = self.tolerance(field, table.get("tolerance"), value, f"{path}.tolerance")
        if tolerance is not UNREAD:
            text = table["value"] if isinstance(table["value"], str) else si_text(table["value"], unit)
            into[path] = model.Parameter(
                path=path, text=text, value=value, unit=unit, symbol=field.symbol, tolerance=tolerance,
                source=table.get("source", ""), grade=table.get("grade", ""), stated=table.get("stated", ""),
            )  # fmt: skip
        return value

    def with_gains(self, design: model.Design) -> model.Design:
        """The design with the gains that say what they do, in amperes or volts from here on."""
        for path, (field, table, size, per) in self.gains.items():
            with suppress(UnreadError, ValueError):  # of a coupling after no gear
                value = size * per(replace(with_stand_ins(design), temperature=None))
                unit = field.unit(self.structure)
                if not field.accepts(value):
                    self.refuse(path, table["value"], f"allowed: {field.allowed(unit)}")
                    continue
                text = si_text(value, ampere_unit(path, unit, self.frame.constants))
                source = "; ".join(filter(None, (f"from {table['value']}", table.get("source"))))
                made = {**table, "value": text, "source": source, "stated": f"from {table['value']}"}
                self.kept(field, made, value, path, self.parameters)
                part = replace(schema.part_at(design, field.section), **{field.attribute: value})
                design = schema.with_part(design, field.section, part)
        return design

    def tolerance(self, field: Field, raw: Any, value: float, path: str) -> model.Tolerance | None:
        if raw is None:
            return None
        unit = field.unit(self.structure)
        width = raw.get("std", raw.get("half_width")) if isinstance(raw, dict) else raw
        try:
            if isinstance(width, str) and self.frame.upside_down(width, field):
                share = 100.0 * value / self.frame.quantity(width, field)
                raise InputError(f'a width upside down; allowed: a share, here "{share:.4g} %", or {unit}')
            for key, turned in (("lower", "upper"), ("upper", "lower")):
                bound = raw.get(key) if isinstance(raw, dict) else None
                if isinstance(bound, str) and self.frame.upside_down(bound, field):
                    said = f'{turned} = "{self.frame.quantity(bound, field):.6g} {unit}"'
                    raise InputError(f"a bound upside down; allowed: {said}", where=key)
            return read_tolerance(raw, value, lambda text: self.frame.quantity(text, field), field, unit)
        except InputError as error:
            at = f"{path}.{error.where}" if error.where else path
            return self.refuse(at, raw if error.where is None else raw[error.where], error.message)

    def numbers(self, field: Field, raw: Any, path: str) -> Any:
        if not isinstance(raw, list):
            return self.refuse(path, raw, "allowed: a list")
        read = tuple(self.number(field, one, f"{path}[{k}]") for k, one in enumerate(raw[:MAX_LIST], 1))
        return read if 0 < len(raw) <= MAX_LIST else self.unread(path, f"allowed: 1 to {MAX_LIST} items")

    def rows(self, field: Field, raw: Any, path: str) -> Any:
        if not isinstance(raw, list) or not all(isinstance(row, list) for row in raw):
            return self.refuse(path, raw, "allowed: a list of rows, each a list of numbers")
        return tuple(self.numbers(field, row, f"{path}[{k}]") for k, row in enumerate(raw[:MAX_LIST], 1))

    def number(self, field: Field, raw: Any, path: str) -> Any:
        if isinstance(raw, bool) or not isinstance(raw, str | int | float):
            what = "a whole number" if field.kind == "integer" else "a number with its unit, as text"
            return self.refuse(path, raw, f"allowed: {what}{_example(field)}")
        try:
            value = self.frame.quantity(raw, field)
        except InputError as error:
            other = self.frame.other_axis(raw, field)
            hint = hint_of(raw, field, path, self.frame, self.tree)
            message = error.message.replace(*_OF_COUNTS) if field.key == "counts_per_rev" else error.message
            return self.refuse(path, raw, f"{message}{other}{hint}")
        if field.kind == "integer" and value != int(value):
            return self.refuse(path, raw, "allowed: a whole number")
        if not field.accepts(value):
            unit = field.unit(self.structure)
            share = unit == "1" and field.high == 1.0 and 2.0 <= value <= 100.0 and BARE.match(f"{raw}")
            percent = f'; or is it "{value:g} %"' if share else ""
            off = value == 0.0 and field.default in (None, inf) and not field.required
            none = "; for none leave the key out" * off
            return self.refuse(path, raw, f"allowed: {field.allowed(unit)}{percent}{none}")
        return int(value) if field.kind == "integer" else value

    def limit(self, quantity: Any, raw: Any, path: str) -> Any:
        known = QUANTITIES.get(meant_of(f"{quantity}", QUANTITIES, _VERY_NEAR))
        if isinstance(raw, bool) or not isinstance(raw, str | int | float):
            return self.refuse(path, raw, "allowed: a number with its unit, as text")
        try:
            value = self.frame.limit(raw, known.unit_for(self.structure.axis)) if known else UNREAD
            return value if known and quantity == known.name else UNREAD
        except (InputError, ValueError) as error:
            return self.refuse(path, raw, getattr(error, "message", str(error)))

    def part(self, section: schema.Section, raw: Any, path: str) -> Any:
        named = section.many == "named"
        raw = _rows_flat(raw) if issubclass(section.kind, model.StateSpace) else raw
        raw = self.law(raw, path) if section.kind is model.Law else raw
        names = [*(item.key for item in schema.children(section.path)), *["name"] * named]
        values, meant = self.values(section.template, raw, path, names)
        if not isinstance(raw, dict):
            return UNREAD
        values |= self.tables(section.path, raw, meant)
        if named:
            values["name"] = raw["name"] if path == f"{section.path}.{raw.get('name')}" else UNREAD
        if section.kind is model.Requirement:
            known = QUANTITIES.get(f"{raw.get('quantity')}")
            values["unit"] = known.unit_for(self.structure.axis) if known else UNREAD
        return section.kind(**values)

    def law(self, raw: Any, path: str) -> Any:
        if not isinstance(raw, dict) or "file" not in raw:
            return raw
        file, rest = raw["file"], {key: value for key, value in raw.items() if key != "file"}
        held: Tree = dict.fromkeys((*PARTS, "L", "period", "inputs"), UNREAD)
        try:
            if not isinstance(file, str):
                raise InputError("allowed: a file's name")
            read = read_law(self.findings.folder / file)
            one_of = {key: read.get(key, rest[key]) for key in rest if key not in (*PARTS, "period")}
            if twice := [key for key in rest if key not in one_of or one_of[key] != rest[key]]:
                raise InputError(f"allowed: a file's name, without {', '.join(twice)}, which the file gives")
            held = read
        except InputError as error:
            self.refuse(f"{path}.file", file, error.message)
        return {**held, **rest}

    def tables(self, path: str, table: Tree, meant: Iterable[str]) -> Tree:
        """The parts of the tables that lie in a table (``""``: in the file), where they are written."""
        result: Tree = {}
        for section in schema.children(path):
            if section.key in meant and section.key not in table:
                result[section.attribute] = UNREAD
            elif section.many:
                result[section.attribute] = self.items(section, table.get(section.key, []))
            elif section.key in table or section.required:
                result[section.attribute] = self.part(section, table.get(section.key), section.path)
        return result

    def items(self, section: schema.Section, raw: Any) -> Any:
        """The parts of repeated tables, each known by its name, id or number."""
        most = MAX_GEARS if section.many == "named" else MAX_LIST
        if not isinstance(raw, list):
            unread = self.refuse(section.path, raw, f"allowed: [[{section.path}]] tables")
            if not isinstance(raw, dict):
                return unread
            raw = [raw]
        if len(raw) > most:
            return self.unread(section.path, f"allowed: 1 to {most} items")
        paths: list[str] = []
        for index, table in enumerate(raw, 1):
            paths.append(self._label(section, table, index, paths))
        return tuple(self.part(section, *item) for item in zip(raw, paths, strict=True))

    def _label(self, section: schema.Section, table: Any, index: int, before: list[str]) -> str:
        """The dotted path of a repeated table; the name of one that is known by it is checked."""
        key = "name" if section.many == "named" else section.label
        name = table.get(key) if isinstance(table, dict) else None
        path, numbered = f"{section.path}.{name}", f"{section.path}[{index}]"
        if not key:
            return f"{section.path}.{index}"
        if section.label or not isinstance(table, dict):
            return path if isinstance(name, str) and name and path not in before else numbered
        if name is None:
            self.unread(f"{numbered}.name", 'missing; example: name = "planetary"')
        elif not (isinstance(name, str) and _NAME.match(name)):
            plain = re.sub(r"[^A-Za-z0-9 _/:+()-]+", "-", f"{name}").strip(" _/:+()-")[:60].strip(" /:(")
            strange = ", ".join(dict.fromkeys(re.findall(r"[^\w /:+()-]", f"{name}"))) or "."
            none = strange.replace(".", "dot")
            allowed = f"allowed: 1 to 64 letters, digits, spaces and - _ / : + ( ), no {none}, as"
            self.refuse(f"{numbered}.name", name, f'{allowed} "{plain or "first"}"')
        elif path in before:
            self.refuse(f"{numbered}.name", name, "allowed: each name once")
        else:
            return path
        return numbered

    def objects(self, raw: Any) -> model.ControllerObjects:
        try:
            return objects_from({} if raw is None else raw)
        except InputError as error:
            self.unread("objects", error.message)
        return model.ControllerObjects()


def _meant(table: Tree, path: str) -> Any:
    """The word of a key on which the reading of others depends: where it is none, the nearest."""
    field = schema.FIELDS[path]
    return meant_of(f"{table.get(field.key, field.default)}", field.choices) or field.default


def _rows_flat(raw: Any) -> Any:
    """The table of a law or of its continuous counterpart, C, D and L of one row or column as lists."""
    if not isinstance(raw, dict):
        return raw
    lists = {key: raw[key] for key in ("C", "D", "L") if isinstance(raw.get(key), list) and raw[key]}
    rows = {key: one for key, one in lists.items() if all(isinstance(row, list) for row in one)}
    thin = {key: one for key, one in rows.items() if len(one) == 1 or all(len(row) == 1 for row in one)}
    return {**raw, **{key: [each for row in one for each in row] for key, one in thin.items()}}


def _fits(field: Field, raw: Any) -> bool:
    if field.kind == "flag" or not isinstance(raw, str):
        return field.kind == "flag" and isinstance(raw, bool)
    if field.kind == "day":
        with suppress(ValueError):
            return bool(date.fromisoformat(raw))
        return False
    return bool(raw.strip()) if field.kind == "label" else not field.choices or raw in field.choices


def _example(field: Field) -> str:
    example = f'example: {field.key} = "{field.example}" ({field.description})'
    return f"; {example if field.example else field.description}"
