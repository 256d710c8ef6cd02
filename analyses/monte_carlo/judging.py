"""Requirements over columns of figures; what samples come to, merged to the bit in any order."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import DRIVE_QUANTITIES, LOOP_QUANTITIES, QUANTITIES, judged_loops
from actuator_lti.batch.figures import LinearFigures
from actuator_lti.design.model import Design, Requirement
from actuator_lti.drive.profile import command_mean
from actuator_lti.errors import InputError
from analyses.monte_carlo.result import Sketch
from analyses.studies.engine import Chunk

if TYPE_CHECKING:
    from analyses.monte_carlo.task import SampleTask

Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Judged:
    """One requirement over many designs; arrays of shape (count,)."""

    value: np.ndarray  # the figure that is limited, the worst of the loops, NaN where there is none
    distance: np.ndarray  # to the limit, positive where met; -inf: unstable, or the figure is missing
    passed: np.ndarray
    unresolved: np.ndarray  # no loop fails, but rounding decides whether one is stable

    @property
    def resolved(self) -> np.ndarray:
        """The distance, inf where it is not resolved: such a drive is not the worst that is known."""
        return np.where(self.unresolved, np.inf, self.distance)


def loops_of(design: Design) -> tuple[str, ...]:
    """Names of the loops that a design has, innermost first."""
    return tuple(reversed(design.controller.stages))


def drive_column(quantity: str, load_Nm: float | None) -> str:
    """Name of the column of a static figure at a load torque."""
    return f"drive.{quantity}@{load_Nm or 0.0:g}"


def behind_mean(design: Design, loop: str, quantity: str) -> bool:
    """Whether many designs have a figure of the response behind the profile's mean, not to the command."""
    return loop == "position" and QUANTITIES[quantity].of_response and command_mean(design) is not None


def loop_column(design: Design, loop: str, quantity: str) -> str:
    """Name of the column of a loop's figure; behind the profile's mean a response is not the command's."""
    return f"{loop}.{quantity}" + "_behind_mean" * behind_mean(design, loop, quantity)


def loop_columns(
    linear: LinearFigures, design: Design, quantities: Iterable[str] = LOOP_QUANTITIES
) -> dict[str, np.ndarray]:
    """Columns of the loops of many designs: whether each is stable, and its figures, NaN if not.

    Stable is 1, not stable 0, and NaN where rounding decides it.
    """
    columns: dict[str, np.ndarray] = {}
    for loop in linear.loops:
        stable = linear.stable(loop)
        columns[f"{loop}.stable"] = np.where(linear.withheld(loop), np.nan, stable)
        for name in quantities:
            columns[loop_column(design, loop, name)] = np.where(stable, linear.quantity(name, loop), np.nan)
    return columns


def by_loop(design: Design) -> list[Requirement]:
    """The requirements of a design, once for every loop that each holds for: as all verdicts count them."""
    made = []
    for one in design.requirements:
        every = one.quantity in LOOP_QUANTITIES and one.loop in (None, "every")
        loops = loops_of(design) if every else ()
        made += [replace(one, id=f"{one.id}/{loop}", loop=loop) for loop in loops] or [one]
    return made


def in_populations(requirement: Requirement, design: Design) -> bool:
    """Whether figures of many designs have it."""
    quantity = QUANTITIES[requirement.quantity]
    if quantity.scope == "drive":
        return not np.isnan(drive_figure(design, quantity.name, requirement.load_Nm or 0.0))
    return quantity.scope == "loop" and not left_out(requirement, design)


def left_out(requirement: Requirement, design: Design) -> str:
    """What keeps figures of many designs from one of a loop, in words; empty where they have it."""
    if requirement.rotor == "locked":
        return "figures of many designs are of the free rotor"
    loops = judged_loops(requirement.loop, design.controller.stages)
    if not QUANTITIES[requirement.quantity].of_response or "position" not in loops:
        return ""
    if command_mean(design) is not None:
        mean = "figures of many designs lack the mean of command.jerk"
        return "" if requirement.to == "reference" else f'{mean}, which to = "reference" leaves out'
    filtered = requirement.to == "reference" and design.command.filter_time_s > 0.0
    return "figures of many designs have command.filter_time in them" if filtered else ""


def source_columns(requirement: Requirement, design: Design) -> tuple[str, ...]:
    if requirement.quantity in DRIVE_QUANTITIES:
        return (drive_column(requirement.quantity, requirement.load_Nm),)
    loops = judged_loops(requirement.loop, loops_of(design))
    if not set(loops) <= set(loops_of(design)):
        raise InputError(f"requirement {requirement.id}: the design has no {requirement.loop} loop")
    return tuple(loop_column(design, loop, requirement.quantity) for loop in loops)


def judge(requirement: Requirement, design: Design, columns: Columns) -> Judged:
    """Value, distance to the limit and verdict of one requirement for every design."""
    names = source_columns(requirement, design)
    values = np.stack([columns[name] for name in names])
    if QUANTITIES[requirement.quantity].absolute:
        values = np.abs(values)  # a margin counts in either direction
    distances = requirement.distance(values)
    always = np.ones(values.shape[1])  # there: a figure of the drive
    stable = np.stack([columns.get(f"{name.partition('.')[0]}.stable", always) for name in names])
    distances[np.isnan(values)] = -np.inf
    worst, places = np.argmin(distances, axis=0), np.arange(values.shape[1])
    distance, unresolved = distances[worst, places], np.isnan(stable)
    fails = np.any((distances < 0.0) & ~unresolved, axis=0)
    return Judged(values[worst, places], distance, distance >= 0.0, unresolved.any(axis=0) & ~fails)


WORST_KEPT = 8
BLOCK = 4096  # samples that are in memory at once


@dataclass(frozen=True)
class Tally:
    """Passes of one requirement, samples not resolved, and its worst: distance, number, value."""

    passed: int = 0
    unresolved: int = 0
    worst: tuple[tuple[float, int, float], ...] = ()

    @classmethod
    def of(cls, found: Judged, number: np.ndarray) -> Tally:
        order = np.argsort(found.resolved, kind="stable")[:WORST_KEPT]
        worst = tuple((float(found.resolved[k]), int(number[k]), float(found.value[k])) for k in order)
        return cls(int(found.passed.sum()), int(found.unresolved.sum()), worst)

    def merged(self, other: Tally) -> Tally:
        worst = sorted([*self.worst, *other.worst], key=lambda one: one[:2])[:WORST_KEPT]
        return Tally(self.passed + other.passed, self.unresolved + other.unresolved, tuple(worst))


@dataclass(frozen=True)
class Reduction:
    """Of some samples; ``together`` is of all requirements, tallies are in the order of `judged`."""

    count: int = 0
    together: Tally = Tally()
    unstable: int = 0  # of the outermost loop, the drive as a whole
    unresolved: int = 0
    columns: Mapping[str, Sketch] = field(default_factory=dict)
    tallies: tuple[Tally, ...] = ()

    def merged(self, other: Reduction) -> Reduction:
        if not self.count or not other.count:
            return self if self.count else other
        return Reduction(
            self.count + other.count,
            self.together.merged(other.together),
            self.unstable + other.unstable,
            self.unresolved + other.unresolved,
            {name: sketch.merged(other.columns[name]) for name, sketch in self.columns.items()},
            tuple(a.merged(b) for a, b in zip(self.tallies, other.tallies, strict=True)),
        )

    def packed(self, done: Sequence[Chunk]) -> bytes:
        """All of it in a file, with the ranges that it holds."""
        return zlib.compress(json.dumps([asdict(self), list(done)], default=np.ndarray.tolist).encode(), 3)


def unpacked(data: bytes) -> tuple[Reduction, list[Chunk]]:
    """Read what `Reduction.packed` wrote; of a damaged file nothing: its ranges are computed again."""
    try:
        about, done = json.loads(zlib.decompress(data))
        columns = {}
        for name, sketch in about["columns"].items():
            keys, counts = (np.array(sketch[of], dtype=np.int64) for of in ("keys", "counts"))
            columns[name] = Sketch(**{**sketch, "keys": keys, "counts": counts})
        together, *tallies = (
            Tally(**{**one, "worst": tuple(map(tuple, one["worst"]))})
            for one in (about["together"], *about["tallies"])
        )
        read = {"together": together, "columns": columns, "tallies": tuple(tallies)}
        whole = Reduction(**{**about, **read})
        return whole, [(int(first), int(count)) for first, count in done]
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, zlib.error):
        return Reduction(), []


def judged(design: Design) -> list[Requirement]:
    """The requirements that are judged in every sample."""
    return [r for r in by_loop(design) if in_populations(r, design)]


def reduced(task: SampleTask, block: Mapping[str, np.ndarray]) -> Reduction:
    """What the samples of a block come to."""
    count = len(block["sample"])
    every = [judge(requirement, task.design, block) for requirement in judged(task.design)]
    passed, met = np.ones((2, count), dtype=bool)
    for found in every:
        passed &= found.passed
        met &= found.passed | found.unresolved
    together = Tally(int(passed.sum()), int((met & ~passed).sum()))
    stable = next((block[f"{loop}.stable"] for loop in task.design.controller.stages[:1]), np.ones(count))
    return Reduction(
        count, together, int(np.sum(stable == 0.0)), int(np.sum(np.isnan(stable))),
        {name: Sketch.of(block[name]) for name in task.units},
        tuple(Tally.of(found, block["sample"]) for found in every),
    )  # fmt: skip


@dataclass(frozen=True)
class Reducing:
    """A task whose samples stay where they are computed: only what they come to goes back."""

    task: SampleTask

    def sample(self) -> bytes:
        return self.task.sample()

    def __call__(self, chunk: Chunk) -> Reduction:
        made, first = Reduction(), chunk[0]
        draws = self.task.sampler.draw(*chunk)  # at once: far on it takes long
        for start in range(0, len(draws), BLOCK):
            block = self.task.columns(first + start, draws[start : start + BLOCK])
            made = made.merged(reduced(self.task, block))
        return made
