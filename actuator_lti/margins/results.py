"""What the margin engine returns: frozen results that print with their units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["stable", "unstable", "on the border", "undecided"]


def _frequency_text(omega_rad_s: float) -> str:
    return f"{omega_rad_s:.6g} rad/s ({omega_rad_s / (2.0 * math.pi):.6g} Hz)"


@dataclass(frozen=True)
class GainMargin:
    """A real factor on the loop that brings a closed-loop pole to the border.

    Attributes
    ----------
    ratio : float
        The factor (> 1: an upper limit, < 1: a lower limit).
    frequency_rad_s : float
        Where the pole reaches the border; 0 and the Nyquist frequency are possible, infinity where the
        loop has a direct feed-through.
    tangent : bool
        The curve touches the negative real axis there without crossing it.
    bracket_rad_s : tuple of float or None
        Measured data: the two neighbouring frequencies between which the crossing lies.
    ratio_range : tuple of float or None
        Measured data: the ratios at those two frequencies.
    """

    ratio: float
    frequency_rad_s: float
    tangent: bool = False
    bracket_rad_s: tuple[float, float] | None = None
    ratio_range: tuple[float, float] | None = None

    @property
    def db(self) -> float:
        """The ratio in dB."""
        return 20.0 * math.log10(self.ratio)

    @property
    def frequency_hz(self) -> float:
        """The frequency in Hz."""
        return self.frequency_rad_s / (2.0 * math.pi)

    def __str__(self) -> str:
        limit = "upper" if self.ratio >= 1.0 else "lower"
        return f"{self.ratio:.6g} ({self.db:+.4f} dB, {limit}) at {_frequency_text(self.frequency_rad_s)}"


@dataclass(frozen=True)
class PhaseMargin:
    """A phase lag (negative: a lead) that brings a closed-loop pole to the border.

    Attributes
    ----------
    deg : float
        180 deg plus the phase of the loop, in (-180, 180].
    frequency_rad_s : float
        The gain crossover.
    tangent : bool
        The gain touches one there without crossing it.
    bracket_rad_s, deg_range : tuple of float or None
        Measured data: the neighbouring frequencies, and the margins there.
    """

    deg: float
    frequency_rad_s: float
    tangent: bool = False
    bracket_rad_s: tuple[float, float] | None = None
    deg_range: tuple[float, float] | None = None

    @property
    def frequency_hz(self) -> float:
        """The frequency in Hz."""
        return self.frequency_rad_s / (2.0 * math.pi)

    def __str__(self) -> str:
        return f"{self.deg:+.4f} deg at {_frequency_text(self.frequency_rad_s)}"


@dataclass(frozen=True)
class DelayMargin:
    """The smallest delay in the loop that brings a closed-loop pole to the border at this crossover.

    Attributes
    ----------
    seconds : float
        The delay.
    samples : float or None
        The same in sampling periods; ``None`` for a continuous loop.
    frequency_rad_s : float
        The gain crossover.
    """

    seconds: float
    samples: float | None
    frequency_rad_s: float

    def __str__(self) -> str:
        samples = "" if self.samples is None else f" = {self.samples:.6g} samples"
        return f"{self.seconds:.6g} s{samples} at {_frequency_text(self.frequency_rad_s)}"


@dataclass(frozen=True)
class DiskMargin:
    """Balanced disk margin (S + T, skew 0) of Seiler, Packard, Gahinet 2020.

    The loop may be multiplied by any complex factor (2 + d)/(2 - d) with |d| < alpha.

    Attributes
    ----------
    alpha : float
        The smallest of \\|2 (1 + L)/(1 - L)\\|.
    frequency_rad_s : float
        Where it is reached.
    """

    alpha: float
    frequency_rad_s: float

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
        return f"{figures} at {_frequency_text(self.frequency_rad_s)}"


@dataclass(frozen=True)
class Agreement:
    """Stability found twice: from closed-loop poles, and from the Nyquist count.

    Attributes
    ----------
    unstable_poles, unstable_nyquist : int or None
        Closed-loop poles outside the stable region by either way; ``None`` where a way does not apply.
    border_poles : int
        Closed-loop poles on the border itself.
    """

    unstable_poles: int | None
    unstable_nyquist: int | None
    border_poles: int = 0

    @property
    def agree(self) -> bool:
        """Whether the two ways do not contradict each other."""
        if self.unstable_poles is None or self.unstable_nyquist is None or self.border_poles:
            return True
        return self.unstable_poles == self.unstable_nyquist

    def __str__(self) -> str:
        if self.border_poles:
            return f"{self.border_poles} closed-loop pole(s) on the border"
        if self.unstable_poles is None and self.unstable_nyquist is None:
            return "neither poles nor a Nyquist count"
        if self.unstable_poles is None or self.unstable_nyquist is None:
            which, count = (
                ("Nyquist count", self.unstable_nyquist)
                if self.unstable_poles is None
                else ("poles", self.unstable_poles)
            )
            return f"{which} only: {count} unstable"
        word = "agree" if self.agree else "DISAGREE"
        return f"poles ({self.unstable_poles} unstable) and Nyquist ({self.unstable_nyquist}) {word}"


@dataclass(frozen=True)
class StabilityMargins:
    """All margins of a loop with negative unit feedback.

    The figures to quote, and how they are chosen:

    - ``gain_margin_db``: of all gain margins the one nearest to 0 dB, upper (> 0) or lower (< 0);
      ``inf`` where there is none.
    - ``phase_margin_deg``: of all phase margins the one nearest to 0 deg, with its sign; ``inf`` where the
      gain never crosses one.
    - ``delay_margin_s``: the smallest of all delay margins; ``inf`` where the gain never crosses one, and
      0 for a loop that is not stable, which can take no delay.
    - ``modulus_margin``: the smallest distance of L to -1, 1 over the peak of the sensitivity.
    - ``disk_margin``: balanced (S + T).

    For an unstable loop the crossings are still listed: they say how far it is from the border, and their
    signs (a negative phase margin, a lower gain margin) say in which direction. Where the two ways to
    stability disagree, or where stability cannot be known (measured data), ``stable`` is ``None``; in the
    first case every figure is withheld (empty lists, ``None``).

    Attributes
    ----------
    stable : bool or None
        Whether the closed loop is stable; a pole on the border is not stable.
    verdict : str
        ``"stable"``, ``"unstable"``, ``"on the border"`` or ``"undecided"``.
    gain_margins, phase_margins, delay_margins : tuple
        Every one in the band, in order of frequency.
    period_s : float or None
        Sampling period; ``None`` for a continuous loop.
    delay_s : float
        The extra delay that was asked for.
    band_rad_s : tuple of float
        Where the lists are complete: (0, inf), (0, Nyquist), or a stated band under delay.
    method : str
        How the crossings were found.
    agreement : Agreement
        The two ways to stability.
    notes : tuple of str
        What else has to be known to read the figures.
    """

    stable: bool | None
    verdict: Verdict
    gain_margins: tuple[GainMargin, ...]
    phase_margins: tuple[PhaseMargin, ...]
    delay_margins: tuple[DelayMargin, ...]
    modulus_margin: float | None
    modulus_frequency_rad_s: float | None
    disk_margin: DiskMargin | None
    period_s: float | None
    delay_s: float
    band_rad_s: tuple[float, float]
    method: str
    agreement: Agreement
    notes: tuple[str, ...] = ()

    @property
    def withheld(self) -> bool:
        """Whether the figures are withheld because the two ways to stability disagree."""
        return not self.agreement.agree

    @property
    def gain_margin(self) -> GainMargin | None:
        """The gain margin to quote: nearest to 0 dB."""
        return min(self.gain_margins, key=lambda m: abs(m.db), default=None)

    @property
    def phase_margin(self) -> PhaseMargin | None:
        """The phase margin to quote: nearest to 0 deg."""
        return min(self.phase_margins, key=lambda m: abs(m.deg), default=None)

    @property
    def delay_margin(self) -> DelayMargin | None:
        """The smallest delay margin."""
        return min(self.delay_margins, key=lambda m: m.seconds, default=None)

    @property
    def gain_margin_db(self) -> float | None:
        """Gain margin to quote, dB (``inf``: none; ``None``: withheld, or none in measured data)."""
        quoted = self.gain_margin
        return self._none if quoted is None else quoted.db

    @property
    def phase_margin_deg(self) -> float | None:
        """Phase margin to quote, deg (``inf``: none; ``None``: withheld, or none in measured data)."""
        quoted = self.phase_margin
        return self._none if quoted is None else quoted.deg

    @property
    def delay_margin_s(self) -> float | None:
        """Delay margin to quote, s (``inf``: none; 0: not stable; ``None``: withheld, or none in data)."""
        if self.stable is False:
            return 0.0
        quoted = self.delay_margin
        return self._none if quoted is None else quoted.seconds

    @property
    def _none(self) -> float | None:
        return None if self.stable is None else math.inf

    @property
    def sensitivity_peak_db(self) -> float | None:
        """Peak of the sensitivity S = 1/(1 + L), dB."""
        if self.modulus_margin is None:
            return None
        return -20.0 * math.log10(self.modulus_margin) if self.modulus_margin > 0.0 else math.inf

    def __str__(self) -> str:
        return "\n".join(_lines(self))


def _lines(m: StabilityMargins) -> list[str]:
    heads = {
        "stable": "closed loop: stable",
        "unstable": "closed loop: UNSTABLE (what follows are crossings, not margins)",
        "on the border": "closed loop: ON THE BORDER, not stable",
        "undecided": "closed loop: stability not known",
    }
    lines = [heads[m.verdict] + f" [{m.agreement}]"]
    if m.withheld:
        return [*lines, *(f"note: {note}" for note in m.notes)]
    named = (("gain", m.gain_margins), ("phase", m.phase_margins), ("delay", m.delay_margins))
    for name, margins in named:
        if not margins:
            lines.append(f"{name} margin: none")
        lines += [f"{name} margin: {margin}" for margin in margins]
    if m.modulus_margin is not None and m.modulus_frequency_rad_s is not None:
        lines.append(
            f"modulus margin: {m.modulus_margin:.6g} at {_frequency_text(m.modulus_frequency_rad_s)}"
        )
    if m.disk_margin is not None:
        lines.append(f"disk margin: {m.disk_margin}")
    lines.append(f"band: {m.band_rad_s[0]:.6g} to {m.band_rad_s[1]:.6g} rad/s; method: {m.method}")
    return [*lines, *(f"note: {note}" for note in m.notes)]
