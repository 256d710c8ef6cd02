"""The inverse dynamic model of records: its columns, its recipe, and what a fit of it holds.

Source of the recipe and of the published figures: A. Janot, M. Gautier, M. Brunot, "Data Set and Reference
Models of EMPS", Workshop on Nonlinear System Identification Benchmarks, 2019.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.estimation.arrays import BoolArray, FloatArray
from analyses.estimation.fit import Fit
from analyses.records.differentiation import Motion, filtered_motion

FrictionForm = Literal["symmetric", "per-direction"]

NAMES: Mapping[FrictionForm, tuple[str, ...]] = {
    "symmetric": ("inertia", "viscous", "dry", "offset"),
    "per-direction": ("inertia", "viscous_forward", "dry_forward", "viscous_reverse", "dry_reverse"),
}


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """The choices of the identification; the defaults are the published ones for EMPS.

    ``skip_end_samples`` are left out at the end of a record that ends in motion: there the filter, which has
    no further samples, bends the position. The published recipe keeps them, and differentiates over three
    ``points``.
    """

    cutoff_hz: float = 100.0
    filter_order: int = 4
    skip_samples: int = 49
    decimation: int = 10
    skip_end_samples: int = 0
    points: int = 3

    def __post_init__(self) -> None:
        for name, low in (
            ("filter_order", 1),
            ("skip_samples", 0),
            ("skip_end_samples", 0),
            ("decimation", 1),
        ):
            if getattr(self, name) < low:
                raise InputError(f"{name} = {getattr(self, name)}: must be {low} or more")

    def motion(self, values: FloatArray, period_s: float) -> Motion:
        """A position, filtered and differentiated."""
        return filtered_motion(
            values, period_s, cutoff_hz=self.cutoff_hz, order=self.filter_order, points=self.points
        )


def base_columns(motion: Motion, form: FrictionForm) -> FloatArray:
    """Columns of inertia and friction for a motion, in the order of ``NAMES[form]``."""
    velocity, direction = motion.velocity, np.sign(motion.velocity)
    if form == "symmetric":
        return np.column_stack([motion.acceleration, velocity, direction, np.ones_like(velocity)])
    ahead, back = velocity > 0.0, velocity < 0.0
    return np.column_stack(
        [motion.acceleration, velocity * ahead, direction * ahead, velocity * back, direction * back]
    )


def linear_basis(speed: FloatArray, knots: Sequence[float]) -> FloatArray:
    """Piecewise linear functions, one for each knot: 1 there and 0 at the others; the last slope continues.

    Examples
    --------
    >>> linear_basis(np.array([0.0, 1.0, 4.0]), (0.0, 2.0, 3.0)).tolist()
    [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, -1.0, 2.0]]
    """
    v = np.asarray(knots, dtype=float)
    k = np.clip(np.searchsorted(v, speed, side="right") - 1, 0, len(v) - 2)
    share = (speed - v[k]) / (v[k + 1] - v[k])
    out = np.zeros((len(speed), len(v)))
    rows = np.arange(len(speed))
    out[rows, k] = 1.0 - share
    out[rows, k + 1] = share
    return out


@dataclass(frozen=True, kw_only=True)
class RecordFit:
    """One record's part: rows, its relative residual under the joint model, what was used and noted.

    ``w`` (columns of the fitted names), ``residual``, ``speed``, ``acceleration``, ``drive`` and ``friction``
    (the drive less all but the friction) are of the rows used, ``keep`` marks these among all, ``step_s``
    apart.
    ``own_residual`` is that of the record fitted alone: what is left of it has no scatter between records.
    ``noise`` is what the simulated record does not explain of that, at the rows ``compared`` of those used.
    """

    name: str
    rows_in: int
    rows_used: int
    rows_at_rest: int
    relative_residual: float
    used: Mapping[str, str]
    notes: tuple[str, ...]
    w: FloatArray = field(repr=False)
    residual: FloatArray = field(repr=False)
    own_residual: FloatArray = field(repr=False)
    keep: BoolArray = field(repr=False)
    speed: FloatArray = field(repr=False)
    acceleration: FloatArray = field(repr=False)
    drive: FloatArray = field(repr=False)
    friction: FloatArray = field(repr=False)
    step_s: float = field(repr=False)
    noise: FloatArray = field(repr=False)
    compared: BoolArray = field(repr=False)

    @property
    def fit_percent(self) -> float:
        """``100 (1 - norm of the residual / norm of the drive signal about its mean)``."""
        about_mean = float(np.linalg.norm(self.drive - self.drive.mean()))
        return 100.0 * (1.0 - float(np.linalg.norm(self.residual)) / about_mean)


@dataclass(frozen=True, kw_only=True)
class JointModel(Fit):
    """The inverse dynamic model of all records together.

    ``drive = inertia * acceleration + viscous * velocity + dry * sign(velocity) + offset``
    and, where there are such, ``+ load_coefficient |M| sign(velocity) - M / N``; in SI at the motor. With
    ``knots_rad_s`` the torques ``map_k`` at these speeds take the place of viscous and dry.

    ``white_errors`` are those as if the residual were white, as published for EMPS; ``covariance`` holds its
    correlation in time, and the scatter between records where there are several, which ``between`` has alone
    (by name, a standard deviation of one record). ``relative_residual``: norm of the residual over that of
    the drive signal, after decimation. ``alone`` are the records fitted one by one; ``bias`` was taken
    off each value as the fit's own, ``bias_told`` says how, or why not.
    """

    form: FrictionForm
    white_errors: FloatArray
    between: Mapping[str, float]
    relative_residual: float
    records: tuple[RecordFit, ...]
    recipe: Recipe
    condition: float
    alone: tuple[Fit, ...] = field(default=(), repr=False)
    knots_rad_s: tuple[float, ...] | None = None
    weights: tuple[float, ...] = ()
    bias: Mapping[str, float] = field(default_factory=dict)
    bias_told: str = ""

    def turned(self, w: FloatArray, names: Sequence[str]) -> FloatArray:
        """What turns with the direction of the motion, of rows by ``names``.

        A drive that stands still turns its friction at no time that the motion tells.
        """
        dry = [k for k, name in enumerate(names) if name.startswith(("dry", "map_", "load_coefficient"))]
        return np.asarray(w[:, dry] @ np.array([self[names[k]] for k in dry]))

    @property
    def residual(self) -> FloatArray:
        """Of all records, one after the other, in the unit of the drive signal."""
        return np.concatenate([record.residual for record in self.records])

    @property
    def singles(self) -> dict[str, tuple[float, ...]]:
        """The value of each record fitted alone, where there are several; NaN where it does not tell it."""
        return {name: tuple(one.get(name, np.nan) for one in self.alone) for name in self.names}

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
