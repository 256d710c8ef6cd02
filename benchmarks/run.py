"""Run every ``bench_*.py`` of this folder and print one table: ``python -m benchmarks.run [NAME ...]``."""

from __future__ import annotations

import importlib
import pkgutil
import sys

from rich.console import Console
from rich.table import Table

import benchmarks
from benchmarks.row import Row


def main(names: list[str]) -> int:
    """Measure the named groups (all where none is named); 1 if a target is missed."""
    console = Console()
    modules = [m.name for m in pkgutil.iter_modules(benchmarks.__path__) if m.name.startswith("bench_")]
    wanted = [m for m in modules if not names or m.removeprefix("bench_") in names]
    rows: list[Row] = []
    for name in wanted:
        with console.status(f"measuring {name.removeprefix('bench_')}"):
            rows += importlib.import_module(f"benchmarks.{name}").rows()
    console.print(table(rows))
    return 1 if any(row.met is False for row in rows) else 0


def table(rows: list[Row]) -> Table:
    """Lay the rows out as a table."""
    out = Table("group", "what", "measured", "target", "met", "note")
    for row in rows:
        target = "" if row.target is None else f"{row.comparison} {row.target:g} {row.unit}"
        met = {True: "yes", False: "NO", None: ""}[row.met]
        out.add_row(row.group, row.name, f"{row.measured:.4g} {row.unit}", target, met, row.note)
    return out


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
