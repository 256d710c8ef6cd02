"""Records simulated: values with which the drive moves as they did, and the written design against them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from actuator_lti.design import parameter_value, with_values
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats, Progress
from analyses.correlation.closed_loop import correlate_record, measured_signals, model_signals
from analyses.correlation.compare import compare_signals
from analyses.correlation.driving import command_of
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import correlated_covariance
from analyses.estimation.parameters import default_value
from analyses.identification.joint_model import FrictionForm
from analyses.identification.rows import record_rows
from analyses.identification.run_down import decay_of, runs_down
from analyses.records.naming import PLACES
from analyses.records.record import Record

STEP = 1e-3
TOLERANCE = 1e-6
LEAST_GAIN = 1e-8
ITERATIONS = 24
AT_END = 1e-9  # part of the start within which a value is at the end of what its key allows
LEAST_STEPPED = 0.1  # of the start: below, a value, which may go to zero, is no measure of its step
LEAST_LOAD = 1e-6  # part of its start that is left of an inertia behind a coupling
MOST_TICKS = 2_000_000
DRIVE_SIGNALS = ("force", "current", "voltage")
MOTION_SIGNALS = ("speed", "velocity", *PLACES)


@dataclass(frozen=True, kw_only=True)
class OutputErrorResult(Fit):
    """Refined values by dotted key; their errors respect the correlation in time of what is left."""

    error_before: float  # of the drive signal: norm of the difference over norm of the measured
    error_after: float
    iterations: int
    design: Design
    # what ended at the least or largest value of its key: the records want another, no error of it holds
    at_bound: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Moved:
    """Values (SI) with which an output fits best, their design, its slopes (n, p) over them, what is left."""

    values: Floats
    design: Design
    slopes: Floats
    rest: Floats
    first: Floats
    iterations: int
    at_bound: tuple[str, ...]


@dataclass(frozen=True)
class Resimulated:
    """The relative error of one record's signal under the written design, and how it was found."""

    record: str
    signal: str
    relative_error: float
    beyond_noise: float  # the same without the white noise that the record itself shows
    how: str


def fit_output(
    design: Design,
    paths: tuple[str, ...],
    output_of: Callable[[Design], Floats],
    measured: Floats,
    progress: Progress = None,
    begin: Floats | None = None,
) -> Moved:
    """The values of some keys, within what each allows, with which an output of a design fits best.

    Least squares by a dogleg in a box (scipy), from the design's own values or others; the derivative is by
    central differences of a share `STEP` of each value of the design.
    """
    start = values_of(design, paths)
    scale, ends = box_of(design, paths)
    count, most = 0, ITERATIONS * (2 * len(paths) + 1)
    box = 1.0 + (ends - start) / scale

    def values_at(moved: Floats) -> Floats:
        return np.select(list(np.abs(moved - box) <= AT_END), list(ends), start + scale * (moved - 1.0))

    def design_at(moved: Floats) -> Design:
        values = dict(zip(paths, values_at(moved).tolist(), strict=True))
        return with_values(design, values, check=False)

    def residual(moved: Floats) -> Floats:
        nonlocal count
        output = output_of(design_at(moved))
        count += 1
        if progress is not None:
            progress(min(count, most), most)
        return measured - output

    at = np.ones(len(paths)) if begin is None else np.clip(1.0 + (begin - start) / scale, *box)
    first = residual(at)

    def slopes(moved: Floats) -> Floats:
        to = STEP * np.diag(np.maximum(np.abs(moved), LEAST_STEPPED))
        both = [np.clip(moved + side * to, *box) for side in (1.0, -1.0)]
        change = np.array([residual(up) - residual(down) for up, down in zip(*both, strict=True)])
        return np.asarray((change / np.diag(both[0] - both[1])[:, None]).T)

    options = {"method": "dogbox", "xtol": TOLERANCE, "ftol": LEAST_GAIN, "max_nfev": ITERATIONS}
    found = least_squares(residual, at, jac=slopes, bounds=box, **options)
    values = values_at(found.x)
    return Moved(
        values=values,
        design=design_at(found.x),
        slopes=found.jac / scale,
        rest=found.fun,
        first=first,
        iterations=int(found.njev),
        at_bound=tuple(path for path, one, at in zip(paths, values, ends.T, strict=True) if one in at),
    )


def values_of(design: Design, paths: Sequence[str]) -> Floats:
    """The values (SI) of some keys of a design."""
    return np.array([parameter_value(design, path) for path in paths])


def box_of(design: Design, paths: Sequence[str]) -> tuple[Floats, Floats]:
    """What each value is measured by, shape (p,), and the least and the largest of its key, shape (2, p).

    A load behind a coupling has some inertia: none is no drive.
    """
    fields = [field_of(path) for path in paths]
    low, high = np.array([(-np.inf, np.inf) if one is None else (one.low, one.high) for one in fields]).T
    scale = np.array([_scale(design, *each) for each in zip(paths, values_of(design, paths), strict=True)])
    coupled = np.array([path == "load.inertia" and design.coupling is not None for path in paths])
    return scale, np.array([np.where(coupled, np.maximum(low, LEAST_LOAD * scale), low), high])


def _scale(design: Design, path: str, start: float) -> float:
    """What a parameter is measured by: its start, or where that is zero a part of a like one."""
    period, friction = design.controller.period_s, design.friction
    stiffness = 0.0 if design.coupling is None else design.coupling.stiffness_Nm_rad
    like = {
        "friction.offset_torque": 0.1 * friction.dry_torque_Nm,
        "friction.dry_torque": 0.01 * abs(friction.offset_torque_Nm),
        "friction.viscous": 0.1 * design.inertia_kgm2,
        "coupling.damping": stiffness * period,
        "control.computing_delay": period,
    }.get(path, 0.0)
    if start == 0.0 == like:
        raise InputError(f"{path} = 0: a fit needs a start that is not zero")
    return abs(start) or like


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
    design: Design, records: Sequence[Record], paths: tuple[str, ...], *, progress: Progress = None
) -> OutputErrorResult:
    """Refine values by simulating every record with its own command, load and supply.

    Each record's output is divided by its size, so that all count alike.
    """
    seen = []
    for record in records:
        name, measured = output_name(design, record), measured_signals(design, record, derive=True)
        seen.append((record, name, measured, float(np.sqrt(np.mean(measured[name] ** 2)))))
    wanted = np.concatenate([measured[name] / size for _, name, measured, size in seen])

    def output(tried: Design) -> Floats:
        parts = [model_signals(tried, one, measured)[name] / size for one, name, measured, size in seen]
        return np.concatenate(parts)

    found, (size, _) = fit_output(design, paths, output, wanted, progress), box_of(design, paths)
    dead = np.flatnonzero(np.linalg.norm(found.slopes * size, axis=0) <= 1e-12 * np.linalg.norm(found.rest))
    if len(dead):
        raise NumericalError(f"the output does not depend on {paths[int(dead[0])]}; leave it out")
    norm, ends = float(np.linalg.norm(wanted)), np.cumsum([len(record) for record in records]).tolist()
    return OutputErrorResult(
        names=paths,
        values=found.values,
        covariance=correlated_covariance(found.slopes, found.rest, ends),
        error_before=float(np.linalg.norm(found.first)) / norm,
        error_after=float(np.linalg.norm(found.rest)) / norm,
        iterations=found.iterations,
        design=found.design,
        at_bound=found.at_bound,
    )


def resimulate(design: Design, record: Record, form: FrictionForm) -> Resimulated:
    """Simulate a design with a record's own command, and compare the signal that tells most.

    Rows that no fit is to use, as their signal is clipped, are not compared either. A record without a
    command is held against the torque that the design's own inertia and friction need for its motion, by the
    record's own recipe, whatever cut-off the fit had.
    """
    why = ""
    if command_of(design, record) is not None:
        try:
            name, part = output_name(design, record), simulated_part(design, record)
            signal = correlate_record(design, part)[name]
            if part.left_out is not None:
                columns = (each[~part.left_out] for each in (signal.time_s, signal.measured, signal.modelled))
                signal = compare_signals(name, signal.unit, *columns)
            error, first = signal.relative_error, f"its first {len(part)} rows " * (len(part) < len(record))
            how, beyond = f"{name}, {first}simulated", signal.left_by_noise * error
            how += f", {100.0 * error:.3g} % with its own noise" if error - beyond > 1e-3 else ""
            return Resimulated(record.name, name, error, beyond, how)
        except InputError as refusal:  # a part that the simulator does not have
            why = f" ({refusal.message})"
    if runs_down(design, record):
        error = decay_of(design, record, found=False).relative_error
        return Resimulated(record.name, "motion", error, error, "the decay of its motion")
    knots = [point.speed_rad_s for point in design.friction.map(1)] or None
    rows = record_rows(design, record, form, None, knots_rad_s=knots)
    rest = rows.y - rows.explained({name: default_value(design, name) for name in rows.names}, rows.names)
    error = float(np.linalg.norm(rest) / np.linalg.norm(rows.y))
    return Resimulated(record.name, "drive", error, error, f"torque needed for its motion{why}")


def simulated_part(design: Design, record: Record) -> Record:
    """The record; of a long one the first part."""
    return record.slice(0, max(int(MOST_TICKS * design.controller.period_s / record.period_s), 2))
