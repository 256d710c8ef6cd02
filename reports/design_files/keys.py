"""The keys of a design file, and how the numbers of one were understood."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from analyses.request import Option

if TYPE_CHECKING:
    from actuator_lti.design.explained import Explained
    from actuator_lti.design.key_reference import KeyEntry
    from actuator_lti.design.model import Design


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Which keys."""

    match: Annotated[
        str,
        Option(words="Only keys whose name or meaning holds this text.", metavar="TEXT", argument=True),
    ] = ""
    explain: Annotated[
        str | None,
        Option(words="The numbers of a design: written, read as, in the model as.", metavar="FILE"),
    ] = None
    linear: Annotated[bool, Option(words="Units of a linear axis (m, N, kg).")] = False


@dataclass(frozen=True)
class Keys:
    """Keys that there are, or (of a design) its numbers."""

    keys: tuple[KeyEntry, ...] | tuple[Explained, ...]
    design: Design | None = None

    def __str__(self) -> str:
        return f"{len(self.keys)} {'numbers of ' + self.design.name if self.design else 'keys'}"


def keys(asked: Asked) -> Keys:
    """The keys whose name or meaning holds a text.

    Raises
    ------
    InputError
        If none does, or the design that is to be explained is refused.
    """
    from actuator_lti.design import load_design
    from actuator_lti.design.explained import explained
    from actuator_lti.design.key_reference import key_reference

    text = asked.match.lower()
    if asked.explain is not None:
        design = load_design(asked.explain)
        return Keys(tuple(item for item in explained(design) if text in item.path), design)
    found = [
        key
        for key in key_reference("linear" if asked.linear else "rotary")
        if text in key.path.lower() or text in key.description.lower()
    ]
    if not found:
        raise InputError(
            f"{asked.match!r}: no key has it in its name or meaning; allowed: see actuator-lti keys"
        )
    return Keys(tuple(found))
