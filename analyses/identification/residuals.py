"""Tests of residuals as in system identification: whiteness, and independence of the inputs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter
from scipy.stats import norm

from analyses.estimation.arrays import FloatArray, IntArray
from analyses.identification.joint_model import JointModel, RecordFit

LEVEL = 0.01
"""Probability with which chance alone leaves the bound at one lag or more."""
MOST_LAGS = 100


@dataclass(frozen=True, kw_only=True)
class ResidualTest:
    """Correlation of a record's innovations with an input, or (``whiteness``) with themselves.

    The innovations are what an autoregressive noise model leaves of the residual; an input has passed the
    same filter. Where they are white and independent, each
    correlation has the standard deviation ``1/sqrt(n)``; ``bound`` is left at any of the ``lags`` (rows) with
    a probability of 1 %.
    """

    record: str
    name: str
    input: str
    lags: IntArray = field(repr=False)
    correlation: FloatArray = field(repr=False)
    bound: float

    @property
    def largest(self) -> float:
        """The correlation of largest size."""
        return float(self.correlation[int(np.argmax(np.abs(self.correlation)))])

    @property
    def lag(self) -> int:
        """Rows by which the residual comes later there."""
        return int(self.lags[int(np.argmax(np.abs(self.correlation)))])

    @property
    def within(self) -> bool:
        """Whether every correlation is within the bound."""
        return abs(self.largest) <= self.bound


def residual_tests(model: JointModel) -> tuple[ResidualTest, ...]:
    """Whiteness of each record's residual, and independence of speed and acceleration.

    At lags up to a quarter of the rows, 100 at most. Source: L. Ljung, System Identification, 2nd ed.,
    section 16.6; pre-whitening: L. D. Haugh, J. Am. Stat. Assoc. 71 (1976).

    Notes
    -----
    Where the residual of the simulated record was taken off (`own_bias`), it is taken off here too.
    """
    return tuple(test for part in model.records for test in _of_record(part))


def _of_record(part: RecordFit) -> list[ResidualTest]:
    rest, reach = part.noise, min(len(part.noise) // 4, MOST_LAGS)
    if reach < 1 or not np.any(rest):
        return []
    inputs = {"speed": part.speed, "acceleration": part.acceleration}
    a = _whitening(rest)
    white, *others = (
        lfilter(a, [1.0], x)[len(a) - 1 :] for x in (rest, *(x[part.compared] for x in inputs.values()))
    )
    both = np.arange(-reach, reach + 1, dtype=np.int64)
    made = [_test(part.name, "whiteness", "", white, white, both[reach + 1 :])]
    pairs = zip(inputs, others, strict=True)
    return made + [_test(part.name, "independence", name, white, x, both) for name, x in pairs]


def _whitening(rest: FloatArray) -> FloatArray:
    """Coefficients of an autoregressive model of the highest order, 10 log10 n, by least squares."""
    order = min(int(10.0 * np.log10(len(rest))), len(rest) // 4)
    rows = np.lib.stride_tricks.sliding_window_view(rest, order + 1)[:, ::-1]
    return np.append(1.0, -np.linalg.lstsq(rows[:, 1:], rows[:, 0], rcond=None)[0])


def _test(
    record: str, name: str, of: str, innovations: FloatArray, values: FloatArray, lags: IntArray
) -> ResidualTest:
    e, u = (x - x.mean() for x in (innovations, values))
    size = float(np.linalg.norm(e) * np.linalg.norm(u)) or 1.0
    count = len(e)
    products = [float(e[max(k, 0) : count + min(k, 0)] @ u[max(-k, 0) : count - max(k, 0)]) for k in lags]
    bound = float(norm.isf(0.5 * (1.0 - (1.0 - LEVEL) ** (1.0 / len(lags)))) / np.sqrt(count))
    return ResidualTest(
        record=record, name=name, input=of, lags=lags, correlation=np.array(products) / size, bound=bound
    )
