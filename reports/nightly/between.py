"""What lies between two nights: changes since the last one and since the baseline, and their cause."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from reports.nightly.changes import Change, Columns, Comparison, cause_of
from reports.nightly.code_version import commits_between
from reports.nightly.history import History
from reports.nightly.records import Baseline, Result, Run
from reports.nightly.tolerance import Tolerances
from reports.nightly.trend import WINDOW, flaps

SHOWN_CHANGES = 100
_CODE = Path(__file__).resolve().parents[2]


class Between:
    """Compares nights of a history; ``origin`` is the study's file, whose commits are told."""

    def __init__(self, history: History, tolerances: Tolerances, origin: Path | None) -> None:
        self.history = history
        self.tolerances = tolerances
        self.origin = origin
        self._columns: dict[tuple[int, int], Columns] = {}

    def last_night(self, result: Result, past: list[Result]) -> Comparison:
        """What changed since the last night that has a result."""
        earlier = [r for r in past if r.run < result.run]
        good = [r for r in earlier if r.home is not None]
        if not good:
            return Comparison(
                note="no earlier night has a result" if earlier else "first night of this design"
            )
        skipped = sum(good[-1].run < run.id < result.run for run in self.history.runs)
        note = f"{skipped} night(s) without a result before; compared with the last that has one"
        found = self._compare(good[-1], result, note if skipped else "")
        return replace(found, changes=self._flapping(found.changes, past))

    def baseline(self, result: Result, approval: Baseline | None) -> Comparison:
        """What changed since the approved night, else since the first that has a result."""
        nights = (run.id for run in self.history.runs) if approval is None else (approval.run,)
        first = next(filter(None, (self.history.result(night, result.name) for night in nights)), None)
        if first is None:
            return Comparison(note="no baseline: no night has a result")
        if approval is not None:
            return self._compare(first, result, "")
        if first.run == result.run:
            note = "this is the first night: nothing to compare with"
            return Comparison(run=self.history.runs[-1], note=note)
        return self._compare(
            first, result, "nobody has approved a baseline yet: compared with the first night"
        )

    def _compare(self, old: Result, new: Result, note: str) -> Comparison:
        runs = {run.id: run for run in self.history.runs}
        before, after = runs[old.run], runs[new.run]
        if new.home is None:
            return Comparison(run=before, note=note or "no result tonight")
        if new.home == old.home:
            return Comparison(run=before, note=note)
        columns = self._columns_of(old, new)
        inputs = (self.history.inputs(old), self.history.inputs(new))
        cause = cause_of(before, after, inputs, self._commits(before, after))
        changes = columns.compare(*self.history.matrix((old, new), columns.names))
        return Comparison(run=before, changes=changes, cause=cause, note=note)

    def _columns_of(self, old: Result, new: Result) -> Columns:
        """The figures of two results, each as the new one declares it where both have it."""
        before, after = (self.history.numbers(result)[0] for result in (old, new))
        key = (id(before), id(after))  # the history keeps them
        if key not in self._columns:
            known = {figure.name: figure for figure in (*before, *after)}
            self._columns[key] = Columns(list(known.values()), self.tolerances)
        return self._columns[key]

    def _flapping(self, changes: tuple[Change, ...], past: list[Result]) -> tuple[Change, ...]:
        """Mark those of the changes that a page shows that go to and fro."""
        shown = changes[:SHOWN_CHANGES]
        if not shown or len(past) < 4:
            return changes
        values = self.history.matrix(past[-WINDOW:], [c.figure for c in shown])
        to_and_fro = {
            c.figure for c, column in zip(shown, values.T, strict=True) if flaps(column, c.tolerance)
        }
        return tuple(replace(c, flapping=True) if c.figure in to_and_fro else c for c in changes)

    def _commits(self, old: Run, new: Run) -> tuple[tuple[str, str], ...]:
        """First lines of the commits between two nights, each with where: those of the code, of the study."""
        places = {"code": (_CODE, old.code_commit, new.code_commit)}
        own = (old.study_commit, new.study_commit)
        if self.origin is not None and own != places["code"][1:]:
            places["study"] = (self.origin, *own)
        return tuple((where, line) for where, each in places.items() for line in commits_between(*each))
