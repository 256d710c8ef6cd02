"""What a night looks like from its history: the rows of the index, and one design over the nights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from analyses.slugs import hashed
from reports.nightly.cache import Cache, Entry
from reports.nightly.changes import Between, Change, Comparison
from reports.nightly.figures import Verdict
from reports.nightly.history import History
from reports.nightly.memory import Memory
from reports.nightly.records import Baseline, Result, Run
from reports.nightly.source import BROKEN, Study
from reports.nightly.trend import WINDOW, missing_nights

STRIP = 30
CLOSER = 1e-3  # of the limit; a smaller step of the distance is none
STATE_WORDS = {
    "broken": "no result",
    "fail": "failing",
    "unproven": "not proven",
    "regression": "regressed",
    "pass": "passing",
}


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
        return hashed(self.result.name)

    @property
    def broken(self) -> bool:
        """Whether there is no result tonight."""
        return self.result.status in BROKEN

    @property
    def why(self) -> str:
        """Why there is no result, or it does not pass, in one line."""
        return self.result.message.partition("\n")[0]

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
        """One of `STATE_WORDS`."""
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
        """Order of the index: no result first, then what fails, then the worst distance to a requirement."""
        worst = np.inf if self.result.worst is None else self.result.worst
        return (0.0 if self.broken else 1.0 if self.state == "fail" else 2.0, worst)


@dataclass(frozen=True, kw_only=True)
class Overview:
    """A whole night: its designs, the worst first."""

    study: str
    title: str
    site: Path  # on which it is published
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
    def counts(self) -> str:
        """How many designs are in each state, in words."""
        counted = ((self.count(state), words) for state, words in STATE_WORDS.items())
        return ", ".join(f"{count} {words}" for count, words in counted if count)

    @property
    def passed(self) -> bool:
        """Whether every design was built, meets its requirements and is as approved."""
        return all(d.state == "pass" for d in self.designs)


def report_folder(name: str, key: str) -> str:
    """Folder of a report below the site: by design, then by content."""
    return f"reports/{hashed(name)}/{key[:16]}"


def overview(
    history: History,
    cache: Cache,
    study: Study,
    metas: Mapping[str, Mapping[str, Any]],
    site: Path,
) -> Overview:
    """Put together what the site says about the last finished night."""
    runs = history.runs
    run = runs[-1]
    reader = _Reader(history, cache, study, metas)
    tonight = history.night(run.id).by_name
    designs = sorted((reader.design(r) for r in tonight.values()), key=lambda d: d.rank)
    before = history.night(runs[-2].id).by_name if len(runs) > 1 else {}
    return Overview(
        study=study.name,
        title=study.title or study.name,
        site=site,
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
    """Reads what belongs to each design."""

    def __init__(self, history: History, cache: Cache, study: Study, metas: Mapping[str, Any]) -> None:
        self.history = history
        self.cache = cache
        self.metas = metas
        self.between = Between(history, study.tolerances, study.origin)

    def design(self, result: Result) -> DesignView:
        past = self.history.results(result.name, last=2 * STRIP)
        approval = self._approval(result.name)
        return DesignView(
            result=result,
            meta=self._meta(result),
            last_night=self.between.last_night(result, past),
            baseline=self.between.baseline(result, approval),
            approval=approval,
            strip=self._strip(past),
            status_flaps=sum(a.status != b.status for a, b in pairwise(past[-WINDOW:])) >= 3,
        )

    def _meta(self, result: Result) -> Mapping[str, Any]:
        known = self.metas.get(result.key) or (result.key and self.cache.whole(result.key))
        return known.meta if isinstance(known, Entry) else known or {}

    def _strip(self, past: list[Result]) -> tuple[tuple[Run, str], ...]:
        known = {r.run: outcome(r, before) for r, before in zip(past, [None, *past], strict=False)}
        return tuple((run, known.get(run.id, "absent")) for run in self.history.runs[-STRIP:])

    def _approval(self, name: str) -> Baseline | None:
        nights = {run.id for run in self.history.runs}
        own = (one for one in self.history.index.baselines[::-1] if one.name in (None, name))
        return next((one for one in own if one.run in nights and self.history.result(one.run, name)), None)


def outcome(result: Result, before: Result | None) -> str:
    """Give the state of a night; it regressed where its nearest limit came closer than the night before."""
    if result.status != "pass" or before is None or result.worst is None or before.worst is None:
        return result.status
    return "regressed" if result.worst < before.worst - CLOSER else "pass"
