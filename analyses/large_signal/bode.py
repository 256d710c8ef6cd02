"""Frequency response at several amplitudes, and bandwidth against amplitude, read from the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.design.model import Design
from analyses.large_signal.classify import WAVEFORMS
from analyses.large_signal.map import AmplitudeMap
from analyses.large_signal.steady_start import linear_steady_state

if TYPE_CHECKING:
    from actuator_lti.loops import Loops

FINE = 64  # points between two frequencies of the map, at which the linear response is known
MINUS_3DB = 20.0 * math.log10(math.sqrt(0.5))


@dataclass(frozen=True)
class AmplitudeBode:
    """Responses at the amplitudes that a design asks for, and how the bandwidth falls with amplitude.

    Attributes
    ----------
    load_Nm : float
    frequency_hz : ndarray, shape (f,)
    fractions : tuple of float
        Of full deflection; those of the design that the map has.
    amplitude_rad : ndarray, shape (k,)
    gain_db, phase_deg : ndarray, shape (k, f)
        Of the fundamental; -inf and NaN where nothing moves, NaN where it did not settle.
    linear_db, linear_deg : ndarray, shape (f,)
    all_amplitude_rad : ndarray, shape (a,)
        Every amplitude of the map.
    minus3db_hz, minus90deg_hz : ndarray, shape (a,)
        First crossing; between two frequencies of the map the linear response, and what the simulated one is
        off by, interpolated on the logarithm of frequency; NaN where there is none in the range
        (`below_from_start`: already below at the lowest frequency), and where it lies beside points that are
        not steady: a missing point is no value. -3 dB is 1/sqrt(2) of the linear gain at zero frequency.
    minus3db_range_hz : ndarray, shape (a, 2)
        Between which frequencies of the map the gain first falls through -3 dB, as far as steady points tell:
        from 0 where the first of them is below already, to inf where none is.
    below_from_start : ndarray of bool, shape (a,)
        Whether the gain is below -3 dB at the lowest frequency already.
    linear_minus3db_hz, linear_minus90deg_hz : float or None
    """

    load_Nm: float
    frequency_hz: np.ndarray
    fractions: tuple[float, ...]
    amplitude_rad: np.ndarray
    gain_db: np.ndarray
    phase_deg: np.ndarray
    linear_db: np.ndarray
    linear_deg: np.ndarray
    all_amplitude_rad: np.ndarray
    minus3db_hz: np.ndarray
    minus90deg_hz: np.ndarray
    minus3db_range_hz: np.ndarray
    below_from_start: np.ndarray
    linear_minus3db_hz: float | None
    linear_minus90deg_hz: float | None
    level_db: float = MINUS_3DB


def amplitude_bode(design: Design, loops: Loops, amplitude_map: AmplitudeMap) -> AmplitudeBode:
    """Read the responses at the design's amplitude fractions, and the bandwidths at all, from a map."""
    full = design.validation.full_deflection_rad
    asked = sorted(design.validation.amplitude_fractions)
    fractions, places = _on_the_map(asked, amplitude_map.amplitude_rad / full)
    hz, unsteady = amplitude_map.frequency_hz, amplitude_map.waveform == WAVEFORMS.index("not steady")
    gain = np.where(unsteady, np.nan, amplitude_map.gain_db)
    phase = np.where(unsteady, np.nan, amplitude_map.phase_deg)
    steps = np.arange(FINE * (hz.size - 1) + 1) / FINE
    fine = np.exp(np.interp(steps, np.arange(hz.size), np.log(hz)))
    with np.errstate(divide="ignore"):  # the mean of a limited jerk has zeros
        start, *curve = 20.0 * np.log10(np.abs(_linear(loops, np.array([1e-6 * hz[0], *fine]))))
    level, fine_db = MINUS_3DB + start, np.array(curve)
    fine_deg = np.degrees(np.unwrap(np.angle(_linear(loops, fine))))
    linear_db, linear_deg = fine_db[::FINE], fine_deg[::FINE]

    def between(values: np.ndarray, linear: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return linear + np.interp(steps, np.arange(hz.size), values - linear[::FINE])

    first_3 = np.array([_crossing(fine, between(row, fine_db), level) for row in gain])
    first_90 = np.array([_crossing(fine, between(row, fine_deg), -90.0) for row in phase])
    return AmplitudeBode(
        load_Nm=amplitude_map.load_Nm,
        frequency_hz=hz,
        fractions=fractions,
        amplitude_rad=amplitude_map.amplitude_rad[places],
        gain_db=gain[places],
        phase_deg=phase[places],
        linear_db=linear_db,
        linear_deg=linear_deg,
        all_amplitude_rad=amplitude_map.amplitude_rad,
        minus3db_hz=first_3,
        minus90deg_hz=first_90,
        minus3db_range_hz=np.array([crossing_range(hz, row, level) for row in gain]),
        below_from_start=gain[:, 0] < level,
        linear_minus3db_hz=_number(_crossing(fine, fine_db, level)),
        linear_minus90deg_hz=_number(_crossing(fine, fine_deg, -90.0)),
        level_db=level,
    )


def _on_the_map(asked: list[float], there: np.ndarray) -> tuple[tuple[float, ...], list[int]]:
    """Which of the fractions a map has, and where: a coarse one has not all."""
    nearest = [int(np.argmin(np.abs(there - fraction))) for fraction in asked]
    kept = [
        (fraction, k)
        for fraction, k in zip(asked, nearest, strict=True)
        if math.isclose(there[k], fraction, rel_tol=1e-9)
    ]
    return tuple(fraction for fraction, _ in kept), [k for _, k in kept]


def _linear(loops: Loops, hz: np.ndarray) -> np.ndarray:
    return linear_steady_state(loops, 2.0 * math.pi * hz).output


def _crossing(hz: np.ndarray, values: np.ndarray, level: float) -> float:
    """Give the first frequency at which the values fall through a level; NaN where it is not known."""
    low, high = crossing_range(hz, values, level)
    k = int(np.searchsorted(hz, low))
    if low == 0.0 or not math.isfinite(high) or hz[k + 1] != high or not math.isfinite(values[k + 1]):
        return math.nan
    part = (values[k] - level) / (values[k] - values[k + 1])
    return float(hz[k] * (hz[k + 1] / hz[k]) ** part)


def crossing_range(hz: np.ndarray, values: np.ndarray, level: float) -> tuple[float, float]:
    """The frequencies between which the values first fall through a level; what is NaN tells nothing.

    Examples
    --------
    >>> import math
    >>> import numpy as np
    >>> crossing_range(np.array([1.0, 2.0, 4.0, 8.0]), np.array([0.0, math.nan, -5.0, -9.0]), -3.0)
    (1.0, 4.0)
    """
    known = np.flatnonzero(~np.isnan(values))
    above = values[known] >= level
    first = int(np.argmin(above)) if known.size and not above.all() else known.size
    low = float(hz[known[first - 1]]) if first > 0 else 0.0
    return low, float(hz[known[first]]) if first < known.size else math.inf


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
