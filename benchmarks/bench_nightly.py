"""Nightly: years of history on disk and on a page; a study of 100 variants built once, and again."""

from __future__ import annotations

import resource
import tempfile
import time
import zlib
from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from benchmarks.row import Row
from reports.nightly.cache import Cache
from reports.nightly.figures import Figure
from reports.nightly.history import History, open_history, vector_sha
from reports.nightly.job import canonical
from reports.nightly.night import Settings, Study, run_night
from reports.nightly.pages import design_page, index
from reports.nightly.records import NewResult
from reports.nightly.source import read_study
from reports.nightly.text import sha256
from reports.nightly.trend import change_points
from reports.nightly.view import overview

GROUP = "nightly"
DESIGNS, FIGURES, NIGHTS = 100, 200, 1000
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
    """Measure; the first run of 100 variants takes minutes, ``quick`` measures nine of them."""
    with tempfile.TemporaryDirectory() as folder:
        yield from history_rows(Path(folder), 100 if quick else NIGHTS)
    with tempfile.TemporaryDirectory() as folder:
        yield from study_rows(Path(folder), (3, 3) if quick else (11, 9))


def history_rows(folder: Path, nights: int) -> Iterator[Row]:
    """Every figure of every design moves every night: the worst that a history can be asked to keep."""
    path = folder / "history.sqlite"
    with open_history(path) as history:
        fill(history, nights)
    size = sum(p.stat().st_size for p in folder.glob("history.sqlite*")) / 1e6
    what = f"{DESIGNS} designs, {FIGURES} figures, {nights} nights, all moving"
    yield Row(
        group=GROUP, name=f"history on disk: {what}", measured=size, unit="MB", target=300 * nights / NIGHTS
    )
    study = Study(name="bench", jobs=())
    change_points(np.arange(10.0), 0.1)  # imports what it needs
    with open_history(path) as history:
        start = time.process_time()
        night = overview(history, Cache(folder / "cache"), study)
        text = index(night, "nights/x")
        yield Row(
            group=GROUP,
            name="index page from it",
            measured=time.process_time() - start,
            unit="s",
            target=0.5,
            note="processor time",
        )
        start = time.process_time()
        text += design_page(night, night.designs[0], history, set())
        taken = time.process_time() - start
        yield Row(
            group=GROUP, name="page of a design from it", measured=taken, unit="s", target=0.5,
            note=f"processor time; {len(text) / 1e3:.0f} kB",
        )  # fmt: skip


def fill(history: History, nights: int) -> None:
    """Write such a history: the first and the last night as a nightly does, those between in bulk."""
    rng = np.random.default_rng(0)
    names = [f"section / table / row {k // 4} / margin {k % 4}" for k in range(FIGURES)]
    finish(history, 0, names, rng)
    between = range(1, nights - 1)
    runs = [(history.start_run(about(night)), night) for night in between]
    with history.connection as c:
        c.execute("BEGIN IMMEDIATE")
        for run, night in runs:
            in_bulk(history, run, night, rng)
        c.executemany(
            "UPDATE runs SET state = 'done', finished = started WHERE id = ?", [(run,) for run, _ in runs]
        )
    finish(history, nights - 1, names, rng)


def about(night: int) -> dict[str, object]:
    """What is known of a night as it begins."""
    started = (datetime(2026, 1, 1) + timedelta(days=night)).strftime("%Y-%m-%dT02:00:00Z")
    return {
        "started": started, "code": f"{night}", "code_commit": f"{night:040x}", "study_commit": "",
        "libraries": {"numpy": "2"}, "host": "bench",
    }  # fmt: skip


def finish(history: History, night: int, names: list[str], rng: np.random.Generator) -> None:
    """Begin and end one night."""
    known = about(night)
    run = history.start_run(known)
    history.finish_run(run, str(known["started"]), [result(k, night, names, rng) for k in range(DESIGNS)])


def in_bulk(history: History, run: int, night: int, rng: np.random.Generator) -> None:
    """Write the rows of one night: new numbers and inputs of every design of the night before."""
    c = history.connection
    layout = int(c.execute("SELECT id FROM layouts").fetchone()[0])
    vector, snapshot, given = (
        int(c.execute(f"SELECT max(id) FROM {table}").fetchone()[0])
        for table in ("vectors", "snapshots", "inputs")
    )
    body = canonical(inputs_of(night))
    c.execute(
        "INSERT INTO inputs(id, sha, body) VALUES (?, ?, ?)",
        (given + 1, sha256(body), zlib.compress(body.encode())),
    )
    numbers = [(10.0 + rng.standard_normal(FIGURES)).astype("<f8").tobytes() for _ in range(DESIGNS)]
    c.executemany(
        "INSERT INTO vectors(id, sha, layout, numbers) VALUES (?, ?, ?, ?)",
        [(vector + 1 + k, vector_sha(layout, row), layout, row) for k, row in enumerate(numbers)],
    )
    c.executemany(
        "INSERT INTO snapshots(id, key, vector, input) VALUES (?, ?, ?, ?)",
        [(snapshot + 1 + k, f"{k}-{night}", vector + 1 + k, given + 1) for k in range(DESIGNS)],
    )
    c.execute(
        "WITH first AS (SELECT * FROM results WHERE run = (SELECT min(run) FROM results))"
        " INSERT INTO results SELECT subject, ?, status, snapshot + ? - (SELECT min(snapshot) FROM first),"
        " seconds, cached, failed, total, worst, worst_id, message FROM first",
        (run, snapshot + 1),
    )


def inputs_of(night: int) -> dict[str, object]:
    """What a design of a night was made of."""
    return {"parameters": {"control.position.gain": f"{night} 1/s"}}


def result(design: int, night: int, names: list[str], rng: np.random.Generator) -> NewResult:
    """One design in one night."""
    values = (10.0 + rng.standard_normal(len(names))).tolist()
    figures = [Figure(name=n, value=v, unit="dB", better=1) for n, v in zip(names, values, strict=True)]
    return NewResult(
        name=f"design {design}", kind="design", status="pass", key=f"{design}-{night}", figures=figures,
        inputs=inputs_of(night), total=12, worst=0.1, worst_id="GM",
    )  # fmt: skip


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
    yield Row(
        group=GROUP, name=f"{name}, first run", measured=times[0], unit="s", target=3.0 * count, note=note
    )
    yield Row(
        group=GROUP, name=f"{name}, first run, processor time of all processes", measured=spent[0], unit="s",
        target=6.0 * count, note="300 s on two free cores for 100 variants",
    )  # fmt: skip
    yield Row(group=GROUP, name=f"{name}, second run, unchanged", measured=times[1], unit="s", target=5.0)


def processor_s() -> float:
    """Processor time of this process and of those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)
