"""Errors that all runs of a campaign share, the intervals that hold them, and runs that do not belong."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analyses.estimation.arrays import FloatArray
from analyses.identification.steady import SteadyPoint
from analyses.records.campaign_file import Instruments

DRAWS = 1 << 15


@dataclass(frozen=True, kw_only=True)
class SharedError:
    """One error, uniform within +-1 times ``effect``: what its bound adds to each run's torque, N m."""

    name: str
    effect: FloatArray


def shared_errors(
    points: tuple[SteadyPoint, ...],
    instruments: Instruments,
    load_coefficient: float,
    torque_constant_Nm_A: float,
) -> tuple[SharedError, ...]:
    """The shared errors of a campaign's instruments; those whose bound is zero are left out.

    The torque sensor's error is a straight line over the load between independent errors at zero and at full
    scale, each within the stated accuracy, so that the whole stays within it. Runs with a disconnected clutch
    do not use it.
    """
    torque = np.array([p.torque_Nm for p in points])
    direction = np.array([float(p.direction) for p in points])
    used = np.array([0.0 if p.load_is_zero else 1.0 for p in points])
    share = np.array([p.load_Nm for p in points]) / instruments.torque_full_scale_Nm
    bound = instruments.torque_accuracy * instruments.torque_full_scale_Nm * load_coefficient
    candidates = (
        SharedError(name="current gain", effect=instruments.current_gain * torque),
        SharedError(name="torque constant", effect=instruments.torque_constant * torque),
        SharedError(
            name="current offset", effect=instruments.current_offset_A * torque_constant_Nm_A * direction
        ),
        SharedError(name="torque sensor at zero", effect=-bound * used * (1.0 - share)),
        SharedError(name="torque sensor at full scale", effect=-bound * used * share),
    )
    return tuple(error for error in candidates if np.any(error.effect != 0.0))


def effects_of(errors: tuple[SharedError, ...], runs: int) -> FloatArray:
    """The effects of all errors as columns, shape (runs, errors)."""
    return np.array([error.effect for error in errors]).reshape(len(errors), runs).T


@lru_cache(maxsize=8)
def _base(normals: int, uniforms: int, freedom: int, draws: int) -> tuple[FloatArray, FloatArray]:
    """Student draws (unit scale, jointly) and uniform draws; fixed, so that results repeat exactly."""
    rng = np.random.default_rng(20240601)
    normal = rng.standard_normal((draws, normals))
    student = normal / np.sqrt(rng.chisquare(freedom, (draws, 1)) / freedom)
    return student, rng.uniform(-1.0, 1.0, (draws, uniforms))


def half_widths(random_covariance: FloatArray, shared: FloatArray, freedom: int) -> FloatArray:
    """Half widths of the symmetric intervals that hold 95 % of the joint errors, shape (p,).

    Propagated distributions (GUM Supplement 1): Student errors of the runs, of that freedom, with their
    covariance, shape (p, p); uniform errors of the instruments, whose bounds move the coefficients by the
    rows of ``shared``, shape (k, p).
    """
    student, uniform = _base(len(random_covariance), len(shared), max(freedom, 1), DRAWS)
    values, vectors = np.linalg.eigh(random_covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    total = student @ root.T
    if len(shared):
        total = total + uniform @ shared
    return np.asarray(np.quantile(np.abs(total), 0.95, axis=0))


LEVEL = 0.01


@dataclass(frozen=True, kw_only=True)
class FoundOutliers:
    """Rows and their residuals in robust standard deviations, and the limit which they exceed."""

    rows: tuple[int, ...]
    standardised: FloatArray
    limit: float


def find_outliers(x: FloatArray, y: FloatArray, variance: FloatArray, shared: FloatArray) -> FoundOutliers:
    """Rows whose residual from a robust fit is too large.

    Huber's estimate, started from least absolute deviations, on rows divided by their standard deviation;
    the scale is the median absolute deviation, but not less than what the rows' own noise gives. The limit
    is the normal quantile for a false alarm in 1 % of all campaigns (Bonferroni). The shared errors, shape
    (n, k), are estimated along with the coefficients, within their bounds, so that an error of an
    instrument does not make outliers of all runs that used it.
    """
    from scipy.stats import norm

    w = 1.0 / np.sqrt(variance)
    a = with_shared(x * w[:, None], shared * w[:, None])
    b = np.concatenate([y * w, np.zeros(shared.shape[1])])
    weight = np.ones(len(b))
    scale = 1.0
    rest = b
    for step in range(30):
        root = np.sqrt(weight)
        rest = b - a @ np.linalg.lstsq(a * root[:, None], b * root, rcond=None)[0]
        scale = max(1.4826 * float(np.median(np.abs(rest[: len(y)]))), 1.0)
        size = np.maximum(np.abs(rest[: len(y)]) / scale, 1e-6)
        weight[: len(y)] = 1.0 / size if step < 15 else np.minimum(1.0, 1.345 / size)
    limit = float(norm.isf(0.5 * LEVEL / len(y)))
    standardised = rest[: len(y)] / scale
    rows = np.flatnonzero(np.abs(standardised) > limit)
    return FoundOutliers(rows=tuple(int(k) for k in rows), standardised=standardised[rows], limit=limit)


def with_shared(x: FloatArray, shared: FloatArray) -> FloatArray:
    """Regressors beside the shared errors, and a row for each shared error that holds it to its bound.

    The unknowns that belong to the columns of ``shared`` have a variance of 1/3, that of a uniform error
    within its bound.
    """
    held = np.zeros((shared.shape[1], x.shape[1] + shared.shape[1]))
    held[:, x.shape[1] :] = np.sqrt(3.0) * np.eye(shared.shape[1])
    return np.vstack([np.column_stack([x, shared]), held])
