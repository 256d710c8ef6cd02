"""What a night looks like from its history: the rows of the index, and one design over the nights."""

from __future__ import annotations

import itertools
from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.nightly.cache import Cache, CorruptEntry
from reports.nightly.changes import Cause, Change, Columns, Comparison, cause_of
from reports.nightly.code_version import commits_between
from reports.nightly.figures import Figure, Verdict
from reports.nightly.history import History
from reports.nightly.job import BROKEN
from reports.nightly.memory import Memory
from reports.nightly.records import Baseline, Result, Run
from reports.nightly.text import slug
from reports.nightly.trend import WINDOW, flaps, may_flap, missing_nights

if TYPE_CHECKING:
    from reports.nightly.night import Study

STRIP = 30
CLOSER = 1e-3  # of the limit; a smaller step of the distance is none
SHOWN_CHANGES = 100


@dataclass(frozen=True, kw_only=True)
class DesignView:
    """One design tonight: its result, what changed, and how it came out over the last nights."""

    result: Result
    meta: Mapping[str, Any]
    last_night: Comparison
    baseline: Comparison
    approval: Baseline | None
    strip: tuple[tuple[Run, str], ...]
    status_flaps: bool

    @property
    def name(self) -> str:
        """Name as in the study."""
        return self.result.name

    @property
    def slug(self) -> str:
        """Name as a file."""
        return slug(self.result.name)

    @property
    def broken(self) -> bool:
        """Whether there is no result tonight."""
        return self.result.status in BROKEN

    @property
    def title(self) -> str:
        """Title that the report gives itself; empty where it says no more than the name."""
        title = str(self.meta.get("title", ""))
        return "" if title == self.name else title

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Requirements of tonight's report."""
        return tuple(Verdict(**v) for v in self.meta.get("verdicts", ()))

    @property
    def regressions(self) -> tuple[Change, ...]:
        """Changes for the worse that nobody has approved."""
        return self.baseline.regressions

    @property
    def state(self) -> str:
        """``broken``, ``fail``, ``unproven``, ``regression`` or ``pass``."""
        if self.broken:
            return "broken"
        if self.result.status != "pass":
            return self.result.status
        return "regression" if self.regressions else "pass"

    @property
    def report(self) -> str:
        """Folder of its report on the site."""
        return report_folder(self.name, self.result.key)

    @property
    def rank(self) -> tuple[float, ...]:
        """Order of the index: no result first, then the worst distance to a requirement."""
        worst = np.inf if self.result.worst is None else self.result.worst
        return (0.0 if self.broken else 1.0, worst)


@dataclass(frozen=True, kw_only=True)
class Overview:
    """A whole night: its designs, the worst first."""

    study: str
    title: str
    run: Run
    designs: tuple[DesignView, ...]
    runs: tuple[Run, ...]
    gone: tuple[str, ...]
    missing: tuple[tuple[int, int], ...]
    interrupted: tuple[str, ...]
    tolerances: Any
    memory: Memory

    @property
    def alone(self) -> tuple[DesignView, ...]:
        """The designs and variants, without the page of the whole study."""
        return tuple(d for d in self.designs if d.result.kind == "design")

    def count(self, state: str) -> int:
        """How many designs are in a state (see `DesignView.state`)."""
        return sum(d.state == state for d in self.alone)

    @property
    def exit_status(self) -> int:
        """0 where every design was built, meets its requirements and is as approved; else 1."""
        return 0 if all(d.state == "pass" for d in self.designs) else 1


def report_folder(name: str, key: str) -> str:
    """Folder of a report below the site: by design, then by content."""
    return f"reports/{slug(name)}/{key[:16]}"


def overview(
    history: History, cache: Cache, study: Study, metas: Mapping[str, Mapping[str, Any]] | None = None
) -> Overview:
    """Put together what the site says about the last finished night."""
    runs = history.runs
    run = runs[-1]
    reader = _Reader(history, cache, study, metas or {})
    tonight = history.night(run.id).by_name
    designs = sorted((reader.design(r) for r in tonight.values()), key=lambda d: d.rank)
    before = history.night(runs[-2].id).by_name if len(runs) > 1 else {}
    return Overview(
        study=study.name,
        title=study.title or study.name,
        run=run,
        designs=tuple(designs),
        runs=tuple(runs),
        gone=tuple(sorted(before.keys() - tonight.keys())),
        missing=missing_nights([r.started for r in runs]),
        interrupted=tuple(history.index.interrupted),
        tolerances=study.tolerances,
        memory=history.memory(),
    )


class _Reader:
    """Reads what belongs to each design, and what lies between two nights once."""

    def __init__(self, history: History, cache: Cache, study: Study, metas: Mapping[str, Any]) -> None:
        self.history = history
        self.cache = cache
        self.study = study
        self.metas = metas
        self.runs = {r.id: r for r in history.runs}
        self.last = history.runs[-1]
        self._nights = list(self.runs)
        self._commits: dict[tuple[int, int], tuple[tuple[str, str], ...]] = {}
        self._columns: dict[tuple[int, int], Columns] = {}

    def design(self, result: Result) -> DesignView:
        past = self.history.results(result.name, last=2 * STRIP)
        approval = self._approval(result.name)
        return DesignView(
            result=result,
            meta=self._meta(result),
            last_night=self._last_night(result, past),
            baseline=self._baseline(result, approval),
            approval=approval,
            strip=self._strip(past),
            status_flaps=_toggles([r.status for r in past[-WINDOW:]]) >= 3,
        )

    def _meta(self, result: Result) -> Mapping[str, Any]:
        if not result.key:
            return {}
        known: Mapping[str, Any] = self.metas.get(result.key, {})
        if known:
            return known
        try:
            entry = self.cache.read(result.key)
        except CorruptEntry:
            return {}
        return entry.meta if entry else {}

    def _strip(self, past: list[Result]) -> tuple[tuple[Run, str], ...]:
        known = {r.run: outcome(r, before) for r, before in zip(past, [None, *past], strict=False)}
        shown = list(self.runs.values())[-STRIP:]
        return tuple((run, known.get(run.id, "absent")) for run in shown)

    def _approval(self, name: str) -> Baseline | None:
        for baseline in reversed(self.history.index.baselines):
            if baseline.name in (None, name) and baseline.run in self.runs and self._good(baseline.run, name):
                return baseline
        return None

    def _good(self, run: int, name: str) -> Result | None:
        """The result of a design in a night, where it has one."""
        result = self.history.night(run).by_name.get(name)
        return result if result is not None and result.home is not None else None

    def _last_night(self, result: Result, past: list[Result]) -> Comparison:
        good = [r for r in past if r.home is not None and r.run < result.run]
        if not any(r.run < result.run for r in past):
            return Comparison(note="first night of this design")
        if not good:
            return Comparison(note="no earlier night has a result")
        skipped = bisect_left(self._nights, result.run) - bisect_right(self._nights, good[-1].run)
        note = (
            f"{skipped} night(s) without a result before; compared with the last that has one"
            if skipped
            else ""
        )
        found = self._compare(good[-1], result, note)
        return replace(found, changes=self._flapping(found.changes, past))

    def _baseline(self, result: Result, approval: Baseline | None) -> Comparison:
        if approval is not None:
            base = self.history.night(approval.run).by_name[result.name]
            return self._compare(base, result, "")
        first = next(filter(None, (self._good(run, result.name) for run in self._nights)), None)
        if first is None:
            return Comparison(note="no baseline: no night has a result")
        if first.run == result.run:
            return Comparison(run=self.last, note="this is the first night: nothing to compare with")
        note = "nobody has approved a baseline yet: compared with the first night"
        return self._compare(first, result, note)

    def _compare(self, old: Result, new: Result, note: str) -> Comparison:
        run = self.runs[old.run]
        if new.home is None:
            return Comparison(run=run, note=note or "no result tonight")
        if new.home == old.home:
            return Comparison(run=run, note=note)
        columns = self._columns_of(old, new)
        before, after = self.history.matrix((old, new), columns.names)
        inputs = (self.history.inputs(old), self.history.inputs(new))
        cause = cause_of(run, self.runs[new.run], inputs, self._commits_between(run, self.runs[new.run]))
        return Comparison(run=run, changes=columns.compare(before, after), cause=cause, note=note)

    def _columns_of(self, old: Result, new: Result) -> Columns:
        """The figures of two results, each as the new one declares it where both have it."""
        before, after = (self.history.numbers(result)[0] for result in (old, new))
        key = (id(before), id(after))  # the history keeps them
        if key not in self._columns:
            known = {figure.name: figure for figure in (*after, *before)} | {
                figure.name: figure for figure in after
            }
            self._columns[key] = Columns(list(known.values()), self.study.tolerances)
        return self._columns[key]

    def _flapping(self, changes: tuple[Change, ...], past: list[Result]) -> tuple[Change, ...]:
        """Mark those of the changes that a page shows that go to and fro."""
        shown = changes[:SHOWN_CHANGES]
        if not shown or len(past) < 4:
            return changes
        values = self.history.matrix(past[-WINDOW:], [c.figure for c in shown])
        maybe = may_flap(values, np.array([c.tolerance for c in shown]))
        to_and_fro = {c.figure for j, c in enumerate(shown) if maybe[j] and flaps(values[:, j], c.tolerance)}
        return tuple(replace(c, flapping=True) if c.figure in to_and_fro else c for c in changes)

    def _commits_between(self, old: Run, new: Run) -> tuple[tuple[str, str], ...]:
        key = (old.id, new.id)
        if key not in self._commits:
            code_root = Path(__file__).resolve().parents[2]
            result = [("code", line) for line in commits_between(code_root, old.code_commit, new.code_commit)]
            origin = self.study.origin
            if origin is not None and (old.study_commit, new.study_commit) != (
                old.code_commit,
                new.code_commit,
            ):
                result += [
                    ("study", line) for line in commits_between(origin, old.study_commit, new.study_commit)
                ]
            self._commits[key] = tuple(result)
        return self._commits[key]


def outcome(result: Result, before: Result | None) -> str:
    """Give the state of a night; it regressed where its nearest limit came closer than the night before."""
    if result.status != "pass" or before is None or result.worst is None or before.worst is None:
        return result.status
    return "regressed" if result.worst < before.worst - CLOSER else "pass"


def _toggles(statuses: list[str]) -> int:
    return sum(a != b for a, b in itertools.pairwise(statuses))


__all__ = ["Cause", "DesignView", "Figure", "Overview", "overview", "report_folder"]
