"""Run every ``bench_*.py`` of this folder, a line a figure: ``python -m benchmarks.run [NAME ...]``.

Linear algebra runs as on the command line (`reports.arithmetic`): threads that wait for each other over small
matrices would be counted as processor time.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time

import benchmarks
from benchmarks.row import Row
from reports import arithmetic


def main(names: list[str]) -> int:
    """Measure the named groups (all where none is named); 1 if a target is missed."""
    arithmetic.settle()
    modules = [m.name for m in pkgutil.iter_modules(benchmarks.__path__) if m.name.startswith("bench_")]
    missed, start = 0, time.perf_counter()
    for name in (m for m in modules if not names or m.removeprefix("bench_") in names):
        sys.stdout.write(f"{name.removeprefix('bench_')}, begun after {time.perf_counter() - start:.0f} s\n")
        for row in importlib.import_module(f"benchmarks.{name}").rows():
            missed += row.met is False
            sys.stdout.write(f"{line(row)}\n")
            sys.stdout.flush()
    sys.stdout.write(f"{missed} missed, {time.perf_counter() - start:.0f} s\n")
    return 1 if missed else 0


def line(row: Row) -> str:
    """One figure: whether its target is met, the figure, the target, what it is, a note."""
    met = {True: "met", False: "NOT", None: ""}[row.met]
    target = "" if row.target is None else f"{row.comparison} {row.target:g}"
    note = f" ({row.note})" if row.note else ""
    return f"  {met:<4}{row.measured:>10.4g} {row.unit:<4} {target:<9} {row.name}{note}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
