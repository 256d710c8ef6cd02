"""From the checked shape of a design file to a :class:`Design` in SI units."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from actuator_lti.design import model
from actuator_lti.design.fields import Field, Structure, fields_in
from actuator_lti.design.parameters import FrozenMap
from actuator_lti.design.quantities import QUANTITIES, parse_limit
from actuator_lti.design.reading import shown
from actuator_lti.design.refusals import nearest
from actuator_lti.design.tolerances import read_tolerance
from actuator_lti.design.units import parse_quantity
from actuator_lti.errors import InputError

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

    def refuse(self, path: str, value: object, reason: str) -> InputError:
        """The error of one key."""
        return InputError(f"{path} = {shown(value)}: {reason}", where=self.where)

    def _number(self, path: str, text: Any, field: Field) -> float:
        unit = field.unit(self.structure)
        try:
            value = parse_quantity(text, unit)
        except InputError as error:
            raise self.refuse(path, text, error.message) from None
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
                tolerance = read_tolerance(raw.tolerance, value, unit, field)
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

    def section(
        self, kind: Callable[..., Any], section: str, raw: Any, template: str = "", /, **more: Any
    ) -> Any:
        """An object of ``kind`` from the values written in a section."""
        values: dict[str, Any] = dict(more)
        for field in fields_in(template or section):
            given = getattr(raw, field.key, None) if raw is not None else None
            if given is None:
                continue
            path = f"{section}.{field.key}"
            if field.kind in ("quantity", "integer"):
                values[field.attribute] = self._entry(path, given, field)
            elif field.kind == "quantities":
                items = enumerate(given, 1)
                values[field.attribute] = tuple(self._number(f"{path}[{i}]", v, field) for i, v in items)
            else:
                values[field.attribute] = given
        return kind(**values)

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

    def gears(self) -> tuple[model.Gear, ...]:
        """All reduction stages, motor side first."""
        gears: list[model.Gear] = []
        for raw in self.document.gear:
            name = self.name("gear.name", raw.name)
            if name in {gear.name for gear in gears}:
                raise self.refuse("gear.name", name, "allowed: each name once")
            gears.append(self.section(model.Gear, f"gear.{name}", raw, "gear.*", name=name))
        return tuple(gears)

    def controller(self) -> model.Controller:
        """Sampling and cascade."""
        raw = self.document.control
        kinds = {
            "position": model.PositionLoop,
            "velocity": model.VelocityLoop,
            "current": model.CurrentLoop,
        }
        loops: dict[str, Any] = {}
        for key, kind in kinds.items():
            part = getattr(raw, key)
            more = {"integral_time_s": None} if key == "current" else {}
            loops[key] = None if part is None else self.section(kind, f"control.{key}", part, **more)
        return self.section(model.Controller, "control", raw, **loops)

    def requirement(self, raw: Any) -> model.Requirement:
        """One requirement, its limits in the unit in which its quantity is reported."""
        path = f"requirement.{shown(self.label('requirement.id', raw.id))[1:-1]}"
        quantity = QUANTITIES.get(raw.quantity)
        if quantity is None:
            hint = nearest(raw.quantity, tuple(QUANTITIES)).strip()
            allowed = f"{hint + '; ' if hint else ''}allowed: {', '.join(QUANTITIES)}"
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

    def validation(self) -> model.Validation:
        """What to validate; 10 deg (0.01 m) without a load where the file does not say."""
        default = 0.01 if self.structure.axis == "linear" else 0.17453292519943295
        if self.document.validation is None:
            return model.Validation(full_deflection_rad=default)
        return self.section(model.Validation, "validation", self.document.validation)

    def objects(self) -> model.ControllerObjects:
        """The settings that the design was imported from."""
        from actuator_lti.design.objects import check_objects
        from actuator_lti.design.settings_file import checked_factor, object_from

        raw = self.document.objects
        if raw is None:
            return model.ControllerObjects()
        values = tuple(object_from(label, entry, self.where) for label, entry in raw.values.items())
        check_objects(values, self.where)
        factor = checked_factor(raw.velocity_gain_factor, self.where)
        return model.ControllerObjects(velocity_gain_factor=factor, values=values)

    def design(self, origin: str) -> model.Design:
        """The whole design."""
        head = self.document.design
        parts = {
            "motor": self.section(model.Motor, "motor", self.document.motor),
            "gears": self.gears(),
            "load": self.section(model.Load, "load", self.document.load),
            "friction": self.section(model.Friction, "friction", self.document.friction),
            "encoder": self.section(model.Encoder, "encoder", self.document.encoder),
            "limits": self.section(model.Limits, "limits", self.document.limits),
            "controller": self.controller(),
            "validation": self.validation(),
        }
        return model.Design(
            name=self.label("design.name", head.name),
            title=head.title or head.name,
            axis=self.structure.axis,
            revision=head.revision or "",
            description=head.description or "",
            origin=origin,
            requirements=tuple(self.requirement(raw) for raw in self.document.requirement),
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
