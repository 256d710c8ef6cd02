"""What a point of the map shows: the limit that acts, the shape of the output; closed forms (model.md, 5)."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nonlinear import LIMITERS
from nonlinear.runs.reduced import BatchResult

FULL_TRIANGLE = math.sqrt(1.0 + math.pi**2 / 4.0)  # x from which on the output is a whole triangle, 1.8621
TRIANGLE_THIRD, PARABOLA_THIRD = -1.0 / 9.0, 1.0 / 27.0


@dataclass(frozen=True)
class RateLimited:
    """A sine through a pure rate limit R, with ``x = w A/R``."""

    x: float
    regime: Literal["linear", "between", "triangle"]
    gain: float  # fundamental of the output over the command
    lag_deg: float  # positive: the output comes later
    peak: float | None  # peak of the output, in the unit of R times s; ``None`` between the two regimes


def rate_limited(amplitude: float, omega_rad_s: float, rate_limit: float) -> RateLimited:
    """Describing function of a pure rate limit (model.md section 5; between the regimes an accepted fit).

    ``amplitude``: peak of the command; ``rate_limit``: R, in the unit of the amplitude per second.
    """
    x = omega_rad_s * amplitude / rate_limit
    if x <= 1.0:
        return RateLimited(x, "linear", 1.0, 0.0, amplitude)
    if x >= FULL_TRIANGLE:
        peak = math.pi * rate_limit / (2.0 * omega_rad_s)
        lag = math.degrees(math.acos(math.pi / (2.0 * x)))
        return RateLimited(x, "triangle", 4.0 / (math.pi * x), lag, peak)
    gain = ((0.2908 * x - 1.4396) * x + 1.9232) * x + 0.2230
    angle = ((0.5280 * x - 2.6213) * x + 3.5056) * x - 1.4171
    return RateLimited(x, "between", gain, -math.degrees(angle), None)


CAUSES = ("none", "friction", "stiction", "other", *LIMITERS)
WAVEFORMS = ("sine", "triangle", "parabola", "stick-slip", "no motion", "distorted", "not steady")
SINE_DISTORTION = 0.02
STICK_FRACTION = 0.10
TRIANGLE_SHARE = 0.65  # of the third harmonic of a triangle
PARABOLA_SHARE = 0.6  # how far from that of a parabola train
FRICTION_DB, FRICTION_DEG = 1.0, 10.0
STEADY = 0.02
CRITERIA = (
    "no motion: at rest at every tick of the last window; "
    f"stick-slip: at rest at {100 * STICK_FRACTION:.0f} % of its ticks or more; "
    f"triangle: third harmonic, in phase as in a triangle, above {100 * TRIANGLE_SHARE:.0f} % of 1/9; "
    f"parabola: the same within {100 * PARABOLA_SHARE:.0f} % of 1/27, with the other sign "
    f"(both only where a limit acts); sine: distortion below {100 * SINE_DISTORTION:.0f} %; else distorted. "
    f"Not steady: fundamental more than {100 * STEADY:.0f} % off that of half as long."
)
CAUSE_RULE = (
    "The limit named is the one that acts at most ticks of the last window. Where none acts: stiction if "
    f"the drive rests at {100 * STICK_FRACTION:.0f} % of the ticks or more. "
    f"Where the fundamental is off the linear one by more than {FRICTION_DB:g} dB or {FRICTION_DEG:g}°: "
    "dry friction if it is not so without dry friction, else play, gravity, cogging or counts. "
    "Else none: the linear model holds."
)


def waveforms(result: BatchResult, change: np.ndarray) -> np.ndarray:
    """Classify the output of each run in the last window (`CRITERIA`); index into `WAVEFORMS`.

    ``change``, shape (runs,): relative one of the fundamental since the run was half as long.
    """
    first = result.phasor("output_angle_rad", 1)
    third = result.phasor("output_angle_rad", 3)
    size = np.maximum(np.abs(first), 1e-300)
    in_phase = np.real(third * np.exp(-3j * np.angle(first))) / size
    stick = result.window_stick_fraction
    limited = limiter_fractions(result).max(axis=1) > 0.0
    conditions = [
        (stick >= 1.0, "no motion"),
        (change > STEADY, "not steady"),
        (stick >= STICK_FRACTION, "stick-slip"),
        (limited & (in_phase < TRIANGLE_SHARE * TRIANGLE_THIRD), "triangle"),
        (limited & (np.abs(in_phase / PARABOLA_THIRD - 1.0) < PARABOLA_SHARE), "parabola"),
        (result.distortion("output_angle_rad") < SINE_DISTORTION, "sine"),
    ]
    codes = [WAVEFORMS.index(name) for _, name in conditions]
    return np.select([mask for mask, _ in conditions], codes, WAVEFORMS.index("distorted"))


def limiter_fractions(result: BatchResult) -> np.ndarray:
    """Fraction of the last window in which each limiter acts, shape (runs, limiters)."""
    return np.stack([result.window_limit_fraction(name) for name in LIMITERS], axis=1)


def causes(
    result: BatchResult, linear: np.ndarray, amplitude_rad: np.ndarray, rubs: bool = True
) -> np.ndarray:
    """Index into `CAUSES` of what keeps each run from its ``linear`` response; friction if it ``rubs``."""
    fractions = limiter_fractions(result)
    conditions = {
        CAUSES.index("stiction"): result.window_stick_fraction >= STICK_FRACTION,
        CAUSES.index("friction" if rubs else "other"): not_linear(result, linear, amplitude_rad),
    }
    codes = np.select([*conditions.values()], [*conditions], CAUSES.index("none"))
    limiter = CAUSES.index(LIMITERS[0]) + np.argmax(fractions, axis=1)
    return np.where(fractions.max(axis=1) > 0.0, limiter, codes)


def not_linear(result: BatchResult, linear: np.ndarray, amplitude_rad: np.ndarray) -> np.ndarray:
    """Whether the fundamental of each run is off the linear one by more than `CAUSE_RULE` says."""
    with np.errstate(divide="ignore", invalid="ignore"):  # at a zero of the command's mean nothing is linear
        ratio = result.phasor("output_angle_rad") / (linear * amplitude_rad)
    off = np.abs(20.0 * np.log10(np.maximum(np.abs(ratio), 1e-300))) > FRICTION_DB
    return off | (np.abs(np.degrees(np.angle(ratio))) > FRICTION_DEG)
