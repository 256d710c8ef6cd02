"""One margin each: gain, phase, delay, disk; and how the two ways to stability agree."""

import math
from dataclasses import dataclass


def frequency_text(omega_rad_s: float) -> str:
    return f"{omega_rad_s:.6g} rad/s ({omega_rad_s / (2.0 * math.pi):.6g} Hz)"


def between_text(low_rad_s: float, high_rad_s: float) -> str:
    hertz = f"{low_rad_s / (2.0 * math.pi):.6g} to {high_rad_s / (2.0 * math.pi):.6g} Hz"
    return f"between {low_rad_s:.6g} and {high_rad_s:.6g} rad/s ({hertz})"


_TOUCH = ", a touch within 1e-9: the line is not crossed"


def _known(values: tuple[float, float] | None, bracket: tuple[float, float] | None, unit: str) -> str:
    """Where a measured figure and its frequency lie."""
    if values is None or bracket is None:
        return ""
    within = f"{values[0]:.5g} to {values[1]:.5g}{unit}"
    return f", in [{within}], between {bracket[0]:.6g} and {bracket[1]:.6g} rad/s"


class AtFrequency:
    """What stands at a frequency, in rad/s."""

    frequency_rad_s: float

    @property
    def frequency_hz(self) -> float:
        """The frequency in Hz."""
        return self.frequency_rad_s / (2.0 * math.pi)


@dataclass(frozen=True)
class GainMargin(AtFrequency):
    """A real factor on the loop that brings a closed-loop pole to the stability limit."""

    ratio: float  # > 1: an upper limit, < 1: a lower limit
    # Where the pole reaches it; may be 0, the Nyquist frequency, or infinity (direct feed-through)
    frequency_rad_s: float
    tangent: bool = False  # the curve touches the negative real axis there without crossing it
    # Of measured data: frequencies between which the crossing lies, and where the ratio does, with the noise
    bracket_rad_s: tuple[float, float] | None = None
    ratio_range: tuple[float, float] | None = None

    @property
    def db(self) -> float:
        """The ratio in dB."""
        return 20.0 * math.log10(self.ratio)

    def __str__(self) -> str:
        limit = "upper" if self.ratio >= 1.0 else "lower"
        known = _known(self.ratio_range, self.bracket_rad_s, "")
        where = f"{frequency_text(self.frequency_rad_s)}{known}{_TOUCH if self.tangent else ''}"
        return f"{self.ratio:.6g} ({self.db:+.4f} dB, {limit}) at {where}"


@dataclass(frozen=True)
class PhaseMargin(AtFrequency):
    """A phase lag (negative: a lead) that brings a closed-loop pole to the stability limit."""

    deg: float  # 180 deg plus the phase of the loop, in (-180, 180]
    frequency_rad_s: float  # the gain crossover
    tangent: bool = False  # the gain touches one there without crossing it
    # Of measured data: two frequencies between which the crossing lies, and where the margin does
    bracket_rad_s: tuple[float, float] | None = None
    deg_range: tuple[float, float] | None = None

    def __str__(self) -> str:
        known = _known(self.deg_range, self.bracket_rad_s, " deg")
        touch = _TOUCH if self.tangent else ""
        return f"{self.deg:+.4f} deg at {frequency_text(self.frequency_rad_s)}{known}{touch}"


@dataclass(frozen=True)
class DelayMargin(AtFrequency):
    """The smallest delay in the loop that brings a closed-loop pole at this gain crossover to the limit."""

    seconds: float
    samples: float | None  # the same in sampling periods; None for a continuous loop
    frequency_rad_s: float
    # Of measured data: where the delay lies, by the ranges of phase margin and crossover
    seconds_range: tuple[float, float] | None = None

    def __str__(self) -> str:
        samples = "" if self.samples is None else f" = {self.samples:.6g} samples"
        known = "" if self.seconds_range is None else ", in [{:.5g} to {:.5g} s]".format(*self.seconds_range)
        return f"{self.seconds:.6g} s{samples} at {frequency_text(self.frequency_rad_s)}{known}"


@dataclass(frozen=True)
class DiskMargin(AtFrequency):
    """Balanced disk margin (S + T, skew 0) of Seiler, Packard, Gahinet 2020.

    The loop may be multiplied by any complex factor (2 + d)/(2 - d) with |d| < alpha.
    """

    alpha: float  # the smallest of |2 (1 + L)/(1 - L)|
    frequency_rad_s: float
    alpha_range: tuple[float, float] | None = None  # of measured data: between the points, within the noise

    @property
    def deg(self) -> float:
        """Phase that may be lost or won while the gain stays, in deg."""
        return math.degrees(2.0 * math.atan(self.alpha / 2.0))

    @property
    def ratio(self) -> float:
        """Factor by which the gain may grow or shrink while the phase stays (infinity from alpha = 2)."""
        return (2.0 + self.alpha) / (2.0 - self.alpha) if self.alpha < 2.0 else math.inf

    @property
    def db(self) -> float:
        """The factor in dB."""
        return 20.0 * math.log10(self.ratio) if self.alpha < 2.0 else math.inf

    def __str__(self) -> str:
        figures = f"alpha {self.alpha:.6g} (+-{self.deg:.4f} deg, +-{self.db:.4f} dB)"
        return f"{figures} at {frequency_text(self.frequency_rad_s)}"


@dataclass(frozen=True)
class Agreement:
    """How many closed-loop poles are unstable: by the poles themselves, and by the Nyquist count."""

    unstable_poles: int | None  # None where a way does not apply
    unstable_nyquist: int | None
    poles_at_limit: int = 0  # on the stability boundary itself

    @property
    def agree(self) -> bool:
        """Whether the two ways do not contradict each other."""
        if self.unstable_poles is None or self.unstable_nyquist is None or self.poles_at_limit:
            return True
        return self.unstable_poles == self.unstable_nyquist

    def __str__(self) -> str:
        if self.poles_at_limit:
            return f"{self.poles_at_limit} closed-loop pole(s) on the stability boundary"
        ways = (("poles", self.unstable_poles), ("Nyquist count", self.unstable_nyquist))
        only = [f"{way} only: {count} unstable" for way, count in ways if count is not None]
        if len(only) < 2:
            return only[0] if only else "neither poles nor a Nyquist count"
        word = "agree" if self.agree else "DISAGREE"
        return f"poles ({self.unstable_poles} unstable) and Nyquist ({self.unstable_nyquist}) {word}"
