"""The inverse dynamic model of records: its columns, its recipe, and what a fit of it holds.

Source of the recipe and of the published figures: A. Janot, M. Gautier, M. Brunot, "Data Set and Reference
Models of EMPS", Workshop on Nonlinear System Identification Benchmarks, 2019.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.interpolate import make_interp_spline

from actuator_lti.types import Floats, Mask
from analyses.estimation.fit import Fit
from analyses.records.differentiation import Motion, filtered_motion, low_pass
from analyses.records.record import Record

FrictionForm = Literal["symmetric", "per-direction"]

NAMES: Mapping[FrictionForm, tuple[str, ...]] = {
    "symmetric": ("inertia", "viscous", "dry", "offset"),
    "per-direction": ("inertia", "viscous_forward", "dry_forward", "viscous_reverse", "dry_reverse"),
}
TURNS = ("dry", "map_", "load_coefficient")  # what turns with the direction of the motion, by its name


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """The choices of the identification; the defaults are the published ones for EMPS."""

    cutoff_hz: float = 100.0
    filter_order: int = 4
    skip_samples: int = 49
    decimation: int = 10
    # left out at the end: there the filter, without further samples, bends the position
    skip_end_samples: int = 0
    points: int = 3  # over which it differentiates
    # whether what drives and what turns with the direction are filtered as the position is
    both_sides: bool = False

    def part(self, rows: int) -> slice:
        """The samples without those dropped at both ends; a short record keeps its end."""
        skip = self.skip_end_samples
        return slice(self.skip_samples, rows - skip if rows > 4 * skip else rows)

    def motion(self, values: Floats, period_s: float) -> Motion:
        """A position, filtered and differentiated."""
        return filtered_motion(values, period_s, self.cutoff_hz, self.filter_order, self.points)

    def other_side(self, values: Floats, period_s: float) -> Floats:
        """A torque that is not made of the filtered position."""
        if not self.both_sides:
            return values
        return low_pass(values, period_s, cutoff_hz=self.cutoff_hz, order=self.filter_order)


def friction_columns(
    motion: Motion,
    form: FrictionForm,
    knots_rad_s: Sequence[float] | None,
    filtered: Callable[[Floats], Floats],
) -> tuple[list[str], Floats]:
    """Names and columns of inertia, friction (of a form, or a map over the speed) and offset.

    What jumps where the motion turns back is ``filtered`` as the torques are.
    """
    velocity, side = motion.velocity, np.sign(motion.velocity)
    names, own = list(NAMES[form]), [velocity, filtered(side), np.ones_like(side)]
    if knots_rad_s is not None:
        names = ["inertia", *(f"map_{k}" for k in range(len(knots_rad_s))), "offset"]
        jump = own[1] - side
        own[:2] = (linear_basis(np.abs(velocity), knots_rad_s) * side[:, None]).T
        own[0] = own[0] + jump
    elif form == "per-direction":
        turns = [turn * side > 0.0 for turn in (1.0, -1.0)]
        own = [values for turn in turns for values in (velocity * turn, filtered(side * turn))]
    return names, np.column_stack([motion.acceleration, *own])


def linear_basis(speed: Floats, knots: Sequence[float]) -> Floats:
    """Piecewise linear functions, one for each knot: 1 there and 0 at the others; the last slope continues.

    >>> linear_basis(np.array([0.0, 1.0, 4.0]), (0.0, 2.0, 3.0)).tolist()
    [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, -1.0, 2.0]]
    """
    return np.asarray(make_interp_spline(knots, np.eye(len(knots)), k=1)(speed))


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Regressors and drive of one record after decimation, rows at rest left out."""

    name: str
    rows_in: int
    used: Mapping[str, str]  # what each signal was used for
    notes: tuple[str, ...]
    names: tuple[str, ...] = field(repr=False)  # of the regressors
    w: Floats = field(repr=False)
    y: Floats = field(repr=False)  # the drive
    sine: Floats = field(repr=False)  # of the output angle, as the cosine: of all rows
    cosine: Floats = field(repr=False)
    speed: Floats = field(repr=False)  # of the motor, as the acceleration
    acceleration: Floats = field(repr=False)
    step_s: float = field(repr=False)  # from row to row
    keep: Mask = field(repr=False)  # which of all rows are used
    recipe: Recipe = field(repr=False)
    # what the rows have of a torque at each of them; None: itself
    answer: Callable[[Floats], Floats] | None = field(default=None, repr=False)

    def answered(self, torque: Floats) -> Floats:
        """What the rows have of a torque at each of them: itself, or what it makes of a run-down."""
        return torque if self.answer is None else self.answer(torque)

    @property
    def rows_used(self) -> int:
        return len(self.y)

    @property
    def rows_at_rest(self) -> int:
        return int(np.count_nonzero(~self.keep))

    def shared(self, other: Rows) -> Mask:
        """Which rows both use, as far as the shorter of them goes."""
        return np.asarray(self.keep[: len(other.keep)] & other.keep[: len(self.keep)])

    def at(self, rows: Mask, values: Floats) -> Floats:
        """Of values at the rows used those at some of them."""
        return values[np.flatnonzero(rows[self.keep[: len(rows)]])]

    def columns(self, names: Sequence[str]) -> Floats:
        """The regressors of some names."""
        return self.w[:, [self.names.index(name) for name in names]]

    def explained(self, values: Mapping[str, float] | Fit, names: Sequence[str]) -> Floats:
        """What some names explain of the drive."""
        return np.asarray(self.columns(names) @ np.array([values[name] for name in names]))


@dataclass(frozen=True, kw_only=True)
class RecordFit(Rows):
    """One record's part of a joint model: its rows, ``w`` those of the fitted names."""

    residual: Floats = field(repr=False)
    own_residual: Floats = field(repr=False)  # of the record fitted alone: without scatter between records
    friction: Floats = field(repr=False)  # the drive less all but the friction
    noise: Floats = field(repr=False)  # what the simulated record does not explain of the own residual
    compared: Mask = field(repr=False)  # at which of the rows used
    inputs: Floats = field(repr=False)  # speed and acceleration, (rows, 2), as `w` there free of noise

    @property
    def relative_residual(self) -> float:
        """Norm of the residual under the joint model over that of the drive signal."""
        return float(np.linalg.norm(self.residual) / np.linalg.norm(self.y))

    @property
    def fit_percent(self) -> float:
        """``100 (1 - norm of the residual / norm of the drive signal about its mean)``."""
        about_mean = float(np.linalg.norm(self.y - self.y.mean()))
        return 100.0 * (1.0 - float(np.linalg.norm(self.residual)) / about_mean)


@dataclass(frozen=True, kw_only=True)
class LawChoice:
    """One friction law that was tried."""

    name: str
    breaks_rad_s: tuple[float, ...]  # break points, at the motor
    parameters: int
    relative_residual: float
    # Bayesian: ``n ln(mean square) + p ln n`` with n the number of rows worth one independent one, less that
    # of the plain law; below -6 the law is taken
    criterion: float
    taken: bool


@dataclass(frozen=True, kw_only=True)
class JointModel(Fit):
    """The inverse dynamic model of all records together.

    ``drive = inertia * acceleration + viscous * velocity + dry * sign(velocity) + offset``
    and, where there are such, ``+ load_coefficient |M| sign(velocity) - M / N``; in SI at the motor. With
    ``knots_rad_s`` the torques ``map_k`` at these speeds take the place of viscous and dry. The covariance
    holds the residual's correlation in time, and the scatter between records where there are several.
    """

    form: FrictionForm = "symmetric"
    white_errors: Floats  # as if the residual were white, as published for EMPS
    between: Mapping[str, float]  # the scatter between records alone, a standard deviation of one
    relative_residual: float  # norm of the residual over that of the drive signal, after decimation
    records: tuple[RecordFit, ...]
    recipe: Recipe  # of the first record
    asked: Recipe | None = field(default=None, repr=False)  # of all; none: each has its own
    condition: float
    alone: tuple[Fit, ...] = field(default=(), repr=False)  # the records fitted one by one
    knots_rad_s: tuple[float, ...] | None = None
    weights: tuple[float, ...] = ()
    bias: Mapping[str, float] = field(default_factory=dict)  # taken off each value as the fit's own
    bias_note: str = ""  # how, or why not
    noise_share: float = 0.0  # of what tells the inertia: noise of recorded motions, taken off as well
    # the records as the design simulates them that comes of it; none: it cannot
    simulated: tuple[Record, ...] = field(default=(), repr=False)
    laws: tuple[LawChoice, ...] = field(default=(), repr=False)

    def kept(self, rows: Rows) -> Floats:
        """What the values that were not found explain of rows."""
        return rows.explained(self, [name for name in rows.names if name not in self.names])

    def turned(self, rows: Rows) -> Floats:
        """What turns with the direction of the motion, of rows.

        A drive that stands still turns its friction at no time that the motion tells.
        """
        return rows.explained(self, [name for name in rows.names if name.startswith(TURNS)])

    @property
    def residual(self) -> Floats:
        """Of all records, one after the other, in the unit of the drive signal."""
        return np.concatenate([record.residual for record in self.records])

    @property
    def singles(self) -> dict[str, tuple[float, ...]]:
        """The value of each record fitted alone, where there are several; NaN where it does not tell it."""
        return {name: tuple(one.get(name, np.nan) for one in self.alone) for name in self.names}

    @property
    def rows_in(self) -> int:
        return sum(record.rows_in for record in self.records)

    @property
    def rows_used(self) -> int:
        return sum(record.rows_used for record in self.records)
