"""What is computed for every sample: linear figures, static figures, a nonlinear step; where it is kept.

On disk one Parquet file a chunk, there only when complete, and a manifest; a run that was ended goes on.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.asked.quantities import DRIVE_QUANTITIES, LOOP_QUANTITIES, QUANTITIES, judged_loops
from actuator_lti.batch import Population, drive_figures, linear_figures, variable_paths
from actuator_lti.design import design_hash
from actuator_lti.design.access import varied
from actuator_lti.design.model import Design, Requirement
from actuator_lti.drive.operating import OperatingPoint
from actuator_lti.errors import InputError, finite_number
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.reading import Tree, read_json
from actuator_lti.start.public_arguments import asked
from analyses.monte_carlo.judging import drive_column, in_populations, loop_column, loop_columns, loops_of
from analyses.motion.settling import step_ticks
from analyses.studies.engine import Arrays, Chunk
from analyses.studies.proof import code_version
from analyses.studies.sampling import Sampler, as_values
from nonlinear import Rows
from nonlinear.runs.reduced import BatchResult

SCHEMA = "actuator-lti/samples"
VERSION = 1
CHUNK = 4096


@dataclass(frozen=True)
class Store:
    """A folder of chunks of so many numbers; ``manifest``, written before the first, says of what study."""

    folder: Path
    chunk: int
    manifest: bytes

    @classmethod
    def open(cls, folder: Path, identity: Mapping[str, Any], chunk: int = CHUNK) -> Store:
        """Open a folder for a study of this ``identity``, plain JSON; one that holds another is refused."""
        path = folder / "manifest.json"
        wanted = {"schema": SCHEMA, "version": VERSION, "identity": dict(identity)}
        if path.exists():
            result = read_json(path, "manifest of a study")
            known = isinstance(result, dict) and isinstance(result.get("chunk"), int)
            if not known or result["chunk"] < 1:
                raise InputError("is no manifest of a study", where=str(path))
            if {key: result.get(key) for key in wanted} != wanted:
                words = "holds another study (design, seed, settings or code); take another folder"
                raise InputError(words, where=str(folder))
            chunk = result["chunk"]
        text = json.dumps({**wanted, "chunk": chunk}, indent=1, sort_keys=True)
        return cls(folder, chunk, text.encode())

    def put(self, path: Path, data: bytes) -> None:
        """Put a file of the study on disk, in a folder that says of what it is."""
        manifest = self.folder / "manifest.json"
        if not manifest.exists():
            write_bytes(manifest, self.manifest)
        write_bytes(path, data)

    def path(self, chunk: Chunk) -> Path:
        return self.folder / f"samples-{chunk[0]:010d}-{chunk[1]}.parquet"

    def chunks(self, total: int) -> list[Chunk]:
        return [(first, min(self.chunk, total - first)) for first in range(0, total, self.chunk)]

    def missing(self, total: int) -> list[Chunk]:
        """Chunks that are not on disk, or whose file is damaged."""
        return [chunk for chunk in self.chunks(total) if not _whole(self.path(chunk), chunk[1])]

    def write(self, chunk: Chunk, arrays: Arrays) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        sink = pa.BufferOutputStream()
        pq.write_table(pa.table(dict(arrays)), sink, compression="zstd")
        self.put(self.path(chunk), sink.getvalue().to_pybytes())

    def blocks(self, total: int) -> Iterator[Arrays]:
        import pyarrow.parquet as pq

        for chunk in self.chunks(total):
            part = pq.read_table(self.path(chunk), partitioning=None)
            yield {name: part.column(name).to_numpy() for name in part.column_names}


def _whole(path: Path, count: int) -> bool:
    """Whether a chunk's file is there and holds as many rows as it should."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return int(pq.read_metadata(path).num_rows) == count
    except (OSError, pa.ArrowInvalid):
        return False


@asked
@dataclass(frozen=True)
class StepCheck:
    """A step command from rest, of what the outermost loop follows."""

    amplitude_rad: float  # linear axis: m; rad/s of a speed drive, A or V of one without a velocity loop
    duration_s: float | None = None  # ``None``: `step_ticks` of the nominal design
    load_Nm: float = 0.0  # load torque, constant

    def __post_init__(self) -> None:
        lasts = 1.0 if self.duration_s is None else self.duration_s
        if not (0 < self.amplitude_rad < np.inf and 0 < lasts <= 100.0):
            given = f"amplitude_rad = {self.amplitude_rad:g}"
            given += "" if self.duration_s is None else f", duration_s = {lasts:g}"
            raise InputError(f"nonlinear step: {given}: must be above 0, a duration at most 100 s")
        finite_number("load_Nm", self.load_Nm)

    def lasts_s(self, design: Design) -> float:
        """How long a design follows it."""
        if self.duration_s is not None:
            return self.duration_s
        return float(step_ticks(design, np.array([self.amplitude_rad]))[0]) * design.controller.period_s


STEP: Mapping[str, tuple[str, Callable[[BatchResult], np.ndarray]]] = {
    "rise_time": ("s", lambda run: run.step.rise_time_s),
    "overshoot": ("%", lambda run: run.step.overshoot_percent),
    "settling_time": ("s", lambda run: run.step.settling_time_s),
    "final_error": ("%", lambda run: 100.0 * (1.0 - run.step.final_ratio)),
    "peak_current": ("A", lambda run: np.maximum(*np.abs(run.extreme("current_A")))),
    "speed_limited": ("%", lambda run: 100.0 * run.limit_fraction("speed")),
    "current_limited": ("%", lambda run: 100.0 * run.limit_fraction("current")),
    "voltage_limited": ("%", lambda run: 100.0 * run.limit_fraction("voltage")),
}
"""Figures of a nonlinear step against its command: unit, and how they are read; shares are of the time."""


def step_rows(step: StepCheck, population: Population) -> Rows:
    rows = Rows.of(population.stacked, population.count)
    rows["load"] = step.load_Nm
    rows["ticks"] = np.maximum(np.round(step.lasts_s(population.design) / rows["period"]), 1.0)
    rows.step_figures(step.amplitude_rad)
    rows.extremes()
    rows.step("command", step.amplitude_rad)
    return rows


def step_columns(step: StepCheck, population: Population) -> Arrays:
    """Figures of the nonlinear step of every design, by column; NaN of a failed run."""
    run = step_rows(step, population).run(threads=1)
    return {f"nonlinear.{name}": np.where(run.ok, read(run), np.nan) for name, (_, read) in STEP.items()}


@asked
@dataclass(frozen=True)
class SampleTask:
    """Figures of numbered samples of a design; goes to workers as it is."""

    design: Design
    sampler: Sampler
    operating_point: OperatingPoint = "sliding"  # of the linear loops, as the load
    load_Nm: float = 0.0
    loops: Collection[str] | None = None  # whose figures are wanted; by default of all
    time_figures: bool | Collection[str] = True  # of their steps, or of which loops
    step: StepCheck | None = None  # a nonlinear one

    def __post_init__(self) -> None:
        known = variable_paths(self.design)
        for path in self.sampler.paths:
            if path not in known:
                raise InputError(f"{path}: cannot vary in a Monte Carlo study")

    def __call__(self, chunk: Chunk) -> Arrays:
        return self.columns(chunk[0], self.sampler.draw(*chunk))

    def columns(self, first: int, draws: np.ndarray) -> Arrays:
        """All columns of samples from the first on, for their parameter values."""
        numbers = np.arange(first, first + len(draws), dtype=np.int64)
        values = {f"parameter.{p}": draws[:, k] for k, p in enumerate(self.sampler.paths)}
        return {"sample": numbers, **values, **self.figures(draws)}

    def sample(self) -> bytes:
        """The first sample, to be computed alike wherever the study is (`analyses.studies.proof`)."""
        return b"".join(values.tobytes() for values in self((0, 1)).values())

    def figures(self, draws: np.ndarray) -> Arrays:
        """Columns of figures for rows of parameter values (SI, in the order of ``sampler.paths``)."""
        population = Population(self.design, as_values(self.design, self.sampler.paths, draws), len(draws))
        columns: dict[str, np.ndarray] = {}
        if self.loops is None or self.loops:
            at = {"operating_point": self.operating_point, "load_Nm": self.load_Nm, "loops": self.loops}
            linear = linear_figures(population, **at, time_figures=self.time_figures, held=True)
            columns = loop_columns(linear, self.design, self._quantities)
        for quantity, load in self._drive_wanted:
            columns[drive_column(quantity, load)] = drive_figures(population, quantity, load)
        if self.step is not None:
            columns |= step_columns(self.step, population)
        return columns

    def of(self, requirement: Requirement) -> SampleTask:
        """The same of what one requirement is on alone."""
        quantity, design = QUANTITIES[requirement.quantity], replace(self.design, requirements=(requirement,))
        judged = judged_loops(requirement.loop, design.controller.stages)
        loops, timed = judged if quantity.scope == "loop" else (), judged if quantity.timed else ()
        return replace(self, design=design, loops=loops, time_figures=timed, step=None)

    @property
    def _quantities(self) -> tuple[str, ...]:
        return tuple(n for n, q in LOOP_QUANTITIES.items() if self.time_figures or not q.timed)

    @cached_property
    def _drive_wanted(self) -> list[tuple[str, float]]:
        asked = (r for r in self.design.requirements if r.quantity in DRIVE_QUANTITIES)
        return sorted({(r.quantity, r.load_Nm or 0.0) for r in asked if in_populations(r, self.design)})

    @property
    def units(self) -> dict[str, str]:
        """Columns of figures (without parameters and stability flags) with their units."""
        loops, names = loops_of(self.design), self._quantities
        of = {loop_column(self.design, loop, name): name for loop in loops for name in names}
        of |= {drive_column(name, load): name for name, load in self._drive_wanted}
        units = {column: QUANTITIES[name].unit_for(self.design.axis) for column, name in of.items()}
        stepped = {f"nonlinear.{name}": unit for name, (unit, _) in STEP.items()}
        return units | (stepped if self.step else {})

    def identity(self) -> Tree:
        """Everything that decides the numbers, as plain JSON."""
        table = self.sampler.table
        rows = hashlib.sha256(b"" if table is None else np.ascontiguousarray(table.rows, "<f8").tobytes())
        return {
            "design": design_hash(self.design),
            "code": code_version(),
            "seed": self.sampler.seed,
            "factors": [repr(factor) for factor in self.sampler.factors],
            "correlation": self.sampler.correlation.tolist(),
            "table": None if table is None else [list(table.paths), rows.hexdigest()],
            "operating_point": self.operating_point,
            "load_Nm": self.load_Nm,
            "time_figures": self.time_figures,
            "step": None if self.step is None else repr(self.step),
        }


def replay(design: Design, sampler: Sampler, number: int) -> Design:
    """The design of one sample, by its number."""
    values = sampler.draw(number, 1)[0]
    changes = {path: float(v) for path, v in zip(sampler.paths, values, strict=True)}
    return varied(design, changes)
