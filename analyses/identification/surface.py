"""The friction surface M = C0 + Cv w + CM |M_ext| through the points of a campaign (paper, equation 9)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import brentq

from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fixed
from analyses.estimation.least_squares import told_apart
from analyses.identification.shared_errors import (
    SharedError,
    effects_of,
    find_outliers,
    half_widths,
    shared_errors,
)
from analyses.identification.steady import SteadyPoint
from analyses.identification.surface_fit import NAMES, Outlier, SurfaceFit
from analyses.records.campaign_file import Instruments

ITERATIONS = 6


def fit_surface(
    points: Sequence[SteadyPoint],
    instruments: Instruments,
    torque_constant_Nm_A: float,
    *,
    outliers: str = "keep",
    fixed: Mapping[str, float] | None = None,
    kept: Mapping[str, float] | None = None,
) -> SurfaceFit:
    """Fit the surface by generalised least squares with errors in all variables.

    The weight of a run comes from the covariance of its means of torque, speed and load, moved to the
    torque by the slopes of the surface (effective variance, iterated), plus the scatter between runs where
    they do not agree within their noise (Mandel and Paule). The shared errors of the instruments enter the
    covariance as they act: on all runs together. ``torque_constant_Nm_A`` made the torques; ``fixed``
    coefficients are held, ``kept`` are values that those keep which the runs do not tell apart (without
    them: an error).
    """
    used = tuple(points)
    held = _held(used, dict(fixed or {}), kept)
    names = tuple(point.run for point in used)
    x, y = _table(used)
    start = _ordinary(x, y, held)
    errors = shared_errors(used, instruments, start[2], torque_constant_Nm_A)
    free, rest = _free(x, y, held)
    result = find_outliers(free, rest, _own_variance(used, start), effects_of(errors, len(y)))
    named = tuple(
        Outlier(
            run=names[k], standardised=float(value), limit=result.limit, set_aside=outliers == "set-aside"
        )
        for k, value in zip(result.rows, result.standardised, strict=True)
    )
    if outliers == "set-aside" and named:
        used = tuple(point for k, point in enumerate(used) if k not in set(result.rows))
        held = _held(used, dict(fixed or {}), kept)
    return _fitted(used, instruments, torque_constant_Nm_A, named, held)


def _fitted(
    points: tuple[SteadyPoint, ...],
    instruments: Instruments,
    torque_constant: float,
    named: tuple[Outlier, ...],
    held: Mapping[str, Fixed],
) -> SurfaceFit:
    x, y = _table(points)
    free, rest = _free(x, y, held)
    told = [k for k, name in enumerate(NAMES) if name not in held]
    theta, scatter, birge = _ordinary(x, y, held), 0.0, 1.0
    shared: tuple[SharedError, ...] = ()
    for _ in range(ITERATIONS):
        own = _own_variance(points, theta)
        shared = shared_errors(points, instruments, theta[2], torque_constant)
        scatter, birge = _run_scatter(free, rest, own, shared)
        gain = np.zeros((len(NAMES), len(y)))
        gain[told] = gain_matrix(free, torque_covariance(own + scatter, shared))
        change = np.zeros(len(NAMES))
        change[told] = gain[told] @ rest - theta[told]
        theta = theta + change
        if np.all(np.abs(change) <= 1e-12 * np.abs(theta)):
            break
    variance = own + scatter
    freedom = len(y) - len(told)
    random_covariance = (gain * variance) @ gain.T
    shifts = {error.name: gain @ error.effect for error in shared}
    moved = np.array(list(shifts.values())).reshape(len(shifts), len(theta))
    return SurfaceFit(
        points=points,
        names=NAMES,
        values=theta,
        covariance=random_covariance + moved.T @ moved / 3.0,
        random_covariance=random_covariance,
        shared_shifts=shifts,
        half_widths=half_widths(random_covariance, moved, freedom),
        shared_effects=effects_of(shared, len(y)),
        residuals_Nm=y - x @ theta,
        own_residuals_Nm=_own_residuals(y - x @ theta, variance, effects_of(shared, len(y))),
        residual_stds_Nm=np.sqrt(variance),
        run_scatter_Nm=float(np.sqrt(scatter)),
        birge_ratio=birge,
        outliers=named,
        freedom=freedom,
        fixed=dict(held),
    )


def _table(points: tuple[SteadyPoint, ...]) -> tuple[FloatArray, FloatArray]:
    x = np.array([[1.0, p.speed_rad_s, p.load_Nm] for p in points])
    return x, np.array([p.torque_Nm for p in points])


def _held(
    points: tuple[SteadyPoint, ...], fixed: Mapping[str, float], kept: Mapping[str, float] | None
) -> dict[str, Fixed]:
    """What is not fitted: what was asked for, and what the runs do not tell apart."""
    held = {name: Fixed(value=value, reason="fixed as asked") for name, value in fixed.items()}
    names = [name for name in NAMES if name not in held]
    if not names:
        raise InputError("C0, Cv and CM are all fixed: nothing is left to identify")
    if kept is None or not points:
        _check_count(points, len(names))
    x, _ = _table(points)
    _, left = told_apart(x[:, [NAMES.index(name) for name in names]], names)
    if left and kept is None:
        raise NumericalError(
            "the runs do not tell C0, Cv and CM apart: vary speed and load, not together only"
        )
    for one in left:
        why = "no run is loaded" if one.name == "CM" and not one.like else str(one)
        held[one.name] = Fixed(value=(kept or {})[one.name], reason=f"{why}: the design's value kept")
    _check_count(points, len(NAMES) - len(held))
    return held


def _check_count(points: tuple[SteadyPoint, ...], coefficients: int) -> None:
    """Two runs more than coefficients."""
    words = {3: "three coefficients", 2: "two coefficients", 1: "one coefficient"}[coefficients]
    if len(points) < coefficients + 2:
        raise InputError(f"{len(points)} usable runs: at least {coefficients + 2} are needed for {words}")


def _free(x: FloatArray, y: FloatArray, held: Mapping[str, Fixed]) -> tuple[FloatArray, FloatArray]:
    """The columns that are fitted, and the torques less what is held."""
    told = [k for k, name in enumerate(NAMES) if name not in held]
    rest = y - sum((one.value * x[:, NAMES.index(name)] for name, one in held.items()), np.zeros(len(y)))
    return x[:, told], np.asarray(rest)


def _ordinary(x: FloatArray, y: FloatArray, held: Mapping[str, Fixed]) -> FloatArray:
    free, rest = _free(x, y, held)
    theta = np.array([held[name].value if name in held else 0.0 for name in NAMES])
    told = [k for k, name in enumerate(NAMES) if name not in held]
    theta[told] = np.linalg.lstsq(free, rest, rcond=None)[0]
    return theta


def _own_variance(points: tuple[SteadyPoint, ...], theta: FloatArray) -> FloatArray:
    """Variance of each run's residual from its own noise: the covariance of its means along (1, -Cv, -CM)."""
    along = np.array([1.0, -theta[1], -theta[2]])
    own = np.array([along @ p.covariance @ along for p in points])
    return np.maximum(own, 1e-8 * float(np.median(own)) + 1e-30)


def _own_residuals(rest: FloatArray, variance: FloatArray, effects: FloatArray) -> FloatArray:
    """Residuals less the most likely shared errors, which bend them together (best linear prediction)."""
    if not effects.shape[1]:
        return rest
    scaled = effects / variance[:, None]
    likely = np.linalg.solve(3.0 * np.eye(effects.shape[1]) + effects.T @ scaled, scaled.T @ rest)
    return np.asarray(rest - effects @ likely)


def torque_covariance(variance: FloatArray, shared: tuple[SharedError, ...]) -> FloatArray:
    """Covariance of the torques: each run's own, and the shared errors (a third of the bound squared)."""
    effects = effects_of(shared, len(variance))
    return np.asarray(np.diag(variance) + effects @ effects.T / 3.0)


def gain_matrix(x: FloatArray, covariance: FloatArray) -> FloatArray:
    """The matrix that makes the coefficients of the torques: (X' V^-1 X)^-1 X' V^-1."""
    whitened = np.linalg.solve(covariance, x)
    return np.asarray(np.linalg.solve(x.T @ whitened, whitened.T))


def _run_scatter(
    x: FloatArray, y: FloatArray, own: FloatArray, shared: tuple[SharedError, ...]
) -> tuple[float, float]:
    """Variance between runs that makes chi-square equal its freedom, and the Birge ratio without it."""
    freedom = len(y) - x.shape[1]

    def chi_square(extra: float) -> float:
        covariance = torque_covariance(own + extra, shared)
        rest = y - x @ (gain_matrix(x, covariance) @ y)
        return float(rest @ np.linalg.solve(covariance, rest))

    first = chi_square(0.0)
    birge = float(np.sqrt(first / freedom))
    if first <= freedom:
        return 0.0, birge
    most = 10.0 * float(np.var(y - x @ np.linalg.lstsq(x, y, rcond=None)[0])) + float(np.max(own))
    return float(brentq(lambda extra: chi_square(extra) - freedom, 0.0, most, xtol=1e-9 * most)), birge
