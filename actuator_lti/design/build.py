"""From the checked shape of a design file to a :class:`Design` in SI units."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from actuator_lti.design import model
from actuator_lti.design.fields import FIELDS, Field, Structure, fields_in
from actuator_lti.design.model import Screw
from actuator_lti.design.objects import check_objects
from actuator_lti.design.parameters import FrozenMap
from actuator_lti.design.quantities import QUANTITIES, parse_limit
from actuator_lti.design.refusals import nearest
from actuator_lti.design.sections import Section, children
from actuator_lti.design.settings_checks import checked_factor
from actuator_lti.design.settings_file import object_from
from actuator_lti.design.tolerances import read_tolerance
from actuator_lti.design.units import parse_quantity
from actuator_lti.errors import InputError
from actuator_lti.reading import shown
from actuator_lti.tree import Tree

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")


def written(value: object, unit: str) -> str:
    """A value as text."""
    return value if isinstance(value, str) else f"{value!r}" + ("" if unit == "1" else f" {unit}")


class Builder:
    """Collects the sections of one document into a design; ``where`` is named in every error."""

    def __init__(self, document: Any, where: str) -> None:
        self.document = document
        self.where = where
        self.parameters: dict[str, model.Parameter] = {}
        control = document.control
        self.structure = Structure(
            document.design.axis or "rotary", control.velocity is not None, control.current is not None
        )
        self.travel_m_rad: float | None = None
        self.travel_m_rad = self._travel()

    def refuse(self, path: str, value: object, reason: str) -> InputError:
        """The error of one key."""
        return InputError(f"{path} = {shown(value)}: {reason}", where=self.where)

    def quantity(self, text: Any, field: Field) -> float:
        """The SI value of a text; behind a screw also from the units of a rotary axis."""
        unit, power = field.unit(self.structure), field.travel_power()
        if self.travel_m_rad is None or power == 0 or not isinstance(text, str):
            return parse_quantity(text, unit)
        rotary = field.unit(replace(self.structure, axis="rotary"))
        if rotary == unit:  # the gain of a position loop before a velocity loop, 1/s on either axis
            return parse_quantity(text, unit)
        try:
            return parse_quantity(text, rotary) * self.travel_m_rad**power
        except InputError:
            return parse_quantity(text, unit)

    def _travel(self) -> float | None:
        """p of the screw, needed before anything else is read; None without one."""
        if self.document.screw is None:
            return None
        if self.structure.axis != "linear":
            raise self.refuse("screw", "a table", 'allowed with design.axis = "linear"')
        return Screw(
            lead_m=self._number("screw.lead", self.document.screw.lead.value, FIELDS["screw.lead"])
        ).travel_m_rad

    def _number(self, path: str, text: Any, field: Field) -> float:
        unit = field.unit(self.structure)
        try:
            value = self.quantity(text, field)
        except InputError as error:
            upside = _upside_down(text) if field.path == "motor.back_emf_constant" else None
            if upside is None:
                raise self.refuse(path, text, error.message) from None
            value = self._number(path, upside, field)
        if field.kind == "integer" and value != int(value):
            raise self.refuse(path, text, "allowed: a whole number")
        if not field.accepts(value):
            raise self.refuse(path, text, f"allowed: {field.allowed(unit)}")
        return value

    def _entry(self, path: str, raw: Any, field: Field) -> float | int:
        value = self._number(path, raw.value, field)
        unit = field.unit(self.structure)
        tolerance = None
        if raw.tolerance is not None:
            try:
                tolerance = read_tolerance(
                    raw.tolerance, value, lambda text: self.quantity(text, field), field, unit
                )
            except InputError as error:
                given = raw.tolerance if isinstance(raw.tolerance, str | int | float) else "table"
                raise self.refuse(f"{path}.tolerance", given, error.message) from None
        self.parameters[path] = model.Parameter(
            path=path,
            text=written(raw.value, unit),
            value=value,
            unit=unit,
            symbol=field.symbol,
            source=raw.source,
            grade=raw.grade,
            tolerance=tolerance,
        )
        return int(value) if field.kind == "integer" else value

    def part(self, section: Section, raw: Any, path: str) -> Any:
        """An object of the section's kind from the values written in one table, with the tables inside it."""
        values: Tree = {"name": path.rpartition(".")[2]} if section.many == "named" else {}
        for field in fields_in(section.template):
            given = getattr(raw, field.key)
            if given is None:
                continue
            where = f"{path}.{field.key}"
            if field.kind in ("quantity", "integer"):
                values[field.attribute] = self._entry(where, given, field)
            elif field.kind == "quantities":
                items = enumerate(given, 1)
                values[field.attribute] = tuple(self._number(f"{where}[{i}]", v, field) for i, v in items)
            else:
                values[field.attribute] = given
        return section.kind(**values, **self.tables(section.path, raw))

    def tables(self, path: str, raw: Any) -> Tree:
        """The parts of the tables that lie in a table (``""``: in the file), where they are written."""
        result: Tree = {}
        for section in children(path):
            given = getattr(raw, section.key)
            if section.many:
                result[section.attribute] = self._items(section, given)
            elif given is not None:
                result[section.attribute] = self.part(section, given, section.path)
        return result

    def _items(self, section: Section, given: Any) -> tuple[Any, ...]:
        paths: list[str] = []
        for index, raw in enumerate(given):
            path = section.item_path(index, raw)
            if section.many == "named":
                self.name(f"{section.path}.name", raw.name)
                if path in paths:
                    raise self.refuse(f"{section.path}.name", raw.name, "allowed: each name once")
            paths.append(path)
        return tuple(self.part(section, raw, path) for raw, path in zip(given, paths, strict=True))

    def name(self, path: str, name: str) -> str:
        """A name that may stand in dotted keys."""
        if not _NAME.match(name):
            raise self.refuse(path, name, "allowed: 1 to 64 letters, digits, - and _, no dot or space")
        return name

    def label(self, path: str, text: str) -> str:
        """A free text that names something; only reports show it."""
        if not text.strip():
            raise self.refuse(path, text, "allowed: a text")
        return text

    def requirement(self, raw: Any) -> model.Requirement:
        """One requirement, its limits in the unit in which its quantity is reported."""
        path = f"requirement.{shown(self.label('requirement.id', raw.id))[1:-1]}"
        quantity = QUANTITIES.get(raw.quantity)
        if quantity is None:
            hint = nearest(raw.quantity, tuple(QUANTITIES)).strip()
            more = f"one of {len(QUANTITIES)}, see Requirement quantities in the documentation"
            allowed = f"{hint}; allowed: {more}" if hint else f"allowed: {', '.join(QUANTITIES)}"
            raise self.refuse(f"{path}.quantity", raw.quantity, allowed)
        unit = quantity.unit_for(self.structure.axis)
        torque = "N" if self.structure.axis == "linear" else "N*m"
        return model.Requirement(
            id=raw.id,
            quantity=raw.quantity,
            unit=unit,
            minimum=self._limit(f"{path}.minimum", raw.minimum, lambda text: parse_limit(text, unit)),
            maximum=self._limit(f"{path}.maximum", raw.maximum, lambda text: parse_limit(text, unit)),
            loop=raw.loop,
            rotor=raw.rotor,
            to=raw.to,
            load_Nm=self._limit(f"{path}.load", raw.load, lambda text: parse_quantity(text, torque)),
            source=raw.source,
            note=raw.note,
        )

    def _limit(self, path: str, text: Any, parse: Callable[[Any], float]) -> float | None:
        if text is None:
            return None
        try:
            return parse(text)
        except (InputError, ValueError) as error:
            raise self.refuse(path, text, getattr(error, "message", str(error))) from None

    def objects(self) -> model.ControllerObjects:
        """The settings that the design was imported from."""

        raw = self.document.objects
        if raw is None:
            return model.ControllerObjects()
        values = tuple(object_from(label, entry, self.where) for label, entry in raw.values.items())
        check_objects(values, self.where)
        factor = checked_factor(raw.velocity_gain_factor, self.where)
        return model.ControllerObjects(velocity_gain_factor=factor, values=values, family=raw.family)

    def design(self, origin: str) -> model.Design:
        """The whole design."""
        head = self.document.design
        # 10 deg (0.01 m) without a load where the file does not say what to validate
        fallback = model.Validation(full_deflection_rad=model.default_deflection(self.structure.axis))
        parts = {"validation": fallback, **self.tables("", self.document)}
        return model.Design(
            name=self.label("design.name", head.name),
            title=head.title or head.name,
            axis=self.structure.axis,
            revision=head.revision or "",
            description=head.description or "",
            origin=origin,
            requirements=tuple(self.requirement(raw) for raw in self.document.requirement),
            waivers=tuple(model.Waiver(**raw.model_dump()) for raw in self.document.waiver),
            correlations=tuple(
                model.Correlation(first=c.first, second=c.second, coefficient=float(c.coefficient))
                for c in self.document.correlation
            ),
            facts=tuple(
                model.Fact(label=f.label, value=f.value, source=f.source, grade=f.grade)
                for f in self.document.fact
            ),
            objects=self.objects(),
            parameters=FrozenMap(self.parameters),
            **parts,
        )


def _upside_down(text: Any) -> str | None:
    """The back-EMF constant of a speed constant, as many data sheets have it: ``"83.4 rpm/V"``."""
    for unit, turned in (("rad/(V*s)", "V*s/rad"), ("m/(V*s)", "V*s/m")):
        try:
            value = parse_quantity(text, unit)
        except InputError:
            continue
        return f"{1.0 / value!r} {turned}" if value > 0.0 else None
    return None
