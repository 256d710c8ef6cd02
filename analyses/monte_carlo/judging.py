"""Requirements judged over columns of figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.asked.quantities import DRIVE_QUANTITIES, LOOP_QUANTITIES, QUANTITIES, judged_loops
from actuator_lti.batch.figures import LinearFigures
from actuator_lti.design.model import Design, Requirement
from actuator_lti.drive.profile import command_mean
from actuator_lti.errors import InputError

Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Judged:
    """One requirement over many designs; arrays of shape (count,).

    ``value`` is the figure that is limited, the worst of the loops, NaN where there is none; ``distance``
    that to the limit, positive where met, -inf where a loop is unstable or the figure is missing.
    """

    value: np.ndarray
    distance: np.ndarray
    passed: np.ndarray


def loops_of(design: Design) -> tuple[str, ...]:
    """Names of the loops that a design has, innermost first."""
    return tuple(reversed(design.controller.stages))


def drive_column(quantity: str, load_Nm: float | None) -> str:
    """Name of the column of a static figure at a load torque."""
    return f"drive.{quantity}@{load_Nm or 0.0:g}"


def loop_columns(linear: LinearFigures, quantities: Iterable[str] = LOOP_QUANTITIES) -> dict[str, np.ndarray]:
    """Columns of the loops of many designs: whether each is stable (1 or 0), and figures of it."""
    columns: dict[str, np.ndarray] = {}
    for loop in linear.loops:
        columns[f"{loop}.stable"] = linear.stable(loop).astype(float)
        columns |= {f"{loop}.{quantity}": linear.quantity(quantity, loop) for quantity in quantities}
    return columns


def by_loop(design: Design) -> list[Requirement]:
    """The requirements of a design, once for every loop that each holds for: as all verdicts count them."""
    made = []
    for one in design.requirements:
        named = one.quantity not in LOOP_QUANTITIES or one.loop not in (None, "every")
        loops = () if named else loops_of(design)
        made += [replace(one, id=f"{one.id}/{loop}", loop=loop) for loop in loops] or [one]
    return made


def in_populations(requirement: Requirement, design: Design) -> bool:
    """Whether the figures of many designs at once have what a requirement is on.

    They know the free rotor, and the response behind the profile's mean, through the filter.
    """
    quantity, command = QUANTITIES[requirement.quantity], design.command
    if quantity.scope == "analysis" or requirement.rotor == "locked":
        return False
    stages = design.controller.stages
    if not quantity.of_response or "position" not in judged_loops(requirement.loop, stages):
        return True
    if requirement.to == "reference":
        return command.filter_time_s == 0.0
    return command_mean(design) is None


def source_columns(requirement: Requirement, design: Design) -> tuple[str, ...]:
    """Columns that a requirement reads."""
    if requirement.quantity in DRIVE_QUANTITIES:
        return (drive_column(requirement.quantity, requirement.load_Nm),)
    loops = judged_loops(requirement.loop, loops_of(design))
    if not set(loops) <= set(loops_of(design)):
        raise InputError(f"requirement {requirement.id}: the design has no {requirement.loop} loop")
    return tuple(f"{loop}.{requirement.quantity}" for loop in loops)


def judge(requirement: Requirement, design: Design, columns: Columns) -> Judged:
    """Value, distance to the limit and verdict of one requirement for every design."""
    names = source_columns(requirement, design)
    values = np.stack([columns[name] for name in names])
    if QUANTITIES[requirement.quantity].absolute:
        values = np.abs(values)  # a margin counts in either direction
    low = -np.inf if requirement.minimum is None else requirement.minimum
    high = np.inf if requirement.maximum is None else requirement.maximum
    with np.errstate(invalid="ignore"):
        distances = np.fmin(_beyond(values, low), _beyond(-values, -high))
    for k, name in enumerate(names):
        loop = name.partition(".")[0]
        unstable = (
            columns[f"{loop}.stable"] != 1.0 if loop != "drive" else np.zeros(values.shape[1], dtype=bool)
        )
        distances[k, unstable | np.isnan(values[k])] = -np.inf
    worst = np.argmin(distances, axis=0)
    places = np.arange(values.shape[1])
    distance = distances[worst, places]
    return Judged(values[worst, places], distance, distance >= 0.0)


def _beyond(values: np.ndarray, limit: float) -> np.ndarray:
    """values - limit, +inf where there is no limit or the value is itself unlimited."""
    if np.isneginf(limit):
        return np.full(values.shape, np.inf)
    return values - limit


def label(requirement: Requirement) -> str:
    """A requirement in words: quantity, loop, load."""
    words = [requirement.quantity.replace("_", " ")]
    if requirement.loop:
        words.append(f"{requirement.loop} loop")
    if requirement.load_Nm is not None:
        words.append(f"at {requirement.load_Nm:g} N m")
    return ", ".join(words)
