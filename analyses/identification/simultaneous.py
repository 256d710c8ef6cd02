"""Whether a drive signal and the motion of a record were taken at one time, and the record put right."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray, picked
from analyses.estimation.least_squares import covariance_of, told_apart
from analyses.identification.joint_model import JointModel, Recipe
from analyses.identification.rows import Rows, drive_of, rows_under
from analyses.records.consistency import SURE
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
        """The lag less that which the same analysis finds in a record without one."""
        return replace(self, seconds=self.seconds - own.seconds)


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
            table = np.column_stack([_columns(own, model), _slope(design, late, model, recipe)])
            step, error = _step(z, picked(table, own.keep, both), picked(y, own.keep, both))
            lag += float(np.clip(step, -LARGEST_STEP_S, LARGEST_STEP_S))
            if abs(step) < SETTLED * error:
                break
    except (InputError, NumericalError, np.linalg.LinAlgError):
        return None
    return Lag(seconds=lag, standard_error=error)


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
