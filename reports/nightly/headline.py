"""A night in a few lines: what was changed, and what that did to the figure that matters most.

"control.position.gain 90 → 120 1/s: phase margin of the position loop 62.1 → 55.3 deg"
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from reports.nightly.changes import Cause, Change, Comparison
from reports.nightly.figures import Verdict
from reports.nightly.text import one_line
from reports.numbers import or_none

if TYPE_CHECKING:
    from reports.nightly.view import DesignView

SHOWN = 5
_VALUE, _DISTANCE, _MET = ": value", ": distance", ": met"


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
    made = [_headline(cause, result) for cause, result in groups.items()]
    return tuple(sorted(made, key=lambda one: not one.worse))


def _headline(cause: str, result: Sequence[DesignView]) -> Headline:
    ordered = sorted(result, key=lambda d: (not d.last_night.regressions, d.rank))
    first = ordered[0]
    effect, worse = gravest(first.last_night, first.verdicts)
    return Headline(cause=cause, effect=effect, worse=worse, designs=tuple(ordered))


def cause_words(cause: Cause) -> str:
    """Say in one phrase what differs between two nights, the design itself first."""
    values = [f"{name} {_step(old, new)}" for name, old, new in (*cause.parameters, *cause.settings)]
    if values:
        more = len(values) - 2
        return one_line("; ".join(values[:2]) + (f"; {more} more values" if more > 0 else ""), 200)
    if cause.commits:
        _where, line = cause.commits[0]
        more = len(cause.commits) - 1
        return one_line(f"commit {line}", 120) + (f" and {more} more" if more else "")
    if cause.libraries:
        return one_line("; ".join(f"{name} {old} → {new}" for name, old, new in cause.libraries), 200)
    if cause.code:
        return "sources of actuator-lti changed without a commit"
    return "no input differs"


def _step(old: str, new: str) -> str:
    """Write a change of a value, the unit once where it is the same."""
    before, _, unit = old.partition(" ")
    after, _, other = new.partition(" ")
    return f"{before} → {after} {unit}".rstrip() if unit == other else f"{old} → {new}"


def gravest(comparison: Comparison, verdicts: Sequence[Verdict]) -> tuple[str, bool]:
    """Say what happened to the figure that matters most, and whether it got worse."""
    shown = main_changes(comparison)
    if not shown:
        return "no figure with a value changed", bool(comparison.regressions)
    first = shown[0]
    return change_words(first, comparison, verdicts), bool(first.worse)


def main_changes(comparison: Comparison) -> tuple[Change, ...]:
    """Give the changes to read first: distances to requirements, then the rest; no figure twice."""
    valued = [c for c in comparison.changes if c.kind not in ("verdict", "requirement", "check")]
    ranked = sorted(valued, key=lambda c: (not c.worse, c.kind != "distance"))
    return tuple(ranked[:SHOWN])


def change_words(change: Change, comparison: Comparison, verdicts: Sequence[Verdict]) -> str:
    """Say one change; of a distance to a requirement, the required figure itself."""
    name, before, after, unit = change.figure, change.before, change.after, change.unit
    if change.kind == "distance":
        known = {c.figure: c for c in comparison.changes}
        own = known.get(name.removesuffix(_DISTANCE) + _VALUE)
        label = next((v.label for v in verdicts if v.id + _DISTANCE == name), name.removesuffix(_DISTANCE))
        before, after = (own.before, own.after) if own else (before, after)
        return f"{_turned(label)} {_pair(before, after)} {unit}".rstrip()
    *_, row, column = ["", *name.split(" / ")]
    label = f"{column[:1].lower()}{column[1:]} of {row}" if row else column
    return f"{one_line(label, 100)} {_pair(before, after)} {unit}".rstrip()


def _turned(label: str) -> str:
    """Turn "Position loop: phase margin" into "phase margin of the position loop"."""
    place, colon, what = label.partition(": ")
    return one_line(f"{what} of the {place[:1].lower()}{place[1:]}" if colon else label, 100)


def _pair(before: float | None, after: float | None) -> str:
    return f"{or_none(before)} → {or_none(after)}"
