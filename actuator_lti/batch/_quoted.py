"""The figures to quote from a row of figures, compiled: those of `LinearFigures.quantity` and of the page."""

# mypy: disallow-untyped-defs=False
import math

from actuator_lti.asked.quantities import MOST_RESONANCE_DB

from . import _figures as fig
from ._complex import copied

KERNELS = True

LOG_10 = 2.302585092994046
(
    GAIN_MARGIN, PHASE_MARGIN, DELAY_MARGIN, MODULUS_MARGIN, SENSITIVITY_PEAK, BANDWIDTH_HZ, BANDWIDTH_90DEG,
    RESONANCE_PEAK, OVERSHOOT_PERCENT, RISE_TIME, SETTLING_TIME, IS_STABLE,
) = range(12)  # fmt: skip
QUOTED = 12


def _decibel(ratio):
    return 20.0 * math.log(ratio) / LOG_10


def _margins(row, period, out):
    """Gain and phase margin nearest to zero, and the delay margin."""
    out[GAIN_MARGIN], out[PHASE_MARGIN], out[DELAY_MARGIN] = math.inf, math.inf, math.inf
    for k in range(min(int(row[fig.GAIN_CROSSOVERS]), fig.LISTED)):
        x, margin = row[fig.FIRST_GAIN + 2 * k], row[fig.FIRST_GAIN + 2 * k + 1]
        if abs(margin * 180.0 / math.pi) < abs(out[PHASE_MARGIN]):
            out[PHASE_MARGIN] = margin * 180.0 / math.pi
        turn = margin if margin > 0.0 else margin + 2.0 * math.pi
        out[DELAY_MARGIN] = min(out[DELAY_MARGIN], turn / x * period)
    for k in range(min(int(row[fig.PHASE_CROSSOVERS]), fig.LISTED)):
        margin = _decibel(row[fig.FIRST_PHASE + 2 * k + 1])
        if abs(margin) < abs(out[GAIN_MARGIN]):
            out[GAIN_MARGIN] = margin
    if row[fig.STABLE] != 1.0:
        out[DELAY_MARGIN] = 0.0


def quoted(row, period, out):
    """Write the figures to quote, in dB, deg, s, Hz and percent, in the order of `LOOP_QUANTITIES`."""
    _margins(row, period, out)
    out[MODULUS_MARGIN] = row[fig.MODULUS]
    out[SENSITIVITY_PEAK] = -_decibel(row[fig.MODULUS])
    out[BANDWIDTH_HZ] = row[fig.BANDWIDTH_X] / period / (2.0 * math.pi)
    out[BANDWIDTH_90DEG] = row[fig.QUARTER_X] / period / (2.0 * math.pi)
    peak = _decibel(row[fig.PEAK_T] / abs(row[fig.DC_GAIN])) if abs(row[fig.DC_GAIN]) > 0.0 else math.nan
    out[RESONANCE_PEAK] = max(peak, 0.0)
    if not peak <= MOST_RESONANCE_DB:  # the gain at zero frequency is no more than nothing
        out[RESONANCE_PEAK], out[BANDWIDTH_HZ], out[BANDWIDTH_90DEG] = math.nan, math.nan, math.nan
    out[RISE_TIME], out[OVERSHOOT_PERCENT] = row[fig.RISE] * period, row[fig.OVERSHOOT]
    out[SETTLING_TIME] = row[fig.SETTLING] * period
    out[IS_STABLE] = row[fig.STABLE]
    if row[fig.STABLE] != 1.0:
        for k in range(SENSITIVITY_PEAK, IS_STABLE):
            out[k] = math.nan
    if math.isnan(row[fig.STABLE]):  # withheld
        for k in range(QUOTED):
            out[k] = math.nan


def many_quoted(count, rows, periods, out, row, own):
    """The same of many rows one after the other; ``row`` and ``own`` lend their space."""
    for k in range(count):
        copied(fig.COLUMNS, rows, fig.COLUMNS * k, row, 0)
        quoted(row, periods[k], own)
        copied(QUOTED, own, 0, out, QUOTED * k)
