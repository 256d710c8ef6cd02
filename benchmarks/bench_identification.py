"""How long identification takes, and how much memory a long record needs."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

from benchmarks.row import Row

EMPS = Path(__file__).resolve().parents[2] / "shared" / "data" / "emps" / "DATA_EMPS.mat"
PEAK = """
import re, sys
from analyses.records.spec import RecordSpec, SignalColumn, TimeColumn
from analyses.records.csv_stream import read_csv_record
time = TimeColumn(column="tick", tick_s=1e-3, wrap=65536.0)
units = {"current": "A", "speed": "rpm", "angle": "deg"}
signals = tuple(SignalColumn(name=n, column=n, unit=u) for n, u in units.items())
record = read_csv_record(sys.argv[1], RecordSpec(time=time, signals=signals), max_rows=500_000)
counts = record.counts
assert counts.rows_in == counts.rows_out
kilobytes = re.search(r"VmHWM:\\s*([0-9]+)", open("/proc/self/status").read())[1]  # not that of the parent
print(int(kilobytes) / 1024.0, counts.rows_out)
"""


def rows(quick: bool = False) -> Iterable[Row]:
    """The rows of this group."""
    yield from _campaign(quick)
    yield from _intervals(20 if quick else 40)
    if EMPS.exists():
        yield _emps()
    yield from _streaming(quick)


def _campaign(quick: bool) -> Iterable[Row]:
    """A campaign of the paper's size, from its files and once they are read."""
    from actuator_lti import load_design
    from analyses.identification.campaign import identify_campaign
    from analyses.records.campaign_file import load_campaign
    from analyses.records.campaign_import import import_campaign
    from examples.virtual_bench import BenchPlan, measure_bench, simulate_bench, write_bench

    design = load_design("ilr33-amber")
    plan = BenchPlan(duration_s=4.0 if quick else 20.0)
    runs = simulate_bench(design, plan)
    with tempfile.TemporaryDirectory() as folder:
        path = write_bench(folder, measure_bench(runs, 1)[0], design=design.name, seed=1)
        start = time.perf_counter()
        imported = import_campaign(load_campaign(path))
        read = time.perf_counter()
        result = identify_campaign(imported, design)
        done = time.perf_counter()
    what = f"{len(result.fit.points)} runs of {plan.duration_s:g} s at 1 kHz"
    yield Row(f"{what}, from files", done - start, "s", 5.0)
    yield Row(f"{what}, once read", done - read, "s", 5.0)


def _intervals(drives: int) -> Iterable[Row]:
    """Random drives, each identified from a record of its own: do the 95 % intervals hold what they say?"""
    import numpy as np

    from analyses.identification.bench import identify_bench
    from benchmarks.random_records import KINDS, VALUES, random_records

    for kind in KINDS:
        errors = []
        for seed in range(drives):
            design, truth, records = random_records(kind, seed)
            model = identify_bench(design, records).model
            errors += [(model[name] - truth[name]) / model.std(name) for name in VALUES]
        inside = 100.0 * float(np.mean(np.abs(errors) < 1.96))
        name = f"95 % intervals of {drives} random drives, {kind}"
        rms = float(np.sqrt(np.mean(np.square(errors))))
        note = f"rms of error over stated error {rms:.2f}; wanted 92 to 98 % and 0.8 to 1.25"
        yield Row(name, inside, "%", 92.0, comparison=">=", note=note)


def _emps() -> Row:
    """The EMPS identification, both friction forms, after import."""
    from actuator_lti import load_design
    from analyses.identification.inverse import fit_records
    from analyses.records.open_record import open_record

    design, emps = load_design("emps"), open_record(EMPS)
    fit_records(design, [emps])  # the libraries are loaded
    start = time.perf_counter()
    for form in ("symmetric", "per-direction"):
        fit_records(design, [emps], form=form)
    seconds = time.perf_counter() - start
    return Row("EMPS, both friction forms", seconds, "s", 1.0)


def _streaming(quick: bool) -> Iterable[Row]:
    """Peak memory of a process that reads a long file, beside that for a tenth of it."""
    size = 100_000_000 if quick else 1_000_000_000
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.csv"
        _write_long(path, size // 10)
        small, _ = _peak_MB(path)
        _write_long(path, size)
        start = time.perf_counter()
        large, count = _peak_MB(path)
        seconds = time.perf_counter() - start
    name = f"CSV of {size / 1e9:g} GB"
    yield Row(f"{name}: peak memory of the process", large, "MB", 600.0, note=f"{count:.0f} rows, none lost")
    yield Row(f"{name}: peak memory over that for a tenth of it", large / small, "", 1.5)
    yield Row(f"{name}: time to read", seconds, "s")


def _write_long(path: Path, size: int) -> None:
    """A file of at least ``size`` bytes: one block of 65536 rows over and over, its tick wrapping."""
    lines = (f"{k},{1.5 + k % 13 / 100:.4f},{900 + k % 7},{k * 17 % 99991}\n" for k in range(65536))
    block = "".join(lines).encode()
    with path.open("wb") as stream:
        stream.write(b"tick,current,speed,angle\n")
        for _ in range(-(-size // len(block))):
            stream.write(block)


def _peak_MB(path: Path) -> tuple[float, float]:
    done = subprocess.run([sys.executable, "-c", PEAK, str(path)], capture_output=True, text=True, check=True)
    peak, count = done.stdout.split()
    return float(peak), float(count)
