"""What changed between two results of a design, how much it matters, what is behind it, and that in words.

"control.position.gain 90 → 120 1/s: phase margin of the position loop 62.1 → 55.3 deg"
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.files.reading import Tree
from analyses.finite import finite
from reports.nightly.figures import Figure
from reports.nightly.history import History
from reports.nightly.moves import WINDOW, Tolerances, flaps
from reports.nightly.records import Baseline, Result, Run
from reports.nightly.source import commits_between
from reports.nightly.text import one_line
from reports.numbers import or_none

if TYPE_CHECKING:
    from reports.nightly.view import DesignView

SHOWN_CHANGES = 100
Differences = tuple[tuple[str, str, str], ...]  # name, before, after
_CODE = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Change:
    """One figure that moved beyond its tolerance; ``worse`` is ``None`` where no direction is known."""

    figure: str
    unit: str
    kind: str
    before: float | None
    after: float | None
    tolerance: float
    worse: bool | None
    flapping: bool = False

    @property
    def delta(self) -> float | None:
        return None if self.before is None or self.after is None else self.after - self.before


@dataclass(frozen=True, kw_only=True)
class Cause:
    """What differs between the two nights that a result comes from; commits are those in between."""

    parameters: Differences = ()
    settings: Differences = ()
    libraries: Differences = ()
    commits: tuple[tuple[str, str], ...] = ()
    code: bool = False


@dataclass(frozen=True)
class Comparison:
    """A design tonight against one earlier night; without ``run`` there was nothing to compare with."""

    run: Run | None = None
    changes: tuple[Change, ...] = ()
    cause: Cause = Cause()
    note: str = ""

    @cached_property
    def regressions(self) -> tuple[Change, ...]:
        return tuple(c for c in self.changes if c.worse)


class Columns:
    """The figures of a history as columns: what each is, and how far it may move."""

    def __init__(self, figures: Sequence[Figure], tolerances: Tolerances) -> None:
        self.figures = tuple(figures)
        self.names = [figure.name for figure in figures]
        pairs = [tolerances.pair(figure) for figure in figures]
        self._absolute, self._relative = np.array(pairs).reshape(-1, 2).T

    def allowed(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """How far each figure may move between values, shape (..., figures); NaN where there is none."""
        return np.maximum(self._absolute, self._relative * np.fmax(np.abs(before), np.abs(after)))

    def moved(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Which figures moved beyond their tolerance, appeared or vanished, shape (..., figures)."""
        there = np.isfinite(before) | np.isfinite(after)
        return there & ~(np.abs(after - before) <= self.allowed(before, after))

    def compare(self, before: np.ndarray, after: np.ndarray) -> tuple[Change, ...]:
        """List every figure that moved beyond its tolerance, appeared or vanished; the worst first."""
        changes, moved = [], self.moved(before, after)
        far = (part.tolist() for part in (before, after, self.allowed(before, after)))
        for of, was, now, allowed in compress(zip(self.figures, *far, strict=True), moved):
            old, new = finite(was), finite(now)
            changes.append(Change(of.name, of.unit, of.kind, old, new, allowed, _worse(of, old, new)))
        return tuple(sorted(changes, key=_order))


def _worse(figure: Figure, old: float | None, new: float | None) -> bool | None:
    if figure.kind == "verdict":
        return new == 0.0 or (new is None and old == 1.0)
    if old is None or new is None or not figure.better:
        return None
    larger = abs(new) - abs(old) if abs(figure.better) == 2 else new - old
    return larger * figure.better < 0.0


def _order(change: Change) -> tuple[bool, bool, float, str]:
    """What got worse first, then verdicts, then what moved by most of its tolerances."""
    delta = change.delta
    far = abs(delta) / change.tolerance if delta is not None and change.tolerance > 0.0 else math.inf
    return not change.worse, change.kind != "verdict", -far, change.figure


class Between:
    """Compares nights of a history; ``origin`` is the study's file, whose commits are told."""

    def __init__(self, history: History, tolerances: Tolerances, origin: Path | None) -> None:
        self.history = history
        self.tolerances = tolerances
        self.origin = origin
        self._runs = {run.id: run for run in history.runs}
        self._columns: dict[tuple[int, int], Columns] = {}

    def last_night(self, result: Result, past: list[Result]) -> Comparison:
        """What changed since the last night that has a result."""
        before = self.history.first(result.name, (r for r in self.history.runs[::-1] if r.id < result.run))
        if before is None:
            alone = all(r.run >= result.run for r in past)
            return Comparison(note="first night of this design" if alone else "no earlier night has a result")
        skipped = sum(before.run < night < result.run for night in self._runs)
        note = f"{skipped} night(s) without a result before; compared with the last that has one"
        found = self._compare(before, result, note * bool(skipped))
        shown = found.changes[:SHOWN_CHANGES]  # only what a page shows is looked at for going to and fro
        histories = self.history.matrix(past[-WINDOW:], [c.figure for c in shown]).T.tolist()
        marked = [replace(c, flapping=flaps(x, c.tolerance)) for c, x in zip(shown, histories, strict=True)]
        return replace(found, changes=(*marked, *found.changes[SHOWN_CHANGES:]))

    def baseline(self, result: Result, approval: Baseline | None) -> Comparison:
        """What changed since the approved night, else since the first that has a result."""
        nights = self.history.runs if approval is None else [self._runs[approval.run]]
        first, note = self.history.first(result.name, nights), ""
        if first is None:
            return Comparison(note="no baseline: no night has a result")
        if approval is None and first.run == result.run:
            return Comparison(self._runs[first.run], note="this is the first night: nothing to compare with")
        if approval is None:
            note = "nobody has approved a baseline yet: compared with the first night"
        return self._compare(first, result, note)

    def _compare(self, old: Result, new: Result, note: str) -> Comparison:
        before, after = self._runs[old.run], self._runs[new.run]
        if new.home is None or new.home == old.home:
            return Comparison(before, note=note or "no result tonight" * (new.home is None))
        columns = self._columns_of(old, new)
        changes = columns.compare(*self.history.matrix((old, new), columns.names))
        was, now = (self.history.inputs(result) for result in (old, new))
        both = [kind for kind in ("parameters", "keys") if kind in was and kind in now]  # old nights lack one
        cause = Cause(
            parameters=tuple(one for kind in both for one in _differences(was[kind], now[kind])),
            settings=_differences(was.get("settings", {}), now.get("settings", {})),
            libraries=_differences(before.libraries, after.libraries),
            commits=self._commits(before, after),
            code=before.code != after.code,
        )
        return Comparison(before, changes, cause, note)

    def _columns_of(self, old: Result, new: Result) -> Columns:
        """The figures of two results, each as the new one declares it where both have it."""
        before, after = (self.history.numbers(result)[0] for result in (old, new))
        if (key := (id(before), id(after))) not in self._columns:  # the history keeps them
            known = {figure.name: figure for figure in (*before, *after)}
            self._columns[key] = Columns(list(known.values()), self.tolerances)
        return self._columns[key]

    def _commits(self, old: Run, new: Run) -> tuple[tuple[str, str], ...]:
        """First lines of the commits between two nights, each with where: those of the code, of the study."""
        code, own = (old.code_commit, new.code_commit), (old.study_commit, new.study_commit)
        places = {"code": (_CODE, *code)}
        if self.origin is not None and own != code:
            places["study"] = (self.origin, *own)
        return tuple((where, line) for where, place in places.items() for line in commits_between(*place))


def _differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Differences:
    pairs = {name: (old.get(name, "(none)"), new.get(name, "(none)")) for name in {**new, **old}}
    return tuple((name, one_line(str(a)), one_line(str(b))) for name, (a, b) in pairs.items() if a != b)


# ---- in words --------------------------------------------------------------------------------------------

SHOWN = 5
_VALUE, _DISTANCE = ": value", ": distance"
NO_FIGURE = "no figure with a value changed"
CODE_CHANGED = "sources of actuator-lti changed without a commit"


@dataclass(frozen=True)
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
        made.append(Headline(cause, effect, worse, (first, *more)))
    return tuple(sorted(made, key=lambda one: not one.worse))


def cause_words(cause: Cause) -> str:
    if values := [f"{name} {_step(old, new)}" for name, old, new in (*cause.parameters, *cause.settings)]:
        more = f"; {len(values) - 2} more values" * (len(values) > 2)
        return one_line("; ".join(values[:2]) + more, 200)
    if cause.commits:
        more = f" and {len(cause.commits) - 1} more" * (len(cause.commits) > 1)
        return one_line(f"commit {cause.commits[0][1]}", 120) + more
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
    return tuple(sorted(valued, key=lambda c: (not c.worse, c.kind != "distance"))[:SHOWN])


def change_words(change: Change, comparison: Comparison, verdicts: Sequence[Tree]) -> str:
    """Say one change; of a distance to a requirement, the required figure itself."""
    name, moved = change.figure.removesuffix(_DISTANCE), change
    if change.kind == "distance":
        value = next((c for c in comparison.changes if c.figure == name + _VALUE), None)
        moved = value or change
        label = next((v["label"] for v in verdicts if v["id"] == name), name)
        place, colon, what = label.partition(": ")  # of "Position loop: phase margin", say
        label = one_line(f"{what} of the {place[:1].lower()}{place[1:]}" if colon else label, 100)
        label += ", distance to its limit" * (value is None)  # the figure itself stayed
    else:
        *_, row, column = ["", *name.split(" / ")]
        label = one_line(f"{column[:1].lower()}{column[1:]} of {row}" if row else column, 100)
    return f"{label} {or_none(moved.before)} → {or_none(moved.after)} {change.unit}".rstrip()
