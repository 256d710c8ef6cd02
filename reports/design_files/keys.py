"""The keys of a design file, and how the numbers of one were understood."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from analyses.request import Option

if TYPE_CHECKING:
    from actuator_lti.design.key_reference import Explained, KeyEntry
    from actuator_lti.design.model import Axis, Design
    from actuator_lti.drive.sheet_figures import SheetFigure


@dataclass(frozen=True, kw_only=True)
class Asked:
    """List the keys of a design file: unit, default, allowed range, meaning, example.

    A repeated table stands as gear.* (by name), friction.point.* and control.velocity.filter.* (by number).
    Try: actuator-lti keys notch, or actuator-lti keys --explain my.toml
    """

    match: Annotated[
        str, Option("Only keys whose name or meaning holds this text.", "TEXT", argument=True)
    ] = ""
    explain: Annotated[
        str | None,
        Option(
            words="The numbers of a design: written, read as, in the model as; what follows, and warnings.",
            metavar="FILE",
        ),
    ] = None
    linear: Annotated[bool, Option("Units of a linear axis (m, N, kg).")] = False


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


def keys(asked: Asked) -> Keys:
    """The keys whose name or meaning holds a text, or that a data sheet or a controller calls so.

    An InputError if none does, or the design that is to be explained is refused.
    """
    from actuator_lti.design import load_design, warnings_of
    from actuator_lti.design.key_reference import explained, key_reference, record_reference
    from actuator_lti.drive.sheet_figures import sheet_figures

    text = asked.match.lower()
    if asked.explain is not None:
        design = load_design(asked.explain)
        figures = tuple(one for one in sheet_figures(design) if text in one.name.lower())
        rows = (*explained(design), *_assumed(design))
        warnings = tuple(Warned(line) for line in warnings_of(design) if text in line.lower())
        return Keys(tuple(item for item in rows if text in item.path), design, figures, warnings)
    axis: Axis = "linear" if asked.linear else "rotary"
    listed = (*key_reference(axis), *record_reference(axis))
    found = tuple(key for key in listed if _is_called(key, text))
    if not found:
        raise InputError(
            f"{asked.match!r}: no key has it in its name or meaning; allowed: see actuator-lti keys; "
            "settings of a controller as a file: actuator-lti objects import"
        )
    return Keys(found)


def _assumed(design: Design) -> tuple[Explained, ...]:
    """The path of the load where its file does not say it: an engineer has to."""
    from actuator_lti.design.key_reference import Explained

    if "load.path" in design.written:
        return ()
    path = design.load.path
    return (Explained("load.path", "not written", f"{path}, assumed", "a load only adds friction"),)


def _is_called(key: KeyEntry, text: str) -> bool:
    """Whether a text stands in a key's name or meaning, or is the word of a data sheet for it."""
    from actuator_lti.design.sheet_words import key_for

    if text in key.path.lower() or text in key.description.lower():
        return True
    return re.match(rf"{key.key}\b(?! of)", key_for(key.section, text)) is not None
