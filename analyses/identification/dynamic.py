"""Mass or inertia, friction and offset from a motion: the inverse dynamic model, by least squares.

Source of the recipe and of the published figures: A. Janot, M. Gautier, M. Brunot, "Data Set and Reference
Models of EMPS", Workshop on Nonlinear System Identification Benchmarks, 2019.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from actuator_lti.errors import InputError, NumericalError
from analyses.identification.differentiation import Motion, decimated, filtered_motion
from analyses.identification.least_squares import solve

FloatArray = NDArray[np.float64]
FrictionForm = Literal["symmetric", "per-direction"]

NAMES: Mapping[FrictionForm, tuple[str, ...]] = {
    "symmetric": ("inertia", "viscous", "dry", "offset"),
    "per-direction": ("inertia", "viscous_forward", "dry_forward", "viscous_reverse", "dry_reverse"),
}
MAX_CONDITION = 1e6


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


@dataclass(frozen=True, kw_only=True)
class DynamicModel:
    """The inverse dynamic model that was found.

    ``drive = inertia * acceleration + viscous * velocity + dry * sign(velocity) + offset``, in SI (N and m,
    or N m and rad). ``covariance`` has the order of ``names``. The variance of the residual is that about its
    mean, over n - 1 rows, as in the published figures.

    ``relative_residual`` is the norm of the residual over the norm of the drive signal, after decimation.
    """

    form: FrictionForm
    names: tuple[str, ...]
    values: FloatArray
    standard_errors: FloatArray
    covariance: FloatArray
    relative_residual: float
    residual: FloatArray
    rows_in: int
    rows_used: int
    recipe: Recipe
    condition: float

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

    def std(self, name: str) -> float:
        """Standard error of one parameter."""
        return float(self.standard_errors[self.names.index(name)])

    def drive(self, motion: Motion) -> FloatArray:
        """The force or torque that the model wants for a motion."""
        return np.asarray(base_columns(motion, self.form) @ self.values)


def identify_dynamics(
    position: FloatArray,
    drive: FloatArray,
    period_s: float,
    *,
    form: FrictionForm = "symmetric",
    recipe: Recipe | None = None,
) -> DynamicModel:
    """Identify inertia and friction from a position and the force (or torque) that drove it.

    Parameters
    ----------
    position, drive : array, shape (n,)
        Measured position (m or rad) and drive force or torque (N or N m), sampled together.
    period_s : float
        Sampling period, s.
    form : {"symmetric", "per-direction"}
        One friction law and an offset, or a law for each direction (then the offset is in the difference of
        the two).
    recipe : Recipe, optional
        Filtering, skipping, decimation; the published recipe by default.

    Returns
    -------
    DynamicModel

    Raises
    ------
    InputError
        For signals that do not fit together or are too short.
    NumericalError
        If the motion does not excite all parameters.
    """
    recipe = Recipe() if recipe is None else recipe
    position, drive = _checked(position, drive, period_s, recipe)
    if form not in NAMES:
        raise InputError(f'form = "{form}": one of {", ".join(NAMES)}')
    motion = filtered_motion(position, period_s, cutoff_hz=recipe.cutoff_hz, order=recipe.filter_order)
    skip = recipe.skip_samples
    rows = decimated(np.column_stack([base_columns(motion, form), drive])[skip:], recipe.decimation)
    return _least_squares(rows[:, :-1], rows[:, -1], form, recipe, len(position))


def _checked(
    position: FloatArray, drive: FloatArray, period_s: float, recipe: Recipe
) -> tuple[FloatArray, FloatArray]:
    position, drive = np.asarray(position, dtype=np.float64), np.asarray(drive, dtype=np.float64)
    if position.ndim != 1 or position.shape != drive.shape:
        raise InputError(
            f"position and drive have the shapes {position.shape} and {drive.shape}: one row a sample"
        )
    if not period_s > 0.0:
        raise InputError(f"period = {period_s} s: must be positive")
    needed = recipe.skip_samples + 10 * recipe.decimation
    if len(position) < needed:
        raise InputError(f"{len(position)} samples: at least {needed} are needed")
    if not (np.isfinite(position).all() and np.isfinite(drive).all()):
        raise InputError("position and drive must be finite")
    return position, drive


def base_columns(motion: Motion, form: FrictionForm) -> FloatArray:
    """Columns of inertia and friction for a motion, in the order of ``NAMES[form]``."""
    velocity, direction = motion.velocity, np.sign(motion.velocity)
    if form == "symmetric":
        return np.column_stack([motion.acceleration, velocity, direction, np.ones_like(velocity)])
    ahead, back = velocity > 0.0, velocity < 0.0
    return np.column_stack(
        [motion.acceleration, velocity * ahead, direction * ahead, velocity * back, direction * back]
    )


def _least_squares(
    w: FloatArray, y: FloatArray, form: FrictionForm, recipe: Recipe, rows_in: int
) -> DynamicModel:
    scale = np.linalg.norm(w, axis=0)
    condition = float(np.linalg.cond(w / scale)) if np.all(scale > 0.0) else np.inf
    if not condition < MAX_CONDITION:
        raise NumericalError(
            f"the motion does not excite all of {', '.join(NAMES[form])} (condition {condition:.2g}): "
            "it needs several speeds and accelerations, and for per-direction both directions"
        )
    result = solve(w, y)
    return DynamicModel(
        form=form,
        names=NAMES[form],
        values=result.values,
        standard_errors=np.sqrt(np.diag(result.white)),
        covariance=result.white,
        relative_residual=float(np.linalg.norm(result.residual) / np.linalg.norm(y)),
        residual=result.residual,
        rows_in=rows_in,
        rows_used=len(y),
        recipe=recipe,
        condition=condition,
    )
