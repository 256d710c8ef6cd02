"""What would fill the memory or the night is refused before it is allocated, in one line with its option."""

import itertools
import math
import re
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pandas  # noqa: F401 - here, not where memory is measured
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from actuator_lti import bounds
from actuator_lti.design import load_design, with_overrides
from actuator_lti.errors import NumericalError
from analyses.monte_carlo import MonteCarloSettings
from analyses.studies.sampling import read_table
from analyses.studies.study import load_study
from nonlinear import Drive, Run, State, commands, loads, simulate, simulate_many
from nonlinear._kernels import layout as at
from nonlinear.row.parameters import design_row
from nonlinear.runs.batch import run_rows
from reports.cli import main  # noqa: F401 - what it loads is not what is measured
from tests import refusals

ROOT = Path(__file__).parents[2]
PERIOD_S = 1e-4
LIGHT_BYTES = 60_000_000


@pytest.fixture(autouse=True)
def light() -> Iterator[None]:
    """What is refused takes no memory worth the name."""
    tracemalloc.start()
    yield
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < LIGHT_BYTES


def refused(call: Callable[[], object], *words: str) -> None:
    refusals.refused(call, words=words)


AMBER, STEP = load_design("ilr33-amber"), commands.step(0.1)
FAR, YEARS = commands.sampled([0.0, 1e9], [0.0, 1.0]), loads.series([0.0, 1e9], [0.0, 1.0])


def run(duration_s: float, command: commands.Command = STEP, load: Any = 0.0, **more: Any) -> object:
    return simulate(AMBER, command, duration_s, load, **more)


def stepped(tones: Any, cycles: Any = 5, **more: Any) -> object:
    return commands.stepped_sine(0.1, tones, cycles, PERIOD_S, **more)


def summed(tones: Any, duration_s: Any = 1.0, **more: Any) -> commands.Command:
    return commands.multisine(0.1, tones, duration_s, PERIOD_S, **more)


def test_runs_of_years_histories_beyond_the_memory_and_millions_of_tones() -> None:
    refused(lambda: run(1e9, FAR), "duration_s = 1e+09", "at most 1000000000")
    refused(lambda: run(2e4, FAR), "--duration", "at most 50000000")
    refused(lambda: run(1e300), "duration_s = 1e+300")
    refused(lambda: run(2e4, STEP, YEARS), "at most 50000000")
    refused(lambda: run(9e4), "does not fit into memory", "record_every")
    refused(lambda: stepped(range(1, 10**7)), "--count", "at most 10000")
    refused(lambda: stepped([1e-9]), "--frequency", "at most 50000000")
    refused(lambda: summed(range(1, 10**9)), "--count", "at most 10000")
    refused(lambda: summed([1.0], 1e9), "--duration")
    refused(lambda: summed([1.0] * 5000, 4000.0), "lines times ticks")
    refused(lambda: summed([1.0], seed=-1), "seed = -1")
    refused(lambda: summed([1.0, 1e7]), "1e+07 Hz", "Nyquist", "5000 Hz")
    refused(lambda: stepped([1.0, 1e308]), "1e+308 Hz", "5000 Hz")
    refused(lambda: stepped([5e-324]), "at most 50000000")
    refused(lambda: stepped([1.0], 10**400), "--cycles", "at most 50000000")
    refused(lambda: MonteCarloSettings(samples=10**12), "--samples", "at most 100000000")
    refused(lambda: MonteCarloSettings(seed=-1), "seed = -1")
    row = design_row(AMBER)
    row[at.TICKS] = 3e10
    with pytest.raises(NumericalError, match="3e\\+10 ticks"):
        run_rows(row[None, :], np.zeros(0))


LONG = [range(10**12), range(10**20), [range(10**12)], itertools.count(), ["x"] * 10**6]
ABSURD = [*LONG, 10**400, 10**5000, math.nan, "x", 1j, {"x": 1}]
TAKES: dict[str, Callable[[Any], object]] = {
    "size": commands.step,
    "end": lambda given: commands.ramp(1.0, 0.0, given),
    "frequencies": stepped,
    "cycles": lambda given: stepped([1.0], given),
    "settling": lambda given: stepped([1.0], 1, settle_cycles=given),
    "tones": summed,
    "times": lambda given: commands.sampled(given, [1.0, 2.0]),
    "angles": lambda given: commands.sampled([0.0, 1.0], given),
    "ticks": lambda given: commands.step(0.1).values(PERIOD_S, given),
    "moment": loads.constant,
    "moments": lambda given: loads.series([0.0, 1.0], given),
    "duration": run,
    "torque": lambda given: run(0.01, disturbance_Nm=given),
    "tolerance": lambda given: run(0.01, tanh_tolerance=given),
    "start": lambda given: run(0.01, initial=State(motor_angle_rad=given)),
    "law": lambda given: run(0.01, initial=State(law=given)),
    "probes": lambda given: run(0.01, probes=given),
    "runs": simulate_many,
    "state": lambda given: Drive(AMBER).set(given),
}


@pytest.mark.parametrize("takes", TAKES)
def test_no_argument_is_laid_out_before_it_is_refused(takes: str) -> None:
    for given in ABSURD:
        line = refusals.refused(TAKES[takes], given)
        assert re.search(r"allowed: |must be |one of |needed|finite|this drive has", line), line


@pytest.mark.parametrize("digits", [400, 5000])
def test_a_count_beyond_every_run_is_as_good_as_all(digits: int) -> None:
    """Of ticks that are left out, of events, of threads."""
    count = 10**digits
    assert run(0.01, record_every=count, max_events=count).time_s.size == 1
    asked = Run(design=AMBER, command=STEP, duration_s=0.01)
    assert simulate_many([asked], threads=count).status.tolist() == [0]


def test_a_multisine_of_many_lines_is_summed_in_parts_and_one_as_large_as_a_double_has_no_warning() -> None:
    """The tones at 100 001 ticks are never held at once; it begins at zero, rising."""
    times, values = summed([1.0, 500.0], 10.0).samples
    assert times.size == 100_001
    assert abs(values[0]) < 1e-9
    assert values[1] > 0.0
    assert abs(values).max() == pytest.approx(0.1)
    # warnings are errors here: its spectrum is of its shape
    largest = commands.multisine(1e308, [1.0, 100.0], 1.0, PERIOD_S)
    assert largest.highest_content(5000.0) < 1e-3


@pytest.mark.parametrize(
    "given",
    ["--every 9", "--cycles 9", "--count 9", "--seed 9", "--frequency inf", "--to nan", "--amplitude=-inf"],
)
def test_a_number_beyond_all_bounds_is_one_line(given: str, cli) -> None:
    """Four hundred digits, or no finite number: whatever the option."""
    option = given.replace(" 9", " " + "9" * 400)
    line = cli.refused("simulate", "--command", "stepped-sine", *option.split())
    assert given.split()[0].partition("=")[0] in line
    assert ("finite" if "9" not in given else "2^63") in line


def test_commands_and_samples_of_many_rows_are_counted_before_they_are_read(tmp_path, monkeypatch) -> None:
    path = tmp_path / "r.csv"
    path.write_text("t,x\n" + "0,1\n" * 200)
    small = bounds.Bound(what="rows", most=100, reason="", asked_by="--record")
    monkeypatch.setattr("nonlinear.runs.records.TABLE_ROWS", small)
    refused(lambda: commands.recorded(path), "r.csv", "--record", "at most 100")
    with path.open("wb") as file:
        file.truncate(bounds.TABLE_BYTES.most + 1)  # a hole: takes no disk
    tracemalloc.stop()  # reading up to the bound is allowed
    refused(lambda: commands.recorded(path), "r.csv", "at most 256 MiB")
    tracemalloc.start()
    path = tmp_path / "s.parquet"
    table = pa.table({"motor.resistance": np.zeros(bounds.TABLE_ROWS.most + 1)})
    pq.write_table(table, path, compression="zstd")
    assert path.stat().st_size < 100_000
    monkeypatch.setattr(pq.ParquetFile, "read", lambda *_: pytest.fail("unpacked"))
    tracemalloc.reset_peak()
    refused(lambda: read_table(path, ("motor.resistance",)), "--from-samples", "at most 5000000")


GRID = '[study]\nbase = "ilr33-amber"\n[[grid]]\naxes = [{}]\n'
AXIS = '{ parameter = "motor.resistance", from = "50 mohm", to = "60 mohm", points = 1000 }'


def test_a_grid_of_a_thousand_to_the_sixty_and_sweeps_of_a_variant_too_many(tmp_path, monkeypatch) -> None:
    path = tmp_path / "s.toml"
    path.write_text(GRID.format(", ".join([AXIS] * 60)))
    refused(lambda: load_study(path), "grid[1].axes", "60 axes", "at most 20")
    path.write_text(GRID.format(", ".join([AXIS] * 20)))
    refused(lambda: load_study(path), "grid[1]", "1e+60 variants", "at most 10000")
    sweep = AXIS.replace("1000", "20")[2:-2].replace(", ", "\n")
    path.write_text('[study]\nbase = "ilr33-amber"\n' + f"[[sweep]]\n{sweep}\n" * 500)
    small = bounds.Bound(what="variants", most=25, reason="", asked_by="[[sweep]]")
    monkeypatch.setattr("analyses.studies.study.STUDY_VARIANTS", small)
    counted = Mock(wraps=with_overrides)
    monkeypatch.setattr("analyses.studies.study.with_overrides", counted)
    refused(lambda: load_study(path), "[[sweep]]", "at most 25")
    assert counted.call_count == 26


def test_the_table_in_the_documentation_is_this_one() -> None:
    assert (ROOT / "docs" / "limits.md").read_text(encoding="utf-8") == bounds.markdown()
    assert len(bounds.table()) > 25
    for name, bound in bounds.table().items():
        assert bound.most > 0, name
        assert bound.reason, name
