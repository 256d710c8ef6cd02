"""How long the commands take that one waits for, each in a process of its own, start-up included."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence

from benchmarks.row import Row

COMMAND = (sys.executable, "-c", "import sys; from reports.cli.main import main; sys.exit(main())")
REPORT = ("report", "ilr33-amber", "--quiet", "--out")
TARGETS_S = {"--help": 0.3, "margins": 2.5, "report --no-validation": 12.0, "report": 15.0}


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
            yield Row(
                group="cli",
                name=f"actuator-lti {name}",
                measured=taken,
                unit="s",
                target=TARGETS_S[name],
                note=note,
            )


def median_s(arguments: Sequence[str], times: int) -> float:
    """Run a command so many times, after one run that fills the caches, and give the median time."""
    run(arguments)
    return statistics.median(run(arguments) for _ in range(times))


def run(arguments: Sequence[str]) -> float:
    """Run a command once and give its time in s."""
    start = time.perf_counter()
    subprocess.run([*COMMAND, *arguments], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start
