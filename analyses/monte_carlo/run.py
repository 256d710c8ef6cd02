"""A Monte Carlo study from a design to odds, distributions and worst cases."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.atomic import write_bytes
from actuator_lti.batch.parameters import OperatingPoint
from actuator_lti.bounds import SAMPLES
from actuator_lti.design import with_values, write_design
from actuator_lti.errors import InputError
from actuator_lti.extras import need
from actuator_lti.quantities import QUANTITIES
from actuator_lti.verdict import Verdict
from analyses.engine import Engine
from analyses.monte_carlo.judging import in_populations, judge, label, source_columns
from analyses.monte_carlo.result import MonteCarloResult, Odds, WorstCase
from analyses.monte_carlo.statistics import clopper_pearson, column_statistics
from analyses.monte_carlo.stepping import StepCheck
from analyses.monte_carlo.store import CHUNK, Store
from analyses.monte_carlo.task import SampleTask
from analyses.monte_carlo.worst import worst_case
from analyses.sampling import Table, sampler_of
from analyses.verdicts import RequirementVerdict

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, Requirement

Progress = Callable[[int, int], None]
_WORST_KEPT = 8


@dataclass(frozen=True)
class MonteCarloSettings:
    """What a study is to do.

    Attributes
    ----------
    samples, seed : int
    operating_point, load_Nm
        Of the linear loops.
    step : StepCheck or None
        A nonlinear step of every sample.
    table : Table or None
        Samples from an identification instead of tolerances.
    worst_cases : bool
        Look for the worst design of every requirement.
    chunk : int
        Samples a file.
    """

    samples: int = 10_000
    seed: int = 0
    operating_point: OperatingPoint = "sliding"
    load_Nm: float = 0.0
    step: StepCheck | None = None
    table: Table | None = None
    worst_cases: bool = True
    chunk: int = CHUNK

    def __post_init__(self) -> None:
        SAMPLES.check(self.samples)
        if self.samples < 1:
            raise InputError(f"samples = {self.samples}: at least 1")
        if self.seed < 0:
            raise InputError(f"seed = {self.seed}: 0 or more")
        if not 1 <= self.chunk <= 1_000_000:
            raise InputError(f"chunk = {self.chunk}: from 1 to 1000000")


def sample_folder(design: Design, settings: MonteCarloSettings, folder: Path) -> Path:
    """Folder of a study inside another: the same study always gets the same one, another never."""

    identity = _task(design, settings).identity()
    digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
    return folder / f"samples-{digest[:12]}"


def _task(design: Design, settings: MonteCarloSettings) -> SampleTask:
    sampler = sampler_of(design, seed=settings.seed, table=settings.table)
    return SampleTask(design, sampler, settings.operating_point, settings.load_Nm, step=settings.step)


def monte_carlo(
    design: Design,
    folder: str | Path,
    settings: MonteCarloSettings | None = None,
    *,
    engine: Engine | None = None,
    progress: Progress | None = None,
) -> MonteCarloResult:
    """Sample the tolerances of a design and judge its requirements.

    Every sample goes to ``folder`` as Parquet; a study begun there before (same design, seed, settings and
    code) goes on, with more samples if asked for. The numbers do not depend on engine, workers or chunks.

    Parameters
    ----------
    design : Design
        With tolerances on some values.
    folder : path
    settings : MonteCarloSettings, optional
    engine : Engine, optional
        Where to compute; by default threads of this process.
    progress : callable, optional
        Called with (samples done, samples to do).

    Raises
    ------
    InputError
        If nothing has a tolerance, or the folder holds another study.
    """
    need("pyarrow", "tables", "a Monte Carlo study")
    settings = settings or MonteCarloSettings()
    task = _task(design, settings)
    sampler = task.sampler
    store = Store.open(Path(folder), task.identity(), settings.chunk)
    (engine or Engine()).run(task, store.missing(settings.samples), store.write, progress)

    def blocks() -> Iterator[Mapping[str, np.ndarray]]:
        return store.blocks(settings.samples)

    tallies = [_Tally(r) for r in design.requirements if in_populations(r, design)]
    together = 0
    for block in blocks():
        passed = np.ones(len(block["sample"]), dtype=bool)
        for tally in tallies:
            passed &= tally.add(design, block)
        together += int(passed.sum())
    nominal = task.figures(sampler.nominal[None, :])
    odds = [tally.odds(design, nominal) for tally in tallies]
    if tallies:
        odds.append(_odds("all", "all requirements together", "", together, settings.samples))
    worst = _worst_cases(task, tallies, Path(folder)) if settings.worst_cases else ()
    return MonteCarloResult(
        design.name, task.identity()["design"], settings.samples, settings.seed, sampler.paths,
        column_statistics(blocks, task.units), tuple(odds), worst, Path(folder),
        {name: float(values[0]) for name, values in nominal.items()}, _left_out(design), notes=_notes(task),
    )  # fmt: skip


def _odds(id: str, words: str, unit: str, passed: int, count: int) -> Odds:
    low, high = clopper_pearson(passed, count)
    return Odds(id, words, unit, passed, count, passed / count, low, high)


@dataclass
class _Tally:
    """Passes and the worst samples of one requirement, block by block."""

    requirement: Requirement
    passed: int = 0
    count: int = 0
    worst: list[tuple[float, int, float]] = field(default_factory=list)  # distance, sample, value

    def add(self, design: Design, block: Mapping[str, np.ndarray]) -> np.ndarray:
        judged = judge(self.requirement, design, block)
        self.passed += int(judged.passed.sum())
        self.count += len(judged.passed)
        order = np.argsort(judged.distance, kind="stable")[:_WORST_KEPT]
        result = [(float(judged.distance[k]), int(block["sample"][k]), float(judged.value[k])) for k in order]
        self.worst = sorted(self.worst + result)[:_WORST_KEPT]
        return judged.passed

    def odds(self, design: Design, nominal: Mapping[str, np.ndarray]) -> Odds:
        r = self.requirement
        made = _odds(r.id, label(r), r.unit, self.passed, self.count)
        _, sample, value = self.worst[0]
        here = float(judge(r, design, nominal).value[0])
        return replace(
            made, minimum=r.minimum, maximum=r.maximum, nominal=here, worst=value, worst_sample=sample,
            columns=source_columns(r, design),
        )  # fmt: skip


def _worst_cases(task: SampleTask, tallies: list[_Tally], folder: Path) -> tuple[WorstCase, ...]:
    from analyses.slugs import slug

    result = []
    for place, tally in enumerate(tallies):
        timed = QUANTITIES[tally.requirement.quantity].timed
        quick = replace(task, step=None, time_figures=timed)
        case = worst_case(quick, tally.requirement, np.array([sample for _, sample, _ in tally.worst]))
        name = f"worst-{place + 1:02d}-{slug(tally.requirement.id)}"
        changed = with_values(task.design, case.parameters, check=False)
        titled = replace(
            changed,
            name=f"{slug(task.design.name)}-{name}",
            title=f"{task.design.title or task.design.name}: worst case for {tally.requirement.id}",
        )
        path = folder / f"{name}.toml"
        write_bytes(path, write_design(titled).encode())
        result.append(replace(case, file=path))
    return tuple(result)


def _notes(task: SampleTask) -> tuple[str, ...]:
    notes = [
        "Scrambled Sobol points: intervals are those of independent samples (Clopper and Pearson, 95 %), "
        "which is on the safe side.",
    ]
    if any(f.tolerance.kind != "uniform" for f in task.sampler.factors):
        notes.append(
            "The tolerance box of a normal distribution ends at 3 standard deviations or its bounds."
        )
    if len(task.sampler.correlation) and not np.array_equal(
        task.sampler.correlation, np.eye(len(task.sampler.correlation))
    ):
        notes.append(
            "Worst cases of correlated parameters are sought in their ellipsoid, tied ones together."
        )
    return tuple(notes)


def _left_out(design: Design) -> tuple[RequirementVerdict, ...]:
    """The requirements that figures of many designs do not tell: not proven."""
    return tuple(
        RequirementVerdict(
            id=r.id, requirement=r, loop=None, value=None, distance=None, verdict=Verdict.NOT_PROVEN,
            reason="not sampled, it takes a computation of one design", waiver=design.waiver_of(r.id),
        )
        for r in design.requirements
        if not in_populations(r, design)
    )  # fmt: skip
