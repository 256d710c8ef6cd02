"""What changed between two results of a design, how much it matters, and what is behind it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from reports.nightly.figures import Figure
from reports.nightly.records import Run
from reports.nightly.tolerance import Tolerances


@dataclass(frozen=True, kw_only=True)
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
        """How far it moved."""
        return None if self.before is None or self.after is None else self.after - self.before


@dataclass(frozen=True, kw_only=True)
class Cause:
    """What differs between the two nights that a result comes from."""

    parameters: tuple[tuple[str, str, str], ...] = ()
    settings: tuple[tuple[str, str, str], ...] = ()
    libraries: tuple[tuple[str, str, str], ...] = ()
    commits: tuple[tuple[str, str], ...] = ()
    code: bool = False


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A design tonight against one earlier night; without ``run`` there was nothing to compare with."""

    run: Run | None = None
    changes: tuple[Change, ...] = ()
    cause: Cause = Cause()
    note: str = ""

    @cached_property
    def regressions(self) -> tuple[Change, ...]:
        """The changes for the worse."""
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
        """List every figure that moved beyond its tolerance, appeared or vanished; the worst first.

        Parameters
        ----------
        before, after : ndarray, shape (figures,)
            NaN where a result has no such value.
        """
        moved, allowed = np.flatnonzero(self.moved(before, after)), self.allowed(before, after)
        changes = [_change(self.figures[k], *map(float, (before[k], after[k], allowed[k]))) for k in moved]
        return tuple(sorted(changes, key=_order))


def _change(figure: Figure, before: float, after: float, tolerance: float) -> Change:
    old, new = (value if math.isfinite(value) else None for value in (before, after))
    return Change(
        figure=figure.name, unit=figure.unit, kind=figure.kind, before=old, after=new, tolerance=tolerance,
        worse=_worse(figure, old, new),
    )  # fmt: skip


def _worse(figure: Figure, old: float | None, new: float | None) -> bool | None:
    """Whether a change is for the worse; None where no direction is known."""
    if figure.kind == "verdict":
        return new == 0.0 or (new is None and old == 1.0)
    if old is None or new is None or not figure.better:
        return None
    larger = abs(new) - abs(old) if abs(figure.better) == 2 else new - old
    return larger * figure.better < 0.0


def _order(change: Change) -> tuple[bool, bool, float, str]:
    """What got worse first, then verdicts, then what moved by most of its tolerances."""
    known = change.delta is not None and change.tolerance > 0.0
    far = abs(change.delta or 0.0) / change.tolerance if known else math.inf
    return not change.worse, change.kind != "verdict", -far, change.figure


def cause_of(
    old: Run,
    new: Run,
    inputs: tuple[Mapping[str, Any], Mapping[str, Any]],
    commits: tuple[tuple[str, str], ...],
) -> Cause:
    """Say what differs: parameters and settings of the design, libraries, sources, commits between."""
    before, after = inputs
    return Cause(
        parameters=_differences(before.get("parameters", {}), after.get("parameters", {})),
        settings=_differences(before.get("settings", {}), after.get("settings", {})),
        libraries=_differences(old.libraries, new.libraries),
        commits=commits,
        code=old.code != new.code,
    )


def _differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[tuple[str, str, str], ...]:
    names = [*new, *(n for n in old if n not in new)]
    return tuple((str(n), _text(old.get(n)), _text(new.get(n))) for n in names if old.get(n) != new.get(n))


def _text(value: object) -> str:
    return "(none)" if value is None else str(value)
