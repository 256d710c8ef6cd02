"""Tests of residuals as in system identification: whiteness, and independence of the inputs."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import correlate, lfilter
from scipy.stats import norm

from actuator_lti.types import Floats, Ints
from analyses.identification.joint_model import JointModel, RecordFit

LEVEL = 0.01  # probability with which chance alone leaves the bound at one lag or more
MOST_LAGS = 100
NAMES = "whiteness", "independence"  # of the noise itself, of an input


@dataclass(frozen=True)
class ResidualTest:
    """Correlation of a record's innovations with an input, or (``whiteness``) with themselves.

    The innovations are what an autoregressive noise model leaves of the residual; an input has passed the
    same filter. Where they are white and independent, each correlation has the standard deviation
    ``1/sqrt(n)``.
    """

    record: str
    name: str
    input: str
    lags: Ints = field(repr=False)  # rows
    correlation: Floats = field(repr=False)
    bound: float  # left at any of the lags with a probability of 1 %
    rows: int = field(repr=False)  # of innovations

    @property
    def largest(self) -> float:
        """The correlation of largest size."""
        return float(self.correlation[int(np.argmax(np.abs(self.correlation)))])

    @property
    def lag(self) -> int:
        """Rows by which the residual comes later there."""
        return int(self.lags[int(np.argmax(np.abs(self.correlation)))])

    @property
    def chance(self) -> float:
        """Probability of a correlation of that size at one lag or more, where it is chance."""
        one = float(norm.sf(abs(self.largest) * np.sqrt(self.rows)))
        return float(-np.expm1(len(self.lags) * np.log1p(-2.0 * one)))

    @property
    def within(self) -> bool:
        """Whether every correlation is within the bound."""
        return abs(self.largest) <= self.bound


def residual_tests(model: JointModel) -> tuple[ResidualTest, ...]:
    """Whiteness of each record's residual, and independence of speed and acceleration.

    At lags up to a quarter of the rows, 100 at most. Source: L. Ljung, System Identification, 2nd ed.,
    section 16.6; pre-whitening: L. D. Haugh, J. Am. Stat. Assoc. 71 (1976). Where the residual of the
    simulated record was taken off (`own_bias`), it is taken off here too.
    """
    return tuple(test for part in model.records for test in _of_record(part))


def _of_record(part: RecordFit) -> Iterator[ResidualTest]:
    rest, reach = part.noise, min(len(part.noise) // 4, MOST_LAGS)
    if reach < 1 or not np.any(rest):
        return
    order = min(int(10.0 * np.log10(len(rest))), len(rest) // 4)  # the highest, by least squares
    rows = np.lib.stride_tricks.sliding_window_view(rest, order + 1)[:, ::-1]
    a = np.append(1.0, -np.linalg.lstsq(rows[:, 1:], rows[:, 0], rcond=None)[0])
    both = np.arange(-reach, reach + 1, dtype=np.int64)
    speed, acceleration = part.inputs[part.compared].T
    inputs = {"": rest, "speed": speed, "acceleration": acceleration}
    white, *_ = made = [lfilter(a, [1.0], x)[order:] for x in inputs.values()]
    for of, x in zip(inputs, made, strict=True):
        lags = both if of else both[reach + 1 :]
        e, u = white - white.mean(), x - x.mean()
        size, count = float(np.linalg.norm(e) * np.linalg.norm(u)) or 1.0, len(e)
        found = correlate(e, u)[count - 1 + lags] / size
        bound = float(norm.isf(0.5 * (1.0 - (1.0 - LEVEL) ** (1.0 / len(lags)))) / np.sqrt(count))
        yield ResidualTest(part.name, NAMES[bool(of)], of, lags, found, bound, count)
