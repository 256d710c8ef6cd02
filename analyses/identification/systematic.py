"""Errors that all runs of a campaign share, and the intervals which they belong in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analyses.estimation.arrays import FloatArray
from analyses.identification.points import SteadyPoint
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


def half_widths(
    random_covariance: FloatArray, shared: FloatArray, freedom: int, coverage: float = 0.95
) -> FloatArray:
    """Half widths of the symmetric intervals that hold ``coverage`` of the joint errors, shape (p,).

    Propagated distributions (GUM Supplement 1): Student errors of the runs, uniform errors of the
    instruments.

    Parameters
    ----------
    random_covariance : array, shape (p, p)
        Of the coefficients, from the runs' own scatter.
    shared : array, shape (k, p)
        What the bound of each shared error does to the coefficients.
    freedom : int
        Degrees of freedom of the scatter.
    """
    student, uniform = _base(len(random_covariance), len(shared), max(freedom, 1), DRAWS)
    values, vectors = np.linalg.eigh(random_covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    total = student @ root.T
    if len(shared):
        total = total + uniform @ shared
    return np.asarray(np.quantile(np.abs(total), coverage, axis=0))
