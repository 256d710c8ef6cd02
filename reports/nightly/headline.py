"""A night in a few lines: what was changed, and what that did to the figure that matters most.

"control.position.gain 90 → 120 1/s: phase margin of the position loop 62.1 → 55.3 deg"
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from actuator_lti.files.tree import Tree
from reports.nightly.changes import Cause, Change, Comparison
from reports.nightly.text import one_line
from reports.numbers import or_none

if TYPE_CHECKING:
    from reports.nightly.view import DesignView

SHOWN = 5
_VALUE, _DISTANCE = ": value", ": distance"
NO_FIGURE = "no figure with a value changed"
CODE_CHANGED = "sources of actuator-lti changed without a commit"


@dataclass(frozen=True, kw_only=True)
class Headline:
    """One cause and its gravest effect; ``designs`` are all that it changed, the gravest first."""

    cause: str
    effect: str
    worse: bool
    designs: tuple[DesignView, ...]


def headlines(designs: Sequence[DesignView]) -> tuple[Headline, ...]:
    """Group what changed since last night by its cause; what got worse comes first."""
    groups: dict[str, list[DesignView]] = {}
    for design in designs:
        if design.last_night.changes:
            groups.setdefault(cause_words(design.last_night.cause), []).append(design)
    made = []
    for cause, changed in groups.items():
        first, *more = sorted(changed, key=lambda d: (not d.last_night.regressions, d.rank))
        shown = main_changes(first.last_night)
        effect = change_words(shown[0], first.last_night, first.verdicts) if shown else NO_FIGURE
        worse = bool(shown[0].worse if shown else first.last_night.regressions)
        made.append(Headline(cause=cause, effect=effect, worse=worse, designs=(first, *more)))
    return tuple(sorted(made, key=lambda one: not one.worse))


def cause_words(cause: Cause) -> str:
    values = [f"{name} {_step(old, new)}" for name, old, new in (*cause.parameters, *cause.settings)]
    if values:
        more = len(values) - 2
        return one_line("; ".join(values[:2]) + (f"; {more} more values" if more > 0 else ""), 200)
    if cause.commits:
        more = len(cause.commits) - 1
        return one_line(f"commit {cause.commits[0][1]}", 120) + (f" and {more} more" if more else "")
    if cause.libraries:
        return one_line("; ".join(f"{name} {old} → {new}" for name, old, new in cause.libraries), 200)
    return CODE_CHANGED if cause.code else "no input differs"


def cause_lines(cause: Cause) -> list[str]:
    kinds = {"parameter": cause.parameters, "setting": cause.settings, "library": cause.libraries}
    lines = [f"{kind} {name}: {old} → {new}" for kind, each in kinds.items() for name, old, new in each]
    lines += [f"commit ({where}) {line}" for where, line in cause.commits]
    silent = cause.code and not cause.commits and not cause.libraries
    return [*lines, CODE_CHANGED] if silent else lines


def _step(old: str, new: str) -> str:
    """Write a change of a value, the unit once where it is the same."""
    before, _, unit = old.partition(" ")
    after, _, other = new.partition(" ")
    return f"{before} → {after} {unit}".rstrip() if unit == other else f"{old} → {new}"


def main_changes(comparison: Comparison) -> tuple[Change, ...]:
    """Give the changes to read first: distances to requirements, then the rest; no figure twice."""
    valued = [c for c in comparison.changes if c.kind not in ("verdict", "requirement", "check")]
    ranked = sorted(valued, key=lambda c: (not c.worse, c.kind != "distance"))
    return tuple(ranked[:SHOWN])


def change_words(change: Change, comparison: Comparison, verdicts: Sequence[Tree]) -> str:
    """Say one change; of a distance to a requirement, the required figure itself."""
    name, moved = change.figure.removesuffix(_DISTANCE), change
    if change.kind == "distance":
        moved = next((c for c in comparison.changes if c.figure == name + _VALUE), change)
        label = next((v["label"] for v in verdicts if v["id"] == name), name)
        place, colon, what = label.partition(": ")  # of "Position loop: phase margin", say
        label = one_line(f"{what} of the {place[:1].lower()}{place[1:]}" if colon else label, 100)
    else:
        *_, row, column = ["", *name.split(" / ")]
        label = one_line(f"{column[:1].lower()}{column[1:]} of {row}" if row else column, 100)
    return f"{label} {or_none(moved.before)} → {or_none(moved.after)} {change.unit}".rstrip()
