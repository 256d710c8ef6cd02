"""What a range of samples comes to: distributions, passes and the worst samples, in bounded memory.

Reductions of ranges merge into that of all of them, the same to the bit in whatever order; so each is made
where its samples are computed, and its size does not grow with their number.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from actuator_lti.design.model import Design, Requirement
from analyses.monte_carlo.judging import by_loop, in_populations, judge
from analyses.monte_carlo.statistics import Sketch
from analyses.monte_carlo.task import SampleTask
from analyses.studies.engine import Chunk

WORST_KEPT = 8
BLOCK = 4096  # samples that are in memory at once
_ARRAYS = ("keys", "counts")


@dataclass(frozen=True)
class Tally:
    """Passes of one requirement, and its worst samples: distance, number, value."""

    passed: int = 0
    worst: tuple[tuple[float, int, float], ...] = ()

    @classmethod
    def of(cls, distance: np.ndarray, number: np.ndarray, value: np.ndarray, passed: np.ndarray) -> Tally:
        """The tally of some samples."""
        order = np.argsort(distance, kind="stable")[:WORST_KEPT]
        worst = tuple((float(distance[k]), int(number[k]), float(value[k])) for k in order)
        return cls(int(passed.sum()), worst)

    def merged(self, other: Tally) -> Tally:
        """The tally of the samples of both."""
        worst = sorted([*self.worst, *other.worst], key=lambda one: one[:2])[:WORST_KEPT]
        return Tally(self.passed + other.passed, tuple(worst))


@dataclass(frozen=True)
class Reduction:
    """Of some samples; ``together`` meet every requirement, tallies are in the order of `judged`."""

    count: int = 0
    together: int = 0
    columns: Mapping[str, Sketch] = field(default_factory=dict)
    tallies: tuple[Tally, ...] = ()

    def merged(self, other: Reduction) -> Reduction:
        """What the samples of both come to."""
        if not self.count or not other.count:
            return self if self.count else other
        return Reduction(
            self.count + other.count,
            self.together + other.together,
            {name: sketch.merged(other.columns[name]) for name, sketch in self.columns.items()},
            tuple(a.merged(b) for a, b in zip(self.tallies, other.tallies, strict=True)),
        )

    def packed(self, done: Sequence[Chunk]) -> bytes:
        """All of it in a file, with the ranges that it holds."""
        plain = asdict(replace(self, columns={}))
        scalars = {
            name: {k: v for k, v in vars(s).items() if k not in _ARRAYS} for name, s in self.columns.items()
        }
        arrays = {f"{k}.{n}": getattr(s, k) for n, s in self.columns.items() for k in _ARRAYS}
        text = json.dumps({**plain, "columns": scalars, "done": list(done)})
        buffer = io.BytesIO()
        np.savez_compressed(buffer, about=np.frombuffer(text.encode(), dtype=np.uint8), **arrays)
        return buffer.getvalue()


def unpacked(data: bytes) -> tuple[Reduction, list[Chunk]]:
    """Read what `Reduction.packed` wrote; of a damaged file nothing: its ranges are computed again."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            about: dict[str, Any] = json.loads(file["about"].tobytes())
            columns = {
                name: Sketch(**scalars, **{k: file[f"{k}.{name}"] for k in _ARRAYS})
                for name, scalars in about["columns"].items()
            }
        tallies = tuple(Tally(one["passed"], tuple(map(tuple, one["worst"]))) for one in about["tallies"])
        done = [(int(first), int(count)) for first, count in about["done"]]
        return Reduction(about["count"], about["together"], columns, tallies), done
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile, zlib.error, EOFError):
        return Reduction(), []


def judged(design: Design) -> list[Requirement]:
    """The requirements that are judged in every sample."""
    return [r for r in by_loop(design) if in_populations(r, design)]


def reduced(task: SampleTask, block: Mapping[str, np.ndarray]) -> Reduction:
    """What the samples of a block come to."""
    together = np.ones(len(block["sample"]), dtype=bool)
    tallies = []
    for requirement in judged(task.design):
        found = judge(requirement, task.design, block)
        tallies.append(Tally.of(found.distance, block["sample"], found.value, found.passed))
        together &= found.passed
    columns = {name: Sketch.of(block[name]) for name in task.units}
    return Reduction(len(together), int(together.sum()), columns, tuple(tallies))


@dataclass(frozen=True)
class Reducing:
    """A task whose samples stay where they are computed: only what they come to goes back."""

    task: SampleTask

    def sample(self) -> bytes:
        """See `SampleTask.sample`."""
        return self.task.sample()

    def __call__(self, chunk: Chunk) -> Reduction:
        """What the samples of a chunk come to."""
        made, first = Reduction(), chunk[0]
        draws = self.task.sampler.draw(*chunk)  # at once: far on it takes long
        for start in range(0, len(draws), BLOCK):
            block = self.task.columns(first + start, draws[start : start + BLOCK])
            made = made.merged(reduced(self.task, block))
        return made
