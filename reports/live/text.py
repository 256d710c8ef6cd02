"""The design file as text with places that a changed value goes to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from actuator_lti.design.model import Design
from actuator_lti.design.writing import overridden_text, write_design
from reports.live_schema import SliderKey

MARK = "@@changed@@"


def patches(design: Design, keys: Sequence[SliderKey]) -> tuple[str, list[list[Any]]]:
    """Give the text of a design, and for each key what its change replaces: from, to, before, after.

    The changed text is ``before``, the value, ``after`` in place of the characters from ``from`` to ``to``.
    """
    text = write_design(design)
    return text, [_patch(text, overridden_text(design, key["path"], MARK)) for key in keys]


def _patch(text: str, changed: str) -> list[Any]:
    """Give the lines in which two texts differ, the second cut at the mark."""
    old, new = text.splitlines(keepends=True), changed.splitlines(keepends=True)
    first = 0
    while first < min(len(old), len(new)) and old[first] == new[first]:
        first += 1
    last = 0
    while last < min(len(old), len(new)) - first and old[-1 - last] == new[-1 - last]:
        last += 1
    begin, end = sum(map(len, old[:first])), sum(map(len, old[: len(old) - last]))
    before, _, after = "".join(new[first : len(new) - last]).partition(f'"{MARK}"')
    return [begin, end, before, after]
