"""The result from its figures: verdict, delay margins, evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from actuator_lti.margins.results import Evidence, StabilityMargins, Verdict
from actuator_lti.margins.single import Agreement, DelayMargin, DiskMargin, GainMargin, PhaseMargin

FARTHEST = 1e10


@dataclass(frozen=True)
class Figures:
    """What was found on the axis; (value, rad/s) of modulus margin and disk margin."""

    gain_margins: tuple[GainMargin, ...]
    phase_margins: tuple[PhaseMargin, ...]
    modulus: tuple[float, float]
    disk: tuple[float, float]


def assembled(
    period_s: float | None,
    agreement: Agreement,
    figures: Figures | None,
    *,
    method: str,
    notes: tuple[str, ...],
    evidence: Evidence,
    reason: str,
    delay_s: float = 0.0,
    band_rad_s: tuple[float, float] | None = None,
    hidden_border: int = 0,
) -> StabilityMargins:
    """Put a result together; without figures they are withheld."""
    if band_rad_s is None:
        band_rad_s = (0.0, math.inf if period_s is None else math.pi / period_s)
    verdict = _verdict(agreement)
    if figures is None or verdict == "undecided":
        return StabilityMargins(
            None, "undecided", (), (), (), None, None, None, period_s, delay_s, band_rad_s, method, agreement,
            notes, "withheld", reason,
        )  # fmt: skip
    return StabilityMargins(
        verdict == "stable", verdict, figures.gain_margins, figures.phase_margins,
        delay_margins(figures.phase_margins, period_s), *figures.modulus, DiskMargin(*figures.disk), period_s,
        delay_s, band_rad_s, method, agreement, notes, evidence, reason, hidden_border_modes=hidden_border,
    )  # fmt: skip


def out_of_sight(L: complex) -> bool:
    """Whether a crossing of the negative real axis is not listed: its margin is beyond 200 dB, up or down."""
    return not 1.0 / FARTHEST <= abs(L) <= FARTHEST


def far_note(far: int) -> tuple[str, ...]:
    """What is said of crossings that are not listed."""
    if not far:
        return ()
    crossings = "1 crossing" if far == 1 else f"{far} crossings"
    return (f"not listed, as their margin is beyond 200 dB: {crossings} of the negative real axis",)


def hidden_notes(at_zero: int, border: tuple[tuple[float, int], ...] = (), right: int = 0) -> tuple[str, ...]:
    """What is said of modes that the loop neither drives nor sees: how many at zero frequency, pairs on the
    boundary (w of the s-plane, how often), unstable ones.
    """
    notes = []
    if at_zero == 1 and not border:
        notes.append(
            "one mode at zero frequency that the loop neither drives nor sees is left out "
            "(it is no instability)"
        )
    elif at_zero or border:
        at = f"{at_zero} at zero frequency" if at_zero else ""
        pairs = ", ".join(f"{times} pair{'s' * (times > 1)} at {w:.6g}" for w, times in border)
        notes.append(
            f"modes on the stability boundary that the loop neither drives nor sees are left out "
            f"({', '.join(filter(None, (at, pairs)))} of the s-plane): the margins are those of what is "
            "seen; inside, the loop is not asymptotically stable"
        )
    if right:
        modes = "1 unstable mode" if right == 1 else f"{right} unstable modes"
        notes.append(f"{modes} that the loop neither drives nor sees")
    return tuple(notes)


def _verdict(agreement: Agreement) -> Verdict:
    """From the two ways; both are asked only where no pole is on the border."""
    counts = {agreement.unstable_poles, agreement.unstable_nyquist} - {None}
    if not counts or not agreement.agree:
        return "undecided"
    if counts != {0}:
        return "unstable"
    return "on the border" if agreement.border_poles else "stable"


def delay_margins(phase_margins: tuple[PhaseMargin, ...], period_s: float | None) -> tuple[DelayMargin, ...]:
    """The delay that uses up each phase margin; a negative margin by way of a full turn."""
    out = []
    for margin in phase_margins:
        lag = math.radians(margin.deg if margin.deg >= 0.0 else margin.deg + 360.0)
        seconds = lag / margin.frequency_rad_s
        samples = None if period_s is None else seconds / period_s
        out.append(DelayMargin(seconds, samples, margin.frequency_rad_s))
    return tuple(out)


def within(margins: StabilityMargins, band: tuple[float, float] | None) -> StabilityMargins:
    """The same with only the margins of a band listed."""
    if band is None:
        return margins
    low, high = band

    def inside(listed: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(margin for margin in listed if low <= margin.frequency_rad_s <= high)

    return replace(
        margins,
        gain_margins=inside(margins.gain_margins),
        phase_margins=inside(margins.phase_margins),
        delay_margins=inside(margins.delay_margins),
        band_rad_s=(low, high),
    )
