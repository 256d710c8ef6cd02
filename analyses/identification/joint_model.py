"""What an inverse dynamic model of records holds: values, errors, what was not fitted, each record's part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from actuator_lti.design.model import Design
from analyses.estimation.fit import Fit
from analyses.identification.dynamic import FrictionForm, Recipe

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class RecordFit:
    """One record's part: rows, its relative residual under the joint model, what was used and noted."""

    name: str
    rows_in: int
    rows_used: int
    rows_at_rest: int
    relative_residual: float
    used: Mapping[str, str]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class JointModel(Fit):
    """The inverse dynamic model of all records together.

    ``drive = inertia * acceleration + viscous * velocity + dry * sign(velocity) + offset``
    and, where there are such, ``+ load_coefficient |M| sign(velocity) - M / N``; in SI at the motor. With
    ``knots_rad_s`` the torques ``map_k`` at these speeds take the place of viscous and dry.

    Attributes
    ----------
    white_errors : array
        As if the residual were white, as published for EMPS.
    covariance : array
        With the correlation of the residual in time, and with the scatter between records where there are
        several; ``between`` is that scatter alone, by name, as a standard deviation of one record.
    relative_residual : float
        Norm of the residual over norm of the drive signal, after decimation, all records.
    weights : tuple of float
        Of the records.
    bias : mapping
        What was taken off each value as the fit's own bias; ``bias_told`` says how, or why not.
    """

    form: FrictionForm
    white_errors: FloatArray
    between: Mapping[str, float]
    relative_residual: float
    residual: FloatArray = field(repr=False)
    records: tuple[RecordFit, ...]
    recipe: Recipe
    condition: float
    singles: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    knots_rad_s: tuple[float, ...] | None = None
    weights: tuple[float, ...] = ()
    bias: Mapping[str, float] = field(default_factory=dict)
    bias_told: str = ""

    @property
    def rows_in(self) -> int:
        """Rows of all records."""
        return sum(record.rows_in for record in self.records)

    @property
    def rows_used(self) -> int:
        """Rows of the regression."""
        return sum(record.rows_used for record in self.records)


def default_value(design: Design, name: str) -> float:
    """The design's own value of a parameter of the model, at the motor."""
    friction = design.friction
    own = {
        "inertia": design.inertia_kgm2,
        "viscous": friction.viscous(1),
        "dry": friction.dry_Nm(0.0, 1),
        "offset": friction.offset_torque_Nm,
        "viscous_forward": friction.viscous(1),
        "dry_forward": friction.dry_Nm(0.0, 1),
        "viscous_reverse": friction.viscous(-1),
        "dry_reverse": friction.dry_Nm(0.0, -1),
        "load_coefficient": friction.load_coefficient,
    }
    gravity = design.load.gravity
    if gravity is not None:
        own["gravity_sin"] = gravity.peak_Nm * float(np.cos(gravity.offset_rad))
        own["gravity_cos"] = gravity.peak_Nm * float(np.sin(gravity.offset_rad))
    own |= {f"map_{k}": point.torque_Nm for k, point in enumerate(friction.map(1))}
    return own.get(name, 0.0)
