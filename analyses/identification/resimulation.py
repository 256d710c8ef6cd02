"""The design as it was written, read again and held against the records or the campaign that it came from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.correlation.closed_loop import correlate_record
from analyses.identification.joint_model import FrictionForm, default_value
from analyses.identification.points import SteadyPoint
from analyses.identification.refinement import has_command, output_name
from analyses.identification.rows import record_rows
from analyses.records.record import Record

MOST_TICKS = 2_000_000
RUN_UP_S = 0.3
STEADY_S = 0.2
SPEED_REACHED = 0.01
MOST_CAMPAIGN_TICKS = 200_000


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
    if not has_command(design, record):
        return _needed(design, record, form)
    try:
        return _simulated(design, record)
    except InputError as error:  # a part that the simulator does not have
        result = _needed(design, record, form)
        return replace(result, how=f"{result.how} ({error.message})")


def _simulated(design: Design, record: Record) -> Resimulated:
    name = output_name(design, record)
    rows = int(MOST_TICKS * design.controller.period_s / record.period_s)
    part = record if len(record) <= rows else record.slice(0, max(rows, 2))
    how = f"{name}, simulated" if part is record else f"{name}, its first {len(part)} rows simulated"
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


def steady_current_error(
    design: Design, points: Sequence[SteadyPoint], *, progress: Callable[[int, int], None] | None = None
) -> float | None:
    """Relative error of the simulated steady torques kM i over all runs; None where no run can be driven.

    Each run is a ramp of the output angle at the run's mean speed under its mean load, 0.3 s for running up
    and 0.2 s for the mean. Runs that the simulated drive does not bring to within 1 % of their speed are left
    out.
    """
    from nonlinear import commands, simulate

    constant = design.effective_motor.torque_constant_Nm_A
    duration = RUN_UP_S + STEADY_S
    period = design.controller.period_s
    if constant is None or duration / period > MOST_CAMPAIGN_TICKS:
        return None
    wanted, result = [], []
    for k, point in enumerate(points, 1):
        command = commands.ramp(point.direction * point.speed_rad_s / design.total_ratio)
        try:
            run = simulate(design, command, duration, point.load_Nm)
        except (InputError, NumericalError):
            continue
        late = run.time_s >= RUN_UP_S
        speed = point.direction * float(np.mean(run.motor_speed_rad_s[late]))
        if abs(speed - point.speed_rad_s) <= SPEED_REACHED * point.speed_rad_s:
            wanted.append(point.torque_Nm)
            result.append(point.direction * constant * float(np.mean(run.current_A[late])))
        if progress is not None:
            progress(k, len(points))
    if not wanted:
        return None
    return float(np.linalg.norm(np.subtract(result, wanted)) / np.linalg.norm(wanted))
