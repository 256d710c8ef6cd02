"""Nightly: years of history on disk and on a page; a study of 41 variants built once, and again."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from benchmarks.row import Row
from reports.nightly.cache import Cache
from reports.nightly.figures import Figure
from reports.nightly.history import History, Reported, open_history
from reports.nightly.moves import change_points
from reports.nightly.night import Settings, run_night
from reports.nightly.pages import design_page, index
from reports.nightly.records import Result
from reports.nightly.source import Study, read_study
from reports.nightly.view import overview

DESIGNS, FIGURES, NIGHTS, PAGES = 100, 200, 365, 10
STUDY = """
[study]
name = "bench"
base = "ilr33-amber"
validation = true

[[grid]]
axes = [
  { parameter = "gear.worm.ratio", from = 25, to = 50, points = %d },
  { parameter = "control.velocity.gain", from = "0.08 A*s/rad", to = "0.2 A*s/rad", points = %d },
]
"""


def rows(quick: bool = False) -> Iterable[Row]:
    """Measure; the first run of 41 variants takes a minute, ``quick`` measures ten of them."""
    with tempfile.TemporaryDirectory() as folder:
        yield from history_rows(Path(folder), 100 if quick else NIGHTS)
    with tempfile.TemporaryDirectory() as folder:
        yield from study_rows(Path(folder), (3, 3) if quick else (8, 5))


def history_rows(folder: Path, nights: int) -> Iterator[Row]:
    """Every figure of every design moves every night: the worst that a history can be asked to keep."""
    history = open_history(folder)
    fill(history, nights)
    size = sum(p.stat().st_size for p in folder.rglob("*.json")) / 1e6
    what = f"{DESIGNS} designs, {FIGURES} figures, {nights} nights, all moving"
    yield Row(f"history on disk: {what}", size, "MB", 0.3 * nights)
    study = Study(name="bench", jobs=())
    change_points(np.arange(10.0), 0.1)  # imports what it needs
    history = open_history(folder)
    start = time.process_time()
    night = overview(history, Cache(folder / "cache"), study, folder)
    text = index(night, "nights/x")
    yield Row("index page from it", time.process_time() - start, "s", 0.5, note="processor time")
    start = time.process_time()
    for design in night.designs[:PAGES]:
        text += design_page(night, design, history, set())
    taken = (time.process_time() - start) / PAGES
    note = f"processor time, mean of {PAGES} pages; the first reads every night"
    yield Row("page of a design from it", taken, "s", 0.5, note=note)


def fill(history: History, nights: int) -> None:
    """Write such a history as a nightly does."""
    rng = np.random.default_rng(0)
    names = [f"section / table / row {k // 4} / margin {k % 4}" for k in range(FIGURES)]
    for night in range(nights):
        started = (datetime(2026, 1, 1) + timedelta(days=night)).strftime("%Y-%m-%dT02:00:00Z")
        run = history.start_run(
            started=started, code=f"{night}", code_commit=f"{night:040x}", study_commit="",
            libraries={"numpy": "2"}, host="bench",
        )  # fmt: skip
        history.finish_run(run, started, [result(k, run.id, names, rng) for k in range(DESIGNS)])


def result(design: int, run: int, names: list[str], rng: np.random.Generator) -> tuple[Result, Reported]:
    """One design in one night."""
    values = (10.0 + rng.standard_normal(len(names))).tolist()
    figures = [Figure(name=n, value=v, unit="dB", better=1) for n, v in zip(names, values, strict=True)]
    made = Result(
        run=run, name=f"design {design}", kind="design", status="pass", key=f"{design}-{run}", total=12,
        worst=0.1, worst_id="GM",
    )  # fmt: skip
    return made, (figures, {"parameters": {"control.position.gain": f"{run} 1/s"}})


def study_rows(folder: Path, points: tuple[int, int]) -> Iterator[Row]:
    """Build a study with reports and validations, then build it again unchanged."""
    count = points[0] * points[1] + 1
    path = folder / "study.toml"
    path.write_text(STUDY % points)
    times, spent = [], []
    for _ in range(2):
        start, before = time.perf_counter(), processor_s()
        night = run_night(read_study(str(path)), folder / "site", Settings(workers=2))
        times.append(time.perf_counter() - start)
        spent.append(processor_s() - before)
    broken = night.count("broken")
    note = f"{broken} without result" if broken else "reports, validations and their comparison"
    name = f"{count} variants on 2 workers"
    yield Row(f"{name}, first run", times[0], "s", 3.0 * count, note=note)
    note = "300 s on two free cores for 100 variants"
    yield Row(f"{name}, first run, processor time of all processes", spent[0], "s", 6.0 * count, note=note)
    yield Row(f"{name}, second run, unchanged", times[1], "s", 5.0)


def processor_s() -> float:
    """Processor time of this process and of those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)
