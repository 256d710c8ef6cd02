"""Refinement by simulation: the parameters with which the closed loop moves as the record did."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from actuator_lti.design import parameter_value, with_values
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import correlated_covariance

STEP = 1e-3
TOLERANCE = 1e-6
ITERATIONS = 24


@dataclass(frozen=True, kw_only=True)
class OutputErrorResult(Fit):
    """Refined values by dotted key, and the relative error before and after.

    These errors are those of the drive signal: norm of the difference over norm of the measured. The standard
    errors respect the correlation in time of what is left. ``at_bound`` are those that ended at the least or
    largest value of their key: the records want another, and no error of theirs holds.
    """

    error_before: float
    error_after: float
    iterations: int
    design: Design
    at_bound: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Moved:
    """Values (SI) with which an output fits best, its slopes over them, shape (n, p), and what is left."""

    values: FloatArray
    slopes: FloatArray
    rest: FloatArray
    first: FloatArray
    iterations: int
    at_bound: tuple[str, ...]


def fit_output(
    design: Design,
    paths: tuple[str, ...],
    output_of: Callable[[Design], FloatArray],
    measured: FloatArray,
    progress: Callable[[int, int], None] | None = None,
) -> Moved:
    """The values of some keys, within what each allows, with which an output of a design fits best.

    Least squares by a dogleg in a box (scipy), from the design's own values; the derivative is by central
    differences of 0.1 % of each value.
    """
    start = np.array([parameter_value(design, path) for path in paths])
    scale = np.array([_scale(design, path, value) for path, value in zip(paths, start, strict=True)])
    fields = [field_of(path) for path in paths]
    ends = np.array([(-np.inf, np.inf) if field is None else (field.low, field.high) for field in fields]).T
    count, most = 0, ITERATIONS * (2 * len(paths) + 1)

    def values_at(moved: FloatArray) -> FloatArray:
        return np.asarray(np.clip(start + scale * (moved - 1.0), *ends))

    def residual(moved: FloatArray) -> FloatArray:
        nonlocal count
        values = dict(zip(paths, values_at(moved).tolist(), strict=True))
        output = output_of(with_values(design, values, check=False))
        if output.shape != measured.shape:
            raise InputError(f"output and measurement have the shapes {output.shape} and {measured.shape}")
        count += 1
        if progress is not None:
            progress(min(count, most), most)
        return np.asarray(measured - output)

    begin = np.ones(len(paths))
    first = residual(begin)
    found = least_squares(
        residual,
        begin,
        jac="3-point",
        bounds=1.0 + (ends - start) / scale,
        method="dogbox",
        diff_step=STEP,
        xtol=TOLERANCE,
        max_nfev=ITERATIONS,
    )
    dead = np.flatnonzero(np.linalg.norm(found.jac, axis=0) <= 1e-12 * np.linalg.norm(found.fun))
    if len(dead):
        raise NumericalError(f"the output does not depend on {paths[int(dead[0])]}; leave it out")
    return Moved(
        values=values_at(found.x),
        slopes=found.jac / scale,
        rest=found.fun,
        first=first,
        iterations=int(found.njev),
        at_bound=tuple(path for path, side in zip(paths, found.active_mask, strict=True) if side),
    )


def refine_by_output_error(
    design: Design,
    paths: tuple[str, ...],
    simulate_output: Callable[[Design], FloatArray],
    measured: FloatArray,
    *,
    ends: Sequence[int] = (),
    progress: Callable[[int, int], None] | None = None,
) -> OutputErrorResult:
    """Refine values by key so that the simulated output fits the measured one, as `fit_output`.

    ``ends`` tell where each record ends in it.
    """
    found = fit_output(design, paths, simulate_output, measured, progress)
    norm = float(np.linalg.norm(measured))
    values = dict(zip(paths, found.values.tolist(), strict=True))
    return OutputErrorResult(
        names=paths,
        values=found.values,
        covariance=correlated_covariance(found.slopes, found.rest, ends),
        error_before=float(np.linalg.norm(found.first)) / norm,
        error_after=float(np.linalg.norm(found.rest)) / norm,
        iterations=found.iterations,
        design=with_values(design, values, check=False),
        at_bound=found.at_bound,
    )


def _scale(design: Design, path: str, start: float) -> float:
    """What a parameter is measured by: its start, or where that is zero a part of a like one."""
    if start != 0.0:
        return abs(start)
    period, friction = design.controller.period_s, design.friction
    stiffness = 0.0 if design.coupling is None else design.coupling.stiffness_Nm_rad
    like = {
        "friction.offset_torque": 0.1 * friction.dry_torque_Nm,
        "friction.dry_torque": 0.01 * abs(friction.offset_torque_Nm),
        "friction.viscous": 0.1 * design.inertia_kgm2,
        "coupling.damping": stiffness * period,
        "control.computing_delay": period,
    }.get(path, 0.0)
    if like == 0.0:
        raise InputError(f"{path} = 0: a fit needs a start that is not zero")
    return like
