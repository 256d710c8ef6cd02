"""Errors that all runs of a campaign share, the intervals that hold them, and runs that do not belong."""

from functools import lru_cache

import numpy as np
from scipy.stats import norm

from actuator_lti.types import Floats
from analyses.identification.steady import SteadyPoint
from analyses.records.campaign_file import Instruments
from analyses.records.single_rows import NORMAL

DRAWS = 1 << 15
LEVEL = 0.01  # probability of a false alarm in a campaign


def shared_errors(
    points: tuple[SteadyPoint, ...], instruments: Instruments, load_coefficient: float, kM: float
) -> tuple[tuple[str, ...], Floats]:
    """Names of the shared errors, and what the bound of each adds to each run's torque, N m, (runs, errors).

    An error is uniform within its bounds; those whose bound is zero are left out. The torque sensor's error
    is a straight line over the load between independent errors at zero and at full scale, each within the
    stated accuracy, so that the whole stays within it. Runs with a disconnected clutch do not use it.
    """
    torque = np.array([p.torque_Nm for p in points])
    direction = np.array([float(p.direction) for p in points])
    used = np.array([0.0 if p.load_is_zero else 1.0 for p in points])
    share = np.array([p.load_Nm for p in points]) / instruments.torque_full_scale_Nm
    bound = instruments.torque_accuracy * instruments.torque_full_scale_Nm * load_coefficient
    effects = {
        "current gain": instruments.current_gain * torque,
        "torque constant": instruments.torque_constant * torque,
        "current offset": instruments.current_offset_A * kM * direction,
        "torque sensor at zero": -bound * used * (1.0 - share),
        "torque sensor at full scale": -bound * used * share,
    }
    acting = {name: effect for name, effect in effects.items() if np.any(effect != 0.0)}
    return tuple(acting), np.array(list(acting.values())).reshape(len(acting), len(points)).T


@lru_cache(maxsize=8)
def _base(normals: int, uniforms: int, freedom: int) -> tuple[Floats, Floats]:
    """Student draws (unit scale, jointly) and uniform draws; fixed, so that results repeat exactly."""
    rng = np.random.default_rng(20240601)
    normal = rng.standard_normal((DRAWS, normals))
    student = normal / np.sqrt(rng.chisquare(freedom, (DRAWS, 1)) / freedom)
    return student, rng.uniform(-1.0, 1.0, (DRAWS, uniforms))


def half_widths(random_covariance: Floats, shared: Floats, freedom: int) -> Floats:
    """Half widths of the symmetric intervals that hold 95 % of the joint errors, shape (p,).

    Propagated distributions (GUM Supplement 1): Student errors of the runs, of that freedom, with their
    covariance, shape (p, p); uniform errors of the instruments, whose bounds move the coefficients by the
    rows of ``shared``, shape (k, p).
    """
    student, uniform = _base(len(random_covariance), len(shared), max(freedom, 1))
    values, vectors = np.linalg.eigh(random_covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(np.quantile(np.abs(student @ root.T + uniform @ shared), 0.95, axis=0))


def standardised(x: Floats, y: Floats, variance: Floats, shared: Floats) -> tuple[Floats, float]:
    """Residuals of a robust fit in robust standard deviations, and the limit beyond which a run is no part.

    Huber's estimate, started from least absolute deviations, on rows divided by their standard deviation;
    the scale is the median absolute deviation, but not less than what the rows' own noise gives. The limit
    is the normal quantile for a false alarm in 1 % of all campaigns (Bonferroni). The shared errors, shape
    (n, k), are estimated along with the coefficients, within their bounds, so that an error of an
    instrument does not make outliers of all runs that used it.
    """
    w, count = 1.0 / np.sqrt(variance), len(y)
    a = with_shared(x * w[:, None], shared * w[:, None])
    b = np.concatenate([y * w, np.zeros(shared.shape[1])])
    weight = np.ones(len(b))
    for step in range(30):
        root = np.sqrt(weight)
        rest = (b - a @ np.linalg.lstsq(a * root[:, None], b * root, rcond=None)[0])[:count]
        scale = max(NORMAL * float(np.median(np.abs(rest))), 1.0)
        size = np.maximum(np.abs(rest) / scale, 1e-6)
        weight[:count] = 1.0 / size if step < 15 else np.minimum(1.0, 1.345 / size)
    return rest / scale, float(norm.isf(0.5 * LEVEL / count))


def with_shared(x: Floats, shared: Floats) -> Floats:
    """Regressors beside the shared errors, and a row for each shared error that holds it to its bound.

    The unknowns that belong to the columns of ``shared`` have a variance of 1/3, that of a uniform error
    within its bound.
    """
    count = shared.shape[1]
    held = np.column_stack([np.zeros((count, x.shape[1])), np.sqrt(3.0) * np.eye(count)])
    return np.vstack([np.column_stack([x, shared]), held])
