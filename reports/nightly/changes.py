"""What changed between two results of a design, how much it matters, and what is behind it."""

from __future__ import annotations

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
        pairs = [tolerances.pair(figure) for figure in figures]
        self.absolute, self.relative = np.array(pairs).reshape(-1, 2).T
        self.better = np.array([figure.better for figure in figures])
        self.verdict = np.array([figure.kind == "verdict" for figure in figures], dtype=bool)
        self.names = [figure.name for figure in figures]
        self.order = np.empty(len(figures), dtype=int)
        self.order[np.argsort(np.array(self.names), kind="stable")] = np.arange(len(figures))

    def compare(self, before: np.ndarray, after: np.ndarray) -> tuple[Change, ...]:
        """List every figure that moved beyond its tolerance, appeared or vanished; the worst first.

        Parameters
        ----------
        before, after : ndarray, shape (figures,)
            NaN where a result has no such value.
        """
        old, new = np.isfinite(before), np.isfinite(after)
        size = np.fmax(np.abs(before), np.abs(after))
        tolerance = np.where(self.verdict, 0.5, np.maximum(self.absolute, self.relative * size))
        delta = after - before
        moved = np.flatnonzero((old | new) & ~(np.abs(delta) <= tolerance))
        larger = np.where(np.abs(self.better) == 2, np.abs(after) - np.abs(before), delta)
        worse = np.where(old & new, larger * self.better < 0.0, False)
        worse = np.where(self.verdict, (after == 0.0) | (~new & (before == 1.0)), worse)
        known = self.verdict | (old & new & (self.better != 0))
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.nan_to_num(np.abs(delta) / tolerance, nan=np.inf, posinf=np.inf)
        keys = (self.order[moved], -far[moved], ~self.verdict[moved], ~(worse & known)[moved])
        rows = (before.tolist(), after.tolist(), tolerance.tolist(), worse.tolist(), known.tolist())
        return tuple(self._change(k, *rows) for k in moved[np.lexsort(keys)].tolist())

    def _change(
        self, k: int, before: list[float], after: list[float], tolerance: list[float], worse: list[bool],
        known: list[bool],
    ) -> Change:  # fmt: skip
        figure, old, new = self.figures[k], before[k], after[k]
        return Change(
            figure=figure.name, unit=figure.unit, kind=figure.kind, before=None if old != old else old,
            after=None if new != new else new, tolerance=tolerance[k], worse=worse[k] if known[k] else None,
        )  # fmt: skip


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
