"""Signals of a record made comparable, and how many times one is the other."""

from math import inf

import numpy as np
from scipy.signal import sosfiltfilt

from actuator_lti.design.model import Design
from actuator_lti.types import Floats
from analyses.estimation.least_squares import solve
from analyses.records.differentiation import butterworth
from analyses.records.finding import SURE
from analyses.records.record import Record

COSINE = 0.9  # cosine above which one signal is taken to be a multiple of the other
LEAST_ROWS = 10  # smoothed and thinned, of a comparison
SMOOTH_HZ = 20.0


def place_of(design: Design, record: Record) -> tuple[str, Floats] | None:
    """The position at the motor and the signal that it comes from; None where none is recorded."""
    for name in ("position",) if design.axis == "linear" else ("angle", "output_angle"):
        if name in record.signals:
            return name, record[name] * (design.total_ratio if name == "output_angle" else 1.0)
    return None


def ratio_of(y: Floats, x: Floats) -> tuple[float, float]:
    """Slope of y over x through zero, and how alike they are (cosine); zeros for a flat signal."""
    xx, yy = float(x @ x), float(y @ y)
    if xx == 0.0 or yy == 0.0:
        return 0.0, 0.0
    return float(x @ y) / xx, float(x @ y) / np.sqrt(xx * yy)


def smooth(record: Record, values: Floats) -> Floats:
    """A signal without its fast part, no phase; the same filter for all signals that are compared."""
    share = 2.0 * SMOOTH_HZ * record.period_s
    if share >= 0.5 or len(values) < 60:
        return values
    return np.asarray(sosfiltfilt(butterworth(2, share, output="sos"), values, padtype="even"))


def inner(record: Record) -> slice:
    """Without the twentieth part at both ends, where a filter starts and stops."""
    return slice(len(record) // 20, len(record) - len(record) // 20)


def thinned(record: Record, values: Floats) -> Floats:
    """As many rows of a smoothed signal as the filter leaves."""
    return values[:: max(1, round(0.25 / (SMOOTH_HZ * record.period_s)))]


def bounds(y: Floats, x: Floats, beside_x: Floats, beside_y: Floats) -> tuple[float, float]:
    """What y may be over x with noise in either: each regressed on the other, `SURE` errors wide (Frisch).

    Another signal stands beside the regressor: its own slope takes up a delay between the two.
    """

    def ends(of: Floats, over: Floats, beside: Floats) -> tuple[float, float]:
        w = np.column_stack([over, beside])
        size = np.linalg.norm(w, axis=0)
        result = solve(w / size, of)
        slope, error = result.values[0] / size[0], np.sqrt(result.correlated[0, 0]) / size[0]
        return float(slope - SURE * error), float(slope + SURE * error)

    low, high = ends(x, y, beside_y)
    if low <= 0.0 <= high:
        return -inf, inf
    all_ends = (*ends(y, x, beside_x), 1.0 / low, 1.0 / high)
    return min(all_ends), max(all_ends)
