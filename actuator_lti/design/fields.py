"""The one registry of a design file, over which all loop: tables, which part each becomes, its keys."""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, replace
from functools import cache
from typing import Any, Literal, get_args

from actuator_lti.asked.quantities import LOOPS
from actuator_lti.design import model
from actuator_lti.design.field import Axis, Field, Structure, named_after

Many = Literal["", "named", "numbered", "listed"]


@dataclass(frozen=True)
class Section:
    """One table of the file."""

    path: str  # table name, such as "control.velocity"; of repeated tables without the name or number
    place: str  # where the part lies in a `Design`, such as "controller.velocity"
    kind: type  # dataclass of the part
    required: bool = False  # whether a file must have it
    many: Many = ""  # repeated tables: known by their key `name`, by their number from 1, or by `label`
    rare: bool = False  # whether lists of values pass over it while all its values are the defaults
    asked: bool = False  # of the drive, which it is not: the hash knows it where it stands
    label: str = ""  # the key that a listed table is known by; its number from 1 where empty

    @property
    def template(self) -> str:
        """The path under which the fields of this section are registered, such as ``"gear.*"``."""
        return f"{self.path}.*" if self.many in ("named", "numbered") else self.path

    @property
    def parent(self) -> str:
        return self.path.rpartition(".")[0]

    @property
    def key(self) -> str:
        return self.path.rpartition(".")[2]

    @property
    def attribute(self) -> str:
        return self.place.rpartition(".")[2]

    @property
    def optional(self) -> bool:
        """Whether its attribute is None in a design without it."""
        owner = BY_PATH[self.parent].kind if self.parent else model.Design
        return any(item.name == self.attribute and item.default is None for item in fields(owner))

    def items(self, design: model.Design) -> Iterator[tuple[str, Any]]:
        """Its repeated tables in a design, by their dotted paths: ``gear.worm``, ``friction.point.2``."""
        for number, item in enumerate(at_place(design, self.place) or (), 1):
            yield f"{self.path}.{item.name if self.many == 'named' else number}", item


HEAD = Section("design", "", model.Design, required=True)
"""What stands at the beginning of a file: keys of the design itself."""

SECTIONS: tuple[Section, ...] = (
    Section("motor", "motor", model.Motor, required=True),
    Section("screw", "screw", model.Screw),
    Section("gear", "gears", model.Gear, many="named"),
    Section("coupling", "coupling", model.Coupling),
    Section("load", "load", model.Load),
    Section("load.friction", "load.friction", model.LoadFriction),
    Section("load.gravity", "load.gravity", model.Gravity),
    Section("friction", "friction", model.Friction),
    Section("friction.point", "friction.points", model.FrictionPoint, many="numbered"),
    Section("encoder", "encoder", model.Encoder),
    Section("output_encoder", "output_encoder", model.OutputEncoder, rare=True),
    Section("instruments", "instruments", model.Instruments, rare=True),
    Section("limits", "limits", model.Limits, required=True),
    Section("supply", "supply", model.Supply),
    Section("temperature", "temperature", model.Temperature),
    Section("command", "command", model.Command, rare=True),
    Section("control", "controller", model.Controller, required=True),
    Section("control.current", "controller.current", model.CurrentLoop),
    Section("control.velocity", "controller.velocity", model.VelocityLoop),
    Section("control.velocity.filter", "controller.velocity.filters", model.Filter, many="numbered"),
    Section("control.position", "controller.position", model.PositionLoop),
    *(
        Section(f"control.{stage}.law{part}", f"controller.{stage}.law{part}", kind)
        for stage in LOOPS
        for part, kind in (("", model.Law), (".continuous", model.StateSpace))
    ),
    Section("validation", "validation", model.Validation),
    Section("failure", "failure", model.Failure, asked=True),
    Section("duty", "duty", model.DutyCycle, asked=True),
)
"""Every section, in the order of a design file."""

RECORDS: tuple[Section, ...] = (
    Section("requirement", "requirements", model.Requirement, many="listed", label="id"),
    Section("waiver", "waivers", model.Waiver, many="listed", label="requirement"),
    Section("correlation", "correlations", model.Correlation, many="listed"),
    Section("fact", "facts", model.Fact, many="listed"),
)
"""What is asked and known of a drive, at the end of its file: lists without numeric keys of the drive."""

TABLES: tuple[Section, ...] = (*SECTIONS, *RECORDS)
BY_PATH: dict[str, Section] = {section.path: section for section in SECTIONS}


@cache
def children(path: str) -> tuple[Section, ...]:
    return tuple(section for section in SECTIONS if section.parent == path)


def template_of(path: str) -> str:
    """The registered form of a dotted path: names and numbers of repeated tables become ``*``.

    >>> template_of("gear.worm.ratio"), template_of("control.velocity.filter.1.depth")
    ('gear.*.ratio', 'control.velocity.filter.*.depth')
    """
    for section in SECTIONS:
        if section.many and path.startswith(f"{section.path}."):
            _, *rest = path.removeprefix(f"{section.path}.").split(".")
            return ".".join([section.path, "*", *rest])
    return path


def parts_of(design: model.Design) -> Iterator[tuple[Section, str, Any]]:
    """Section, dotted path and part of each table that a design has; repeated ones one by one."""
    for section in SECTIONS:
        if section.many:
            yield from ((section, path, item) for path, item in section.items(design))
        elif (part := at_place(design, section.place)) is not None:
            yield section, section.path, part


def at_place(design: model.Design, place: str) -> Any:
    """The part of a design at a place such as ``"controller.velocity"``; None where a stage is absent."""
    here: Any = design
    for name in place.split("."):
        here = None if here is None else getattr(here, name)
    return here


def part_at(design: model.Design, path: str) -> Any:
    """The part that a table's dotted path names; None if the design has none."""
    if path in BY_PATH and not BY_PATH[path].many:
        return at_place(design, BY_PATH[path].place)
    section = BY_PATH[path.rpartition(".")[0]]
    return next((item for one, item in section.items(design) if one == path), None)


def with_part(design: model.Design, path: str, part: Any) -> model.Design:
    section = BY_PATH.get(path)
    if section is None:
        section = BY_PATH[path.rpartition(".")[0]]
        part = tuple(part if one == path else item for one, item in section.items(design))
    outer, _, name = section.place.rpartition(".")
    while outer:
        part = replace(at_place(design, outer), **{name: part})
        outer, _, name = outer.rpartition(".")
    return replace(design, **{name: part})


def _declared(kind: type, template: str) -> Iterator[Field]:
    """The keys that a part of a design declares beside its attributes."""
    form = "for the continuous form alone, beside the law that runs: "  # it is not the one that runs
    for item in fields(kind):
        annotated, *declared = get_args(item.type)[:2] if hasattr(item.type, "__metadata__") else (None,)
        for field in (named_after(one, item.name) for one in declared):
            yield replace(
                field, path=f"{template}.{field.path}", required=field.required or item.default is MISSING,
                default=item.default,
                choices=field.choices or (_words(annotated) if field.kind in ("choice", "names") else ()),
                description=form * template.endswith(".continuous") + field.description
            )  # fmt: skip


def _words(kind: Any) -> tuple[str, ...]:
    parts = get_args(kind)
    return parts if all(isinstance(part, str) for part in parts) else get_args(parts[0])


_IN = {one.template: tuple(_declared(one.kind, one.template)) for one in (HEAD, *TABLES)}

FIELDS: dict[str, Field] = {field.path: field for one in (HEAD, *SECTIONS) for field in _IN[one.template]}
"""Every key by its dotted path (``gear.*.ratio``), in a file's order, without the lists at its end."""


def field_of(path: str) -> Field | None:
    """The field of a dotted path such as ``"gear.planetary.ratio"``; None if there is none."""
    return None if "*" in path else FIELDS.get(template_of(path))


def axis_unit(axis: Axis, path: str) -> str:
    return FIELDS[path].unit(Structure(axis))


def fields_in(section: str) -> tuple[Field, ...]:
    """All keys of a section such as ``"control.velocity"``, ``"gear.*"`` or ``"requirement"``."""
    return _IN.get(section, ())
