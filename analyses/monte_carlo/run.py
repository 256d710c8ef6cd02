"""A Monte Carlo study from a design to odds, distributions and worst cases."""

import functools
import hashlib
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.bounds import SAMPLES
from actuator_lti.design import write_design
from actuator_lti.design.access import varied
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design, Requirement
from actuator_lti.drive.operating import OperatingPoint
from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.loops import assemble_loops
from actuator_lti.start.extras import need
from actuator_lti.start.public_arguments import asked
from actuator_lti.types import Progress
from analyses.finite import finite
from analyses.linear.loop_figures import all_loop_figures
from analyses.monte_carlo import judging, result
from analyses.monte_carlo.judging import BLOCK, Reduction, Tally
from analyses.monte_carlo.task import CHUNK, SampleTask, StepCheck, Store
from analyses.monte_carlo.worst import worst_case
from analyses.slugs import slug
from analyses.specification.requirements import RequirementVerdict, judged_nominally, words_of
from analyses.studies.engine import Chunk, Engine
from analyses.studies.sampling import Table, sampler_of

KEPT = 1_000_000  # samples that are kept as Parquet, about 200 MB
PARTS = 1024  # of a study whose samples are not kept: what a part comes to is a few MB
NOTED_S = 30.0
SIZE = itemgetter(1)  # of a chunk: how many samples it has


@asked
@dataclass(frozen=True)
class MonteCarloSettings:
    """What a study is to do."""

    samples: int = 10_000
    seed: int = 0
    operating_point: OperatingPoint = "sliding"  # of the linear loops, as the load
    load_Nm: float = 0.0
    step: StepCheck | None = None  # a nonlinear step of every sample
    table: Table | None = None  # samples from an identification instead of tolerances
    worst_cases: bool = True  # look for the worst design of every requirement
    chunk: int = CHUNK  # samples a file

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
    design: AnyDesign,
    folder: str | Path,
    settings: MonteCarloSettings | None = None,
    *,
    engine: Engine | None = None,
    progress: Progress = None,
) -> result.MonteCarloResult:
    """Sample the tolerances of a design and judge its requirements.

    Up to `KEPT` samples, every one goes to ``folder`` as Parquet. Of more, only what they come to leaves the
    place where they are computed: memory, disk and traffic do not grow with their number. A study begun in
    the folder before (same design, seed, settings and code) goes on, with more samples if asked for, where
    they are kept. The numbers do not depend on engine, workers or chunks.

    ``engine``: where to compute; by default threads of this process.
    ``progress``: called with (samples done, samples to do), then with what is judged in the nominal design.

    Raises `InputError`: if nothing has a tolerance, or the folder holds another study.
    """
    need("pyarrow", "tables", "a Monte Carlo study")
    design, settings = as_design(design), settings or MonteCarloSettings()
    task = _task(design, settings)
    sampler = task.sampler
    store = Store.open(Path(folder), task.identity(), settings.chunk)
    engine = engine or Engine()
    if settings.samples <= KEPT:
        engine.map(task, store.missing(settings.samples), store.write, progress, SIZE)
        blocks = store.blocks(settings.samples)
        parts = (judging.reduced(task, block) for block in blocks)
        whole = functools.reduce(Reduction.merged, parts, Reduction())
    else:
        whole = _reduced(task, store, settings.samples, engine, progress)
    nominal = task.figures(sampler.nominal[None, :])
    tallies = list(zip(judging.judged(design), whole.tallies, strict=True))
    odds = [
        _odds(
            r.id, words_of(r, r.loop, design.load_unit), r.unit, tally, whole.count,
            minimum=r.minimum, maximum=r.maximum,
            nominal=float(judging.judge(r, design, nominal).value[0]), worst=tally.worst[0][2],
            worst_sample=tally.worst[0][1], columns=judging.source_columns(r, design),
            waiver=design.waiver_of(r.id),
        )
        for r, tally in tallies
    ]  # fmt: skip
    if tallies:
        odds.append(_odds("all", "all requirements together", "", whole.together, whole.count))
    units, left = task.units, _left_out(task, progress)
    return result.MonteCarloResult(
        design.name, task.identity()["design"], settings.samples, settings.seed, sampler.paths,
        {name: result.column_statistics(name, unit, whole.columns[name]) for name, unit in units.items()},
        tuple(odds), tuple(_worst_cases(task, tallies, Path(folder))) if settings.worst_cases else (),
        Path(folder), {name: float(values[0]) for name, values in nominal.items()}, left,
        notes=_notes(task, settings.samples), drivers=_drivers(task, odds), load_unit=design.load_unit,
        unstable=whole.unstable / whole.count, unresolved=whole.unresolved / whole.count,
    )  # fmt: skip


def _drivers(task: SampleTask, odds: Sequence[result.Odds]) -> tuple[result.Driver, ...]:
    """What each tolerance does alone to the figures that requirements look at, all others nominal."""
    factors, names = task.sampler.factors, list(dict.fromkeys(name for one in odds for name in one.columns))
    if not factors or not names:
        return ()
    rows = np.tile(task.sampler.nominal, (2 * len(factors), 1))
    for k, factor in enumerate(factors):
        rows[2 * k : 2 * k + 2, k] = factor.box
    figures = task.figures(rows)
    made = [
        result.Driver(name, factor.path, *factor.box, *map(finite, figures[name][2 * k : 2 * k + 2]))
        for name in names
        for k, factor in enumerate(factors)
    ]
    return tuple(sorted(made, key=lambda one: (names.index(one.column), -one.swing)))


def _odds(id: str, words: str, unit: str, tally: Tally, count: int, **more: Any) -> result.Odds:
    """What is not resolved counts as failed in the lower bound, as passed in the upper one."""
    passed, unresolved = tally.passed, tally.unresolved
    low, high = (result.clopper_pearson(n, count)[k] for k, n in enumerate((passed, passed + unresolved)))
    more["unresolved"] = unresolved
    return result.Odds(id, words, unit, passed, count, passed / count, low, high, **more)


def _reduced(task: SampleTask, store: Store, samples: int, engine: Engine, progress: Progress) -> Reduction:
    """Reduce the samples where they are computed; what is done is noted every `NOTED_S` and at the end."""
    path = store.folder / f"reduced-{samples}.json.zlib"
    whole, done = judging.unpacked(path.read_bytes()) if path.is_file() else (Reduction(), [])
    noted = time.monotonic()

    def take(chunk: Chunk, part: Reduction) -> None:
        nonlocal whole, noted
        whole = whole.merged(part)
        done.append(chunk)
        if time.monotonic() - noted > NOTED_S:
            store.put(path, whole.packed(done))
            noted = time.monotonic()

    part = max(BLOCK, BLOCK * -(-samples // (PARTS * BLOCK)))
    parts = [(first, min(part, samples - first)) for first in range(0, samples, part)]
    known = set(done)
    try:
        engine.map(judging.Reducing(task), [one for one in parts if one not in known], take, progress, SIZE)
    finally:
        if done:
            store.put(path, whole.packed(done))
    return whole


def _worst_cases(
    task: SampleTask, tallies: Sequence[tuple[Requirement, Tally]], folder: Path
) -> Iterator[result.WorstCase]:
    """The worst case of each requirement, with a design file of it."""
    design = task.design
    for place, (requirement, tally) in enumerate(tallies, 1):
        samples = np.array([sample for _, sample, _ in tally.worst])
        case = worst_case(task.of(requirement), requirement, samples)
        name = f"worst-{place:02d}-{slug(requirement.id)}"
        title = f"{design.title or design.name}: worst case for {requirement.id}"
        changed = varied(design, case.parameters)
        titled = replace(changed, name=f"{slug(design.name)}-{name}", title=title)
        path = folder / f"{name}.toml"
        write_bytes(path, write_design(titled).encode())
        yield replace(case, file=path)


def _notes(task: SampleTask, samples: int) -> tuple[str, ...]:
    normal = any(f.tolerance.kind != "uniform" for f in task.sampler.factors)
    correlated = not np.array_equal(task.sampler.correlation, np.eye(len(task.sampler.factors)))
    notes = {
        "Scrambled Sobol points: each bound is that of independent samples (Clopper and Pearson, one-sided, "
        "95 % confidence), which is on the safe side.": True,
        "The tolerance box of a normal distribution ends at 3 standard deviations or its bounds.": normal,
        "Worst cases of correlated parameters are sought in their ellipsoid, tied ones together.": correlated,
        f"More than {KEPT} samples: they are not kept. Quantiles are to one of up to {result.MOST} bins; any"
        " sample is made again by its number.": samples > KEPT,
    }
    return tuple(words for words, said in notes.items() if said)


def _left_out(task: SampleTask, progress: Progress) -> tuple[RequirementVerdict, ...]:
    """The requirements that figures of many designs do not tell, judged in the nominal design."""
    design = task.design
    left = [one for one in judging.by_loop(design) if not judging.in_populations(one, design)]
    if not left:
        return ()
    loops = assemble_loops(design, operating_point=task.operating_point, load_Nm=task.load_Nm)
    untold = "not sampled, it takes a computation of one design"
    return judged_nominally(design, left, all_loop_figures(loops), untold, progress)
