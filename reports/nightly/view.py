"""What a night looks like from its history: the rows of the index, and one design over the nights."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from analyses.slugs import hashed
from reports.nightly.cache import Cache
from reports.nightly.changes import Between, Comparison
from reports.nightly.history import History
from reports.nightly.moves import WINDOW, missing_nights
from reports.nightly.records import Baseline, Result, Run
from reports.nightly.source import Study
from reports.nightly.state import Memory
from reports.nightly.text import one_line

BROKEN = ("error", "timeout", "crash")  # how a job ends without a result
STRIP = 30
CLOSER = 1e-3  # of the limit; a smaller step of the distance is none
STATES = {
    "broken": ("⚠", "no result"),
    "fail": ("✗", "failing"),
    "unproven": ("?", "not proven"),
    "regression": ("▼", "regressed"),
    "pass": ("✓", "passing"),
}
"""Sign and words of the states of a design."""


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
        return self.result.name

    @property
    def slug(self) -> str:
        return hashed(self.result.name)

    @property
    def broken(self) -> bool:
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

    @property
    def verdicts(self) -> list[Tree]:
        return list(self.meta.get("verdicts", ()))

    @property
    def state(self) -> str:
        if self.broken:
            return "broken"
        if self.result.status != "pass":
            return self.result.status
        return "regression" if self.baseline.regressions else "pass"

    @property
    def held_against(self) -> str:
        """The night whose figures it may not be worse than, in words."""
        return "the approved baseline" if self.approval else "the first night, as none is approved"

    @property
    def report(self) -> str:
        return report_folder(self.result)

    @property
    def rank(self) -> tuple[float, ...]:
        """Order of the index: no result first, then what fails, then the worst distance to a requirement."""
        lost = -np.inf if self.result.worst_id else np.inf  # not met without a figure; no requirement
        worst = lost if self.result.worst is None else self.result.worst
        return (0.0 if self.broken else 1.0 if self.state == "fail" else 2.0, worst)


@dataclass(frozen=True, kw_only=True)
class Overview:
    """A whole night: its designs, the worst first."""

    study: Study
    title: str
    site: Path  # on which it is published
    designs: tuple[DesignView, ...]
    runs: tuple[Run, ...]
    gone: tuple[str, ...]
    missing: tuple[tuple[int, int], ...]
    interrupted: tuple[str, ...]
    memory: Memory

    @property
    def run(self) -> Run:
        return self.runs[-1]

    @property
    def alone(self) -> tuple[DesignView, ...]:
        """The designs and variants, without the page of the whole study."""
        return tuple(d for d in self.designs if d.result.kind == "design")

    def count(self, state: str) -> int:
        return sum(d.state == state for d in self.alone)

    @property
    def left_out(self) -> str:
        """Say which designs of last night are not in the study tonight; empty where all are."""
        more = len(self.gone) - 20
        named = ", ".join(one_line(name, 80) for name in self.gone[:20]) + f" and {more} more" * (more > 0)
        return f"In the study last night, not tonight: {named}" * bool(self.gone)

    @property
    def counts(self) -> str:
        counted = ((self.count(state), words) for state, (_, words) in STATES.items())
        apart = (d for d in self.designs if d not in self.alone and d.state != "pass")
        said = ", ".join(f"{count} {words}" for count, words in counted if count)
        return "; ".join([said, *(f"{one.name}: {STATES[one.state][1]}" for one in apart)])

    @property
    def said_of_all(self) -> str:
        """What it says that all designs pass: of requirements that are stated, of a night to compare with."""
        parts = [f"All {len(self.alone)} designs are built"]
        stated = any(one.result.total for one in self.alone)
        parts += ["meet their requirements"] * stated
        before = [d for d in self.alone if d.baseline.run and d.baseline.run.id < self.run.id]
        against = " or ".join(sorted({one.held_against for one in before}))
        parts += [f"are no worse than {against}"] * bool(before)
        words = " and ".join([", ".join(parts[:-1]), parts[-1]] if parts[1:] else parts)
        return words if stated else f"{words}; no requirement is stated"

    @property
    def passed(self) -> bool:
        """Whether every design was built, meets its requirements and is as approved."""
        return all(d.state == "pass" for d in self.designs)


def report_folder(result: Result) -> str:
    """Folder of a report below the site: by design, then by content."""
    return f"reports/{hashed(result.name)}/{result.key[:16]}"


def vanished(name: str, site: Path) -> InputError:
    return InputError(f"the result of {name[:60]!r} has vanished from the cache: run again", where=str(site))


def overview(history: History, cache: Cache, study: Study, site: Path, *, built: bool = False) -> Overview:
    """Put together what the site says about the last finished night; what was ``built`` just now is there."""
    runs = history.runs
    between = Between(history, study.tolerances, study.origin)
    tonight = history.night(runs[-1].id).by_name
    designs = [_design(result, between, cache) for result in tonight.values()]
    for one in designs:
        if built and one.result.key and not one.meta:
            raise vanished(one.name, site)
    before = history.night(runs[-2].id).by_name if len(runs) > 1 else {}
    return Overview(
        study=study, title=study.title or study.name, site=site,
        designs=tuple(sorted(designs, key=lambda design: design.rank)), runs=tuple(runs),
        gone=tuple(sorted(before.keys() - tonight.keys())),
        missing=missing_nights([run.started for run in runs]), interrupted=tuple(history.index.interrupted),
        memory=history.memory(),
    )  # fmt: skip


def _design(result: Result, between: Between, cache: Cache) -> DesignView:
    history = between.history
    past = history.results(result.name, last=STRIP + 1)  # the first only to tell whether the next regressed
    runs, known = {run.id: run for run in history.runs}, outcomes(past)
    own = (one for one in history.index.baselines[::-1] if one.name in (None, result.name))
    there = (one for one in own if one.run in runs and history.first(result.name, [runs[one.run]]))
    approval = next(there, None)
    entry = cache.whole(result.key) if result.key else None
    return DesignView(
        result=result, meta=entry.meta if entry else {}, last_night=between.last_night(result, past),
        baseline=between.baseline(result, approval), approval=approval,
        strip=tuple((run, known.get(run.id, "absent")) for run in history.runs[-STRIP:]),
        status_flaps=sum(a.status != b.status for a, b in pairwise(past[-WINDOW:])) >= 3,
    )  # fmt: skip


def outcomes(past: list[Result]) -> dict[int, str]:
    """Give the state of each night; regressed: its nearest limit is closer than the night before."""
    states = {}
    for before, result in zip([None, *past], past, strict=False):
        was, now = None if before is None else before.worst, result.worst
        closer = was is not None and now is not None and now < was - CLOSER
        states[result.run] = "regressed" if closer and result.status == "pass" else result.status
    return states
