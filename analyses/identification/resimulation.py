"""Records simulated: the signal that tells most, refinement by it, and the design as written against it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.correlation.closed_loop import correlate_record, measured_signals, model_signals
from analyses.correlation.driving import command_of
from analyses.estimation.arrays import FloatArray
from analyses.identification.joint_model import FrictionForm, default_value
from analyses.identification.output_error import OutputErrorResult, refine_by_output_error
from analyses.identification.rows import record_rows
from analyses.records.record import Record

DRIVE_SIGNALS = ("force", "current", "voltage")
MOTION_SIGNALS = ("speed", "velocity", "angle", "output_angle", "position")


def output_name(design: Design, record: Record) -> str:
    """The signal that says most about the drive: the drive signal of a closed loop, else the motion.

    Under a command of the position or the speed the loop holds the motion, and the drive signal tells; a
    commanded current or voltage is held itself, and the motion tells.
    """
    command = command_of(design, record)
    if command is None:
        raise InputError("no command: a refinement by simulation needs it", where=record.name)
    there = measured_signals(design, record)
    closed = command.stage not in ("current", "voltage")
    order = (*DRIVE_SIGNALS, *MOTION_SIGNALS) if closed else (*MOTION_SIGNALS, *DRIVE_SIGNALS)
    for name in order:
        if name in there and np.any(there[name]):
            return name
    raise InputError("nothing recorded that a simulation could be fitted to", where=record.name)


def refine_records(
    design: Design,
    records: Sequence[Record],
    paths: tuple[str, ...],
    *,
    progress: Callable[[int, int], None] | None = None,
) -> OutputErrorResult:
    """Refine values by simulating every record with its own command, load and supply.

    Each record's output is divided by its size, so that all count alike.
    """
    names = [output_name(design, record) for record in records]
    measured = [measured_signals(design, record, derive=True) for record in records]
    sizes = [float(np.sqrt(np.mean(one[name] ** 2))) for one, name in zip(measured, names, strict=True)]
    wanted = [one[name] / size for one, name, size in zip(measured, names, sizes, strict=True)]

    def output(tried: Design) -> FloatArray:
        parts = [
            model_signals(tried, record, one)[0][name] / size
            for record, one, name, size in zip(records, measured, names, sizes, strict=True)
        ]
        return np.concatenate(parts)

    ends = np.cumsum([len(one) for one in wanted]).tolist()
    return refine_by_output_error(design, paths, output, np.concatenate(wanted), ends=ends, progress=progress)


MOST_TICKS = 2_000_000


@dataclass(frozen=True, kw_only=True)
class Resimulated:
    """The relative error of one record's signal under the written design, and how it was found."""

    record: str
    signal: str
    relative_error: float
    how: str


def resimulate(design: Design, records: Sequence[Record], form: FrictionForm) -> tuple[Resimulated, ...]:
    """Simulate a design with each record's own command, and compare the signal that tells most.

    A record without a command is held against the torque that the design's own inertia and friction need for
    its motion.
    """
    return tuple(_one(design, record, form) for record in records)


def _one(design: Design, record: Record, form: FrictionForm) -> Resimulated:
    if command_of(design, record) is None:
        return _needed(design, record, form)
    try:
        return _simulated(design, record)
    except InputError as error:  # a part that the simulator does not have
        result = _needed(design, record, form)
        return replace(result, how=f"{result.how} ({error.message})")


def simulated_part(design: Design, record: Record) -> Record:
    """The record; of a long one the first part."""
    return record.slice(0, max(int(MOST_TICKS * design.controller.period_s / record.period_s), 2))


def _simulated(design: Design, record: Record) -> Resimulated:
    name = output_name(design, record)
    part = simulated_part(design, record)
    how = (
        f"{name}, simulated" if len(part) == len(record) else f"{name}, its first {len(part)} rows simulated"
    )
    result = correlate_record(design, part)[name]
    return Resimulated(record=record.name, signal=name, relative_error=result.relative_error, how=how)


def _needed(design: Design, record: Record, form: FrictionForm) -> Resimulated:
    points = design.friction.map(1)
    knots = [point.speed_rad_s for point in points] if points else None
    rows = record_rows(design, record, form, None, knots_rad_s=knots)
    values = np.array([default_value(design, name) for name in rows.names])
    error = float(np.linalg.norm(rows.y - rows.w @ values) / np.linalg.norm(rows.y))
    return Resimulated(
        record=record.name, signal="drive", relative_error=error, how="torque needed for its motion"
    )
