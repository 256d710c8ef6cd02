"""What comes with the package, the keys that a design file may have, and a file to start from."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design import design_hash, load_design, read_design_text, shipped_designs, warnings_of
from actuator_lti.design.key_reference import Explained, KeyEntry, explained, key_reference, record_reference
from actuator_lti.design.loader import design_text
from actuator_lti.design.model import Axis, Design
from actuator_lti.design.sheet_words import key_for
from actuator_lti.drive.sheet_figures import SheetFigure, sheet_figures
from actuator_lti.errors import InputError
from reports.cli.options import write_new
from reports.design_files.asked import KINDS, AskedKeys, AskedStart
from reports.design_files.parts import with_parts


@dataclass(frozen=True, kw_only=True)
class Listed:
    """What the list says of one design; of a loop its controller and how often it runs, inner one first."""

    name: Annotated[str, "Design"]
    title: Annotated[str, "Title"]
    revision: str
    axis: str
    motor: Annotated[str, "Motor"]
    loops: Annotated[tuple[str, ...], "Loops"]
    gears: tuple[str, ...]
    total_ratio: Annotated[float, "Total ratio"]
    period_s: float
    requirements: int
    warnings: tuple[str, ...]
    hash: str


@dataclass(frozen=True)
class Catalogue:
    designs: tuple[Listed, ...]

    def __str__(self) -> str:
        return f"{len(self.designs)} designs come with the package"


def designs() -> Catalogue:
    return Catalogue(tuple(_listed(load_design(name)) for name in shipped_designs()))


def _listed(design: Design) -> Listed:
    electrical = design.motor.has_electrical_dynamics
    source = "force source" if design.axis == "linear" else "torque source"
    same = ("name", "title", "revision", "axis", "total_ratio")
    return Listed(
        **{name: getattr(design, name) for name in same},
        motor="resistance and inductance" if electrical else source, loops=_loops(design),
        gears=tuple(gear.name for gear in design.gears), period_s=design.controller.period_s,
        requirements=len(design.requirements), warnings=tuple(warnings_of(design)), hash=design_hash(design),
    )  # fmt: skip


def _loops(design: Design) -> tuple[str, ...]:
    words = []
    for name in reversed(design.controller.stages):
        loop = getattr(design.controller, name)
        kind = "PI" if loop.integral_time_s is not None else "P"
        kind = kind if loop.law is None else "law of one's own"
        every = getattr(loop, "every", 1)
        words.append(f"{name} {kind}" + (f" every {every} ticks" if every > 1 else ""))
    return tuple(words)


@dataclass(frozen=True)
class Warned:
    """What is suspicious about a design, as `margins` has it."""

    text: Annotated[str, "To be checked"]


@dataclass(frozen=True)
class Keys:
    """Keys that there are, or (of a design) its numbers, what follows, what is suspicious."""

    keys: tuple[KeyEntry, ...] | tuple[Explained, ...]
    design: Design | None = None
    figures: tuple[SheetFigure, ...] = ()
    warnings: tuple[Warned, ...] = ()

    def __str__(self) -> str:
        what = "value" if self.design else "key"
        of = f" of {self.design.name}" if self.design else ""
        return f"{len(self.keys)} {what}{'s' * (len(self.keys) != 1)}{of}"


def keys(asked: AskedKeys) -> Keys:
    """The keys whose name or meaning holds a text, or that a sheet calls so; an InputError if none does."""
    text = asked.match.lower()
    if asked.explain is not None:
        design = load_design(asked.explain)
        figures = tuple(one for one in sheet_figures(design) if text in one.name.lower())
        rows = explained(design)
        if "load.path" not in design.written:  # an engineer has to say it
            path = f"{design.load.path}, assumed"
            rows += (Explained("load.path", "not written", path, "a load only adds friction"),)
        warnings = tuple(Warned(line) for line in warnings_of(design) if text in line.lower())
        return Keys(tuple(item for item in rows if text in item.path), design, figures, warnings)
    axis: Axis = "linear" if asked.linear else "rotary"
    listed = (*key_reference(axis), *record_reference(axis))
    found = (*(key for key in listed if _is_called(key, text)), *_limited(text, axis))
    if not found:
        raise InputError(
            f"{asked.match!r}: no key has it in its name or meaning; allowed: see actuator-lti keys; "
            "settings of a controller as a file: actuator-lti objects import"
        )
    return Keys(found)


def _limited(text: str, axis: Axis) -> Iterator[KeyEntry]:
    """The figures of which a text is said and that a requirement may limit, a row each."""
    key = next(key for key in record_reference(axis) if key.path == "requirement.quantity")
    for name, of in QUANTITIES.items():
        if text and (text in of.words or text in name):
            words = f"{of.words}: {of.description}"
            yield replace(key, unit=of.unit_for(axis), allowed=f'"{name}"', description=words)


def _is_called(key: KeyEntry, text: str) -> bool:
    """Whether a text stands in a key's name or meaning, or is the word of a data sheet for it."""
    stands = text in key.path.lower() or text in key.description.lower()
    return stands or re.match(rf"{key.key}\b(?! of)", key_for(key.section, text)) is not None


@dataclass(frozen=True)
class Started:
    file: str

    def __str__(self) -> str:
        return f"wrote {self.file}; next: actuator-lti report {self.file}"


def init(asked: AskedStart) -> Started:
    """Write a commented design file, named as the file is, where there is none already."""
    source = KINDS[asked.kind] if asked.kind else asked.source
    starter = Path(__file__).parents[1] / "templates" / "design.toml"
    text = starter.read_text(encoding="utf-8") if source is None else design_text(source)
    if asked.motor is not None or asked.gear is not None:
        text = with_parts(text, asked.motor, asked.gear)
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}", name := asked.file.stem):  # can be a design's, too
        head = r'(?m)^(\[design\]\n(?:[^\[\n]*\n)*?name = )"[^"\n]*"'
        text = re.sub(head, rf'\1"{name}"', text, count=1)
    read_design_text(text, str(asked.file))
    write_new(asked.file, text, asked.force)
    return Started(str(asked.file))
