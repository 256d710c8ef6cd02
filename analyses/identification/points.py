"""The runs of a campaign as points: means of steady parts, errors that all share, runs that do not fit."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.stats import norm

from actuator_lti.types import Floats
from analyses.estimation.series import correlated_means
from analyses.records.campaign_file import Instruments
from analyses.records.campaign_import import ImportedRun
from analyses.records.single_rows import NORMAL
from analyses.records.steady_window import SteadyWindow, find_steady_window

DRAWS = 1 << 15
LEVEL = 0.01  # probability of a false alarm in a campaign


@dataclass(frozen=True, kw_only=True)
class SteadyPoint:
    """Means over the steady part of one run, torque and speed positive in the direction of the motion."""

    run: str
    direction: int  # +1 or -1
    torque_Nm: float  # kM i
    speed_rad_s: float
    load_Nm: float  # magnitude |M_ext|
    covariance: Floats  # of the means of torque, speed and load, (3, 3), by their correlation in time
    window: SteadyWindow
    samples: int
    correlation_samples: tuple[float, ...]
    load_is_zero: bool


def steady_point(run: ImportedRun, torque_constant_Nm_A: float) -> SteadyPoint:
    """Average the steady part of one run; M = kM i (paper, section 3)."""
    record = run.record
    load = np.zeros(len(record.time_s)) if run.load_is_zero else record["torque"]
    window = find_steady_window(record.time_s, record["speed"], load=load)
    part, load = record.slice(window.start, window.stop), load[window.start : window.stop]
    speed = part["speed"]
    direction, side = 1 if speed.mean() > 0.0 else -1, 1.0 if load.mean() >= 0.0 else -1.0
    torque = direction * torque_constant_Nm_A * part["current"]
    means = correlated_means(np.column_stack([torque, direction * speed, side * load]))
    mean_torque, mean_speed, mean_load = means.values.tolist()
    return SteadyPoint(
        run=run.id,
        direction=direction,
        torque_Nm=mean_torque,
        speed_rad_s=mean_speed,
        load_Nm=mean_load,
        covariance=means.covariance,
        window=window,
        samples=len(speed),
        correlation_samples=tuple(means.correlation_samples.tolist()),
        load_is_zero=run.load_is_zero,
    )


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
