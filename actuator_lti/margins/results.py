"""What the margin engine returns: frozen results that print with their units."""

import math
from dataclasses import dataclass
from typing import Literal

from actuator_lti.drawing import draw
from actuator_lti.margins.single import (
    Agreement,
    DelayMargin,
    DiskMargin,
    GainMargin,
    PhaseMargin,
    frequency_text,
)

_PRINTED = 8
Verdict = Literal["stable", "unstable", "at the stability limit", "undecided"]
Evidence = Literal["certified", "checked", "withheld"]


@dataclass(frozen=True)
class StabilityMargins:
    """All margins of a loop with negative unit feedback.

    The figures to quote are its properties: of all gain margins the one nearest to 0 dB, upper (> 0) or
    lower (< 0); of all phase margins the one nearest to 0 deg, with its sign; the smallest delay margin, 0 of
    a loop that is not stable. ``modulus_margin`` is the smallest distance of L to -1, for a stable loop 1
    over the peak of the sensitivity, ``disk_margin`` the balanced one (S + T).

    For an unstable loop the crossings are still listed: they say how far it is from stability, and their
    signs (a negative phase margin, a lower gain margin) say in which direction. Where stability is not
    known (measured data, or a withheld answer), ``stable`` is ``None``; a withheld answer has no figures at
    all (empty lists, ``None``).

    How an answer is known (``evidence``):

    - ``"certified"``: by exact arithmetic on the given doubles and roots in certified intervals; the
      verdict is the same for data 8 ulp away, and a note names a crossing that is not.
    - ``"checked"``: in double precision; poles and Nyquist count agree, the parity of the crossovers is
      right, no pole lies within its own error of the stability boundary, and each figure has a small bound
      of its error; behind a delay also from the zeros and poles of the exact polynomials, if rounding of
      the entries (8 ulp) changes nothing.
    - ``"withheld"``: the verdict is not resolved in double precision (8 ulp of the entries change it), or a
      search came to its end. The reason says which.

    ``stable``: whether the closed loop is stable; a pole on the stability boundary is not stable.
    ``verdict``: "stable", "unstable", "at the stability limit" or "undecided".
    ``gain_margins``, ``phase_margins``, ``delay_margins``: every one in the band, in order of frequency.
    ``period_s``: sampling period; None for a continuous loop.
    ``delay_s``: the extra delay that was asked for.
    ``band_rad_s``: where the lists are complete: (0, inf), (0, Nyquist), or a stated band under delay.
    ``method``, ``agreement``: how the crossings were found, and the two ways to stability.
    ``notes``: what else has to be known to read the figures.
    ``evidence_reason``: why the evidence is what it is: one line.
    ``modulus_range``: where the modulus margin of measured data lies between the points and within noise.
    ``hidden_modes_at_limit``: integrators and undamped modes that the loop neither drives nor sees: `stable`
    and the margins are those of what is seen, `internally_stable` counts them.
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
    evidence: Evidence = "checked"
    evidence_reason: str = ""
    modulus_range: tuple[float, float] | None = None
    hidden_modes_at_limit: int = 0

    @property
    def internally_stable(self) -> bool | None:
        """Whether every mode decays, those too that the loop neither drives nor sees."""
        return self.stable and not self.hidden_modes_at_limit

    @property
    def withheld(self) -> bool:
        """Whether there are no figures, because the data do not determine them."""
        return self.evidence == "withheld" or not self.agreement.agree

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
        """Gain margin to quote, dB (``inf``: none within 200 dB; ``None``: withheld, or none in data)."""
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
        """Peak of the sensitivity S = 1/(1 + L), dB; ``None`` for a loop that is not stable: S has none."""
        if self.modulus_margin is None or self.stable is False:
            return None
        return -20.0 * math.log10(self.modulus_margin) if self.modulus_margin > 0.0 else math.inf

    def __str__(self) -> str:
        return "\n".join(_lines(self))

    def _repr_html_(self) -> str:
        return draw("margins_html", self)


def _within(result: tuple[float, float] | None) -> str:
    return "" if result is None else f", in [{result[0]:.4g}, {result[1]:.4g}]"


def _lines(m: StabilityMargins) -> list[str]:
    heads = {
        "stable": "closed loop: stable",
        "unstable": "closed loop: UNSTABLE (what follows are crossings, not margins)",
        "at the stability limit": "closed loop: AT THE STABILITY LIMIT, not stable",
        "undecided": "closed loop: stability not known",
    }
    lines = [heads[m.verdict] + f" [{m.agreement}]"]
    evidence = f"evidence: {m.evidence}" + (f" ({m.evidence_reason})" if m.evidence_reason else "")
    if m.withheld:
        return [*lines, evidence, *(f"note: {note}" for note in m.notes)]
    named = (("gain", m.gain_margins), ("phase", m.phase_margins), ("delay", m.delay_margins))
    for name, margins in named:
        label = f"{name} margin"
        if name == "delay" and m.stable is False:
            lines.append("delay margin: 0 s, as it is not stable")
            label = "delay to the stability limit"
        elif not margins:
            lines.append(f"{label}: none")
        lines += [f"{label}: {margin}" for margin in margins[:_PRINTED]]
        if len(margins) > _PRINTED:
            lines.append(f"{label}: {len(margins) - _PRINTED} more")
    if m.modulus_margin is not None and m.modulus_frequency_rad_s is not None:
        where = f"{m.modulus_margin:.6g} at {frequency_text(m.modulus_frequency_rad_s)}"
        lines.append(f"modulus margin: {where}{_within(m.modulus_range)}")
    if m.disk_margin is not None:
        lines.append(f"disk margin: {m.disk_margin}{_within(m.disk_margin.alpha_range)}")
    lines.append(f"band: {m.band_rad_s[0]:.6g} to {m.band_rad_s[1]:.6g} rad/s; method: {m.method}")
    return [*lines, evidence, *(f"note: {note}" for note in m.notes)]
