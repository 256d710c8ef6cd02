"""How long the commands take that one waits for, each in a process of its own, start-up included."""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial

from benchmarks.row import Row

COMMAND = (sys.executable, "-c", "import sys; from reports.cli.main import main; sys.exit(main())")
REPORT = ("report", "ilr33-amber", "--quiet", "--out")
TARGETS_S = {"--help": 0.3, "margins": 1.5, "report --no-validation": 4.0, "report": 9.0}


def rows(quick: bool = False) -> Iterable[Row]:
    """Measure the median time of each command."""
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            "--help": (["--help"], 7),
            "margins": (["margins", "ilr33-amber"], 5),
            "report --no-validation": ([*REPORT, folder, "--no-validation"], 3),
            "report": ([*REPORT, folder], 3),
        }
        for name, (arguments, times) in commands.items():
            taken = median_s(arguments, 1 if quick else times)
            note = f"median of {1 if quick else times}, wall clock, process start included"
            yield Row(f"actuator-lti {name}", taken, "s", TARGETS_S[name], note=note)
    yield from start_rows(1 if quick else 7)
    yield from drawing_rows(quick)
    yield from static_rows(quick)


def start_rows(times: int) -> Iterable[Row]:
    """Measure the processor time of short commands as whole processes, which other load does not change."""
    for name, target in {"simulate": 1.0, "margins": 1.5}.items():
        taken = statistics.median(process_s([name, "ilr33-amber"]) for _ in range(times))
        note = f"median of {times}, user and system time of the whole process"
        yield Row(f"actuator-lti {name}, processor time", taken, "s", target, note=note)


def drawing_rows(quick: bool = False) -> Iterable[Row]:
    """Measure the processor time of the figures and of the page of one report, validation included."""
    from actuator_lti import load_design
    from reports.build import design_report, validation_sections
    from reports.charts.svg import draw_all
    from reports.document import dumps, figures, loads
    from reports.html import page

    design = load_design("ilr33-amber")
    made = loads(dumps(design_report(design, validation_sections(design))))
    blocks = figures(made)
    times = 1 if quick else 3
    note = f"{len(blocks)} figures, processor time, median of {times}"
    drawn = statistics.median(processor_s(lambda: draw_all(blocks)) for _ in range(times))
    yield Row("static figures of a report", drawn, "s", 1.5, note=note)
    size = len(page(made)) / 1e6
    yield Row("page of a report", size, "MB", 2.5)
    again = processor_s(lambda: design_report(design, validation_sections(design)))
    whole = again + processor_s(lambda: page(made))
    note = "processor time beyond start-up, kernels compiled"
    yield Row("whole report with validation", whole, "s", 3.0, note=note)


STATIC = {
    "ilr33-amber": ({}, 1.5),
    "joint": ({}, 6.0),
    "ballscrew": ({}, 6.0),
    "fin": ({"control.computing_delay": "20 ms"}, 30.0),
}
"""Values changed and the goal in s; the last three have loops of about a hundred states."""


def static_rows(quick: bool = False) -> Iterable[Row]:
    """Measure the processor time of the figures of a report without validation, certified margins and all."""
    from actuator_lti import load_design
    from reports.build import design_report

    design_report(load_design("ctms-motor-position"))  # imports what it needs
    for name, (changes, target) in STATIC.items():
        if quick and changes:
            continue
        design = load_design(name).with_values(changes)
        taken = processor_s(partial(design_report, design))
        what = "".join(f", {key} = {value}" for key, value in changes.items())
        note = "processor time beyond start-up"
        yield Row(f"figures of a report without validation: {name}{what}", taken, "s", target, note=note)


def process_s(arguments: Sequence[str]) -> float:
    """Run a command once and give the processor time of its process in s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(arguments)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def processor_s(work: Callable[[], object]) -> float:
    """Do some work and give the processor time of this process in s."""
    start = time.process_time()
    work()
    return time.process_time() - start


def median_s(arguments: Sequence[str], times: int) -> float:
    """Run a command so many times, after one run that fills the caches, and give the median time."""
    run(arguments)
    return statistics.median(run(arguments) for _ in range(times))


def run(arguments: Sequence[str]) -> float:
    """Run a command once and give its time in s."""
    start = time.perf_counter()
    subprocess.run([*COMMAND, *arguments], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start
