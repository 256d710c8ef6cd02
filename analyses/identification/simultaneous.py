"""Whether drive signal, motion and command are of one time and scale, and the record put right."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray, picked
from analyses.estimation.least_squares import covariance_of, solve, told_apart
from analyses.identification.joint_model import JointModel, Recipe
from analyses.identification.rows import Rows, drive_of, rows_under
from analyses.records.consistency import RATE_TOLERANCE, SURE
from analyses.records.record import Record

ROUNDS = 8
SETTLED = 0.1
LARGEST_STEP_S = 0.01


@dataclass(frozen=True, kw_only=True)
class Lag:
    """How much later than the motion a record's drive signal is, with its standard error, s."""

    seconds: float
    standard_error: float

    @property
    def is_sure(self) -> bool:
        """Whether it is there."""
        return abs(self.seconds) > SURE * self.standard_error

    def less(self, own: Lag) -> Lag:
        """The lag less that which the same analysis finds in a record without one; the errors of both."""
        error = float(np.hypot(self.standard_error, own.standard_error))
        return Lag(seconds=self.seconds - own.seconds, standard_error=error)


def shifted(design: Design, record: Record, seconds: float) -> Record:
    """A record with its drive signal taken ``seconds`` later in the file, as if it came so much earlier."""
    name = drive_of(design, record)[1]
    moved = np.interp(record.time_s + seconds, record.time_s, record[name])
    return replace(record, signals={**record.signals, name: moved})


def lag_of(
    design: Design, record: Record, simulated: Record, model: JointModel, recipe: Recipe | None
) -> Lag | None:
    """The lag with which the inverse model leaves the least, the model's values being found anew.

    Gauss-Newton on the shift of the drive signal, its derivative by a difference over the record's period.
    The rows of the simulated record are the instruments (IDIM-IV; Janot, Vandanjon, Gautier, 2014), so that
    noise of motion and current does not bias the steps. None where the motion does not tell a lag from
    inertia and friction.
    """
    try:
        own, other = (rows_under(design, one, model, recipe) for one in (record, simulated))
        slope = _slope(design, simulated, model, recipe)
        if len(other.keep) > len(own.keep):
            return None
        both = own.keep[: len(other.keep)] & other.keep
        z = picked(np.column_stack([_columns(other, model), slope]), other.keep, both)
        if len(z) <= z.shape[1] or len(told_apart(z, (*model.names, "lag"))[0]) < z.shape[1]:
            return None
        lag, error = 0.0, np.inf
        for _ in range(ROUNDS):
            late = shifted(design, record, lag)
            y = rows_under(design, late, model, recipe).y - _kept(own, model)
            slopes = np.column_stack([_columns(own, model), _slope(design, late, model, recipe)])
            table = picked(slopes, own.keep, both)
            step, error = _step(z, table, picked(y, own.keep, both))
            lag += float(np.clip(step, -LARGEST_STEP_S, LARGEST_STEP_S))
            if abs(step) < SETTLED * error:
                break
        turned = [picked(model.turned(rows.w, rows.names), rows.keep, both) for rows in (own, other)]
        feigned = _step(z, table, turned[0] - turned[1])[0]
    except (InputError, NumericalError, np.linalg.LinAlgError):
        return None
    return Lag(seconds=lag, standard_error=float(np.hypot(error, feigned)))


def _step(z: FloatArray, table: FloatArray, y: FloatArray) -> tuple[float, float]:
    """The last value of ``z' (y - table p) = 0``, and its standard error."""
    size = np.linalg.norm(z, axis=0)
    slopes = (z / size).T @ (table / size)
    found = np.linalg.solve(slopes, (z / size).T @ y)
    # with rows z and the noise of the residual, the covariance of z'e, turned back by the slopes
    gram = (z / size).T @ (z / size)
    noise = gram @ covariance_of([(z / size, y - table / size @ found)]) @ gram
    back = np.linalg.inv(slopes)
    return float(found[-1] / size[-1]), float(np.sqrt((back @ noise @ back.T)[-1, -1]) / size[-1])


def _slope(design: Design, record: Record, model: JointModel, recipe: Recipe | None) -> FloatArray:
    """By how much the drive of each row falls with a shift, N m/s."""
    half = 0.5 * record.period_s
    after, before = (rows_under(design, shifted(design, record, s), model, recipe).y for s in (half, -half))
    return np.asarray((before - after) / (2.0 * half))


def _columns(rows: Rows, model: JointModel) -> FloatArray:
    return rows.w[:, [rows.names.index(name) for name in model.names]]


def _kept(rows: Rows, model: JointModel) -> FloatArray:
    """What the values that were not found explain."""
    kept = [name for name in rows.names if name not in model.names]
    values = np.array([model[name] for name in kept])
    return np.asarray(rows.w[:, [rows.names.index(name) for name in kept]] @ values)


@dataclass(frozen=True, kw_only=True)
class Followed:
    """The recorded following error over the simulated one, and the scale of the recorded position.

    The scale is what the position has too much of the motion that was asked for, as a share.
    """

    ratio: float
    ratio_error: float
    scale: float = 0.0
    scale_error: float = 0.0

    @property
    def clock(self) -> float:
        """The share by which a clock is off, 0 where chance explains it."""
        return self.ratio - 1.0 if abs(self.ratio - 1.0) > SURE * self.ratio_error else 0.0

    @property
    def off(self) -> float:
        """The share by which the scale is off, 0 where chance explains it."""
        return self.scale if abs(self.scale) > SURE * self.scale_error else 0.0

    @property
    def fails(self) -> bool:
        """Whether they are off by more than an interval can hold."""
        return max(abs(self.clock), abs(self.off)) > RATE_TOLERANCE


def followed(design: Design, record: Record, simulated: Record) -> Followed | None:
    """The following error as a clock: the loops' gains are per second, whatever the drive's torque.

    Inertia, friction and gravity of a record whose clock runs wrong agree with each other, as its torque is
    right and its motion only stretched. But a position loop over a velocity loop lags by ``(v + i/Kp)/Kv``
    (without the second term where the velocity loop has an integral), whatever the motor: a clock off by a
    factor shows as about the same factor between the recorded following error and the simulated one, a
    scale of the position as a part of the motion in it. Both are regressed together; noise is in the
    recorded position alone. None where the drive has no such loops, or the motion does not tell.
    """
    design = record.drive(design)
    control = design.controller
    if control.position is None or control.velocity is None:
        return None
    linear = design.axis == "linear"
    command = "position_reference" if linear else "reference"
    side = "angle" if control.position.sensor == "motor" else "output_angle"
    place = "position" if linear else side
    if not {command, place} <= set(record.signals) or place not in simulated.signals:
        return None
    factor = design.total_ratio if place == "angle" else 1.0
    record = record.slice(0, len(simulated))  # of a long one the first part is simulated
    columns = (factor * record[command], record[place], simulated[place])
    wanted, own, model = (values - values.mean() for values in columns)
    table = np.column_stack([wanted - model, model])
    kept, _ = told_apart(table, ("following error", "motion"))
    if 0 not in kept or not np.any(wanted - own):
        return None
    size = np.linalg.norm(table[:, kept], axis=0)
    solved = solve(table[:, kept] / size, wanted - own)
    values, errors = solved.values / size, np.sqrt(np.diag(solved.correlated)) / size
    scale = (-float(values[1]), float(errors[1])) if len(kept) > 1 else (0.0, 0.0)
    return Followed(
        ratio=float(values[0]), ratio_error=float(errors[0]), scale=scale[0], scale_error=scale[1]
    )
