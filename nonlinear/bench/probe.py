"""An instrument in the loop, as a frequency response analyser is connected on a bench."""

from dataclasses import dataclass
from math import floor
from typing import Literal

import numpy as np

from actuator_lti.errors import InputError, finite_number
from actuator_lti.start.public_arguments import asked
from actuator_lti.types import Floats
from nonlinear._kernels import layout as at
from nonlinear.commands import Command

Point = Literal["u", "i_ref", "w_ref", "output"]


@asked
@dataclass(frozen=True, kw_only=True)
class Probe:
    """Break point of a loop: ``after = gain * delayed(before) + injection``, held to the stage's limit.

    ``point``: voltage ``"u"`` (V), current command ``"i_ref"`` (A), speed command ``"w_ref"`` (rad/s, motor),
    or the measured output angle ``"output"`` (rad at the output shaft) on its way to the position controller.
    ``injection``: signal added, in the unit of the point; an array has one value a tick.
    ``gain``: factor on the loop gain.
    ``delay_samples``: extra delay in samples of the rate at which the point is updated: the base tick at
    ``u`` behind a current loop, n_v ticks at ``i_ref``, n_p ticks at ``w_ref`` and ``output``.  A whole
    number is exact; a fraction goes through a Lagrange interpolator of 2, 4 or 6 samples
    (`fractional_delay`).

    The sign of the loop lies elsewhere, so with all other commands at rest ``before = -L after`` with L the
    open loop seen at the point, and ``-before/injection`` is L/(1 + L).
    """

    point: Point
    injection: Command | Floats | None = None
    gain: float = 1.0
    delay_samples: float = 0.0

    def __post_init__(self) -> None:
        finite_number("probe gain", self.gain, "finite, a plain factor")
        if finite_number("probe delay_samples", self.delay_samples, "zero or more, finite") < 0.0:
            raise InputError(f"probe delay_samples = {self.delay_samples}: must be zero or more")
        if not (isinstance(self.injection, Command | None) or np.isfinite(self.injection).all()):
            raise InputError(f"probe at {self.point}: injection holds values that are not finite")


def fractional_delay(delay_samples: float) -> tuple[int, Floats]:
    """Whole samples before the first tap, and the taps, of a delay.

    Lagrange interpolation of degree 1 (delay below 1), 3 (below 2) or 5, its fraction in the middle of
    the taps where that is causal; the error at frequency w is about ``(w T/2)^(degree + 1)``.

    >>> whole, taps = fractional_delay(0.25)
    >>> whole, taps.tolist()
    (0, [0.75, 0.25])
    """
    whole = floor(delay_samples)
    if delay_samples == whole:
        return whole, np.ones(1)
    lead = min(whole, 2)
    degree = 2 * lead + 1
    d = delay_samples - whole + lead
    nodes = np.arange(degree + 1)
    taps = np.array([np.prod([(d - n) / (k - n) for n in nodes if n != k]) for k in nodes])
    return whole - lead, taps


def write_probe(probe: Probe, row: Floats) -> int:
    """Write gain and delay into a parameter row; returns the place of the injection."""
    place = at.PROBES + at.POINTS.index(probe.point) * at.PROBE_SIZE
    row[place + at.PROBE_ON], row[place + at.PROBE_GAIN] = 1.0, probe.gain
    if probe.delay_samples > 0.0:
        whole, taps = fractional_delay(probe.delay_samples)
        row[place + at.PROBE_DELAY], row[place + at.PROBE_TAPS] = whole, taps.size
        row[place + at.PROBE_TAP : place + at.PROBE_TAP + taps.size] = taps
    return place + at.PROBE_SIGNAL
