"""Refinement by simulation over one or several records: which output is fitted, and how it is weighed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.correlation.closed_loop import measured_signals, model_signals
from analyses.correlation.driving import command_of
from analyses.estimation.arrays import FloatArray
from analyses.identification.output_error import OutputErrorResult, refine_by_output_error
from analyses.records.record import Record

DRIVE_SIGNALS = ("force", "current", "voltage")
MOTION_SIGNALS = ("speed", "velocity", "angle", "output_angle", "position")


def has_command(design: Design, record: Record) -> bool:
    """Whether a record holds a command that the design's drive takes."""
    return command_of(design, record) is not None


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

    Raises
    ------
    InputError
        If a record holds no command.
    """
    names = [output_name(design, record) for record in records]
    measured = [measured_signals(design, record, derive=True) for record in records]
    sizes = [_size(one[name]) for one, name in zip(measured, names, strict=True)]
    wanted = [one[name] / size for one, name, size in zip(measured, names, sizes, strict=True)]

    def output(tried: Design) -> FloatArray:
        parts = [
            model_signals(tried, record, one)[0][name] / size
            for record, one, name, size in zip(records, measured, names, sizes, strict=True)
        ]
        return np.concatenate(parts)

    ends = np.cumsum([len(one) for one in wanted]).tolist()
    return refine_by_output_error(design, paths, output, np.concatenate(wanted), ends=ends, progress=progress)


def _size(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
