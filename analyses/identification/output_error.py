"""Refinement by simulation: the parameters with which the closed loop moves as the record did."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.design import parameter_value, with_values
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import correlated_covariance

STEP = 1e-3
TOLERANCE = 1e-6
ITERATIONS = 12


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


def refine_by_output_error(
    design: Design,
    paths: tuple[str, ...],
    simulate_output: Callable[[Design], FloatArray],
    measured: FloatArray,
    *,
    ends: Sequence[int] = (),
    progress: Callable[[int, int], None] | None = None,
) -> OutputErrorResult:
    """Refine parameters so that the simulated output fits the measured one in the least-squares sense.

    Gauss-Newton with halved steps, starting from the design's own values (an inverse-model estimate). The
    derivative is by central differences of 0.1 % of each value.

    Parameters
    ----------
    design : Design
        Holds the starting values.
    paths : tuple of str
        Dotted keys to refine.
    simulate_output : callable
        Gives the output for a design, sampled as ``measured``; see `analyses.correlation.closed_loop`.
    measured : array, shape (n,)
    ends : sequence of int, optional
        Where each record ends in it.

    Raises
    ------
    InputError
        For outputs of different shape, or where all starting values are zero (then there is no scale).
    NumericalError
        If the output does not depend on a parameter.
    """
    start = np.array([parameter_value(design, path) for path in paths])
    scale = np.array([_scale(design, path, value) for path, value in zip(paths, start, strict=True)])

    def values_at(moved: FloatArray) -> dict[str, float]:
        result = start + scale * (moved - 1.0)
        return {path: _allowed(path, float(v)) for path, v in zip(paths, result, strict=True)}

    def within(moved: FloatArray) -> FloatArray:
        return 1.0 + (np.array(list(values_at(moved).values())) - start) / scale

    def residual(moved: FloatArray) -> FloatArray:
        output = simulate_output(with_values(design, values_at(moved), check=False))
        if output.shape != measured.shape:
            raise InputError(f"output and measurement have the shapes {output.shape} and {measured.shape}")
        return np.asarray(measured - output)

    p, rest, jac, iterations, first = _gauss_newton(residual, within, paths, progress)
    covariance = correlated_covariance(jac, rest, ends) * np.outer(scale, scale)
    values = values_at(p)
    norm = float(np.linalg.norm(measured))
    return OutputErrorResult(
        names=paths,
        values=np.array(list(values.values())),
        covariance=covariance,
        error_before=float(np.linalg.norm(first)) / norm,
        error_after=float(np.linalg.norm(rest)) / norm,
        iterations=iterations,
        design=with_values(design, values, check=False),
        at_bound=tuple(path for path, value in values.items() if _allowed(path, value, 1e-9) != value),
    )


def _gauss_newton(
    residual: Callable[[FloatArray], FloatArray],
    within: Callable[[FloatArray], FloatArray],
    paths: tuple[str, ...],
    progress: Callable[[int, int], None] | None,
) -> tuple[FloatArray, FloatArray, FloatArray, int, FloatArray]:
    p = np.ones(len(paths))
    rest = first = residual(p)
    jac = np.zeros((len(rest), len(p)))
    iteration = 0
    for iteration in range(1, ITERATIONS + 1):
        for k in range(len(p)):
            h = np.zeros(len(p))
            h[k] = STEP
            jac[:, k] = (residual(p + h) - residual(p - h)) / (2.0 * STEP)
        dead = np.flatnonzero(np.linalg.norm(jac, axis=0) <= 1e-12 * np.linalg.norm(rest))
        if len(dead):
            raise NumericalError(f"the output does not depend on {paths[int(dead[0])]}; leave it out")
        change = np.asarray(-np.linalg.lstsq(jac, rest, rcond=None)[0])
        p, rest, moved = _halved_step(residual, within, p, rest, change)
        if progress is not None:
            progress(iteration, ITERATIONS)
        if not moved or np.max(np.abs(change)) < TOLERANCE:
            break
    return p, rest, jac, iteration, first


def _halved_step(
    residual: Callable[[FloatArray], FloatArray],
    within: Callable[[FloatArray], FloatArray],
    p: FloatArray,
    rest: FloatArray,
    change: FloatArray,
) -> tuple[FloatArray, FloatArray, bool]:
    """The longest of the full, half, quarter ... steps, within bounds, that makes the residual smaller."""
    for _ in range(8):
        tried = residual(within(p + change))
        if np.linalg.norm(tried) < np.linalg.norm(rest):
            return within(p + change), tried, True
        change = 0.5 * change
    return p, rest, False


def _scale(design: Design, path: str, start: float) -> float:
    """What a parameter is measured by: its start, or where that is zero a part of a like one."""
    if start != 0.0:
        return abs(start)
    like = {
        "friction.offset_torque": 0.1 * design.friction.dry_torque_Nm,
        "friction.dry_torque": 0.01 * abs(design.friction.offset_torque_Nm),
    }.get(path, 0.0)
    if like == 0.0:
        raise InputError(f"{path} = 0: a refinement by simulation needs a start that is not zero")
    return like


def _allowed(path: str, value: float, off: float = 0.0) -> float:
    """A tried value, kept within what its key allows (and ``off`` its ends)."""
    field = field_of(path)
    return value if field is None else min(max(value, field.low + off), field.high - off)
