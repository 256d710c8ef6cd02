"""The result from its figures: verdict, delay margins, evidence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from actuator_lti.margins.distances import Place
from actuator_lti.margins.given import unwarped
from actuator_lti.margins.results import Evidence, StabilityMargins, Verdict
from actuator_lti.margins.single import Agreement, DelayMargin, DiskMargin, GainMargin, PhaseMargin

FARTHEST = 1e10  # 200 dB


@dataclass(frozen=True)
class Crossing:
    """Where L meets the unit circle or the negative real axis: w of the s-plane, L there."""

    w: float
    L: complex
    touch: bool = False

    @property
    def out_of_sight(self) -> bool:
        """Whether it is not listed as a gain margin: that is beyond 200 dB, up or down."""
        return not 1.0 / FARTHEST <= abs(self.L) <= FARTHEST


@dataclass(frozen=True)
class Figures:
    """What was found on the axis: crossings of the unit circle and of the negative real axis, distances."""

    gains: tuple[Crossing, ...]
    reals: tuple[Crossing, ...]
    nearest: Sequence[Place]  # of modulus margin and disk margin
    far: int = 0  # crossings of the real axis that are out of sight and were only counted


def assembled(
    period_s: float | None,
    agreement: Agreement,
    figures: Figures | None,
    *,
    method: str,
    reason: str,
    notes: tuple[str, ...] = (),
    evidence: Evidence = "withheld",
    delay_s: float = 0.0,
    listed_to: float = math.inf,
    band_rad_s: tuple[float, float] | None = None,
    hidden_at_limit: int = 0,
) -> StabilityMargins:
    """Put a result together, its margins within the band; without figures they are withheld."""
    verdict = _verdict(agreement)
    end = math.inf if period_s is None else math.pi / period_s
    band = (0.0, min(listed_to, end)) if band_rad_s is None else band_rad_s
    if figures is None or verdict == "undecided":
        return StabilityMargins(
            None, "undecided", (), (), (), None, None, None, period_s, delay_s, band, method, agreement,
            notes, "withheld", reason,
        )  # fmt: skip
    seen = [c for c in figures.reals if not c.out_of_sight]
    far = figures.far + len(figures.reals) - len(seen)
    phase_margins = tuple(_phase_margin(c, period_s) for c in figures.gains)
    (modulus, at), (disk, disk_at) = figures.nearest
    result = StabilityMargins(
        verdict == "stable", verdict,
        tuple(GainMargin(float(1.0 / abs(c.L)), unwarped(c.w, period_s), c.touch) for c in seen),
        phase_margins, delay_margins(phase_margins, period_s),
        modulus, unwarped(at, period_s), DiskMargin(disk, unwarped(disk_at, period_s)),
        period_s, delay_s, band, method, agreement, (*notes, *_far_note(far)), evidence, reason,
        hidden_modes_at_limit=hidden_at_limit,
    )  # fmt: skip
    return result if band_rad_s is None else _within(result, *band_rad_s)


def _phase_margin(c: Crossing, period_s: float | None) -> PhaseMargin:
    deg = math.degrees(math.atan2(-c.L.imag, -c.L.real))
    return PhaseMargin((deg if deg > -180.0 else 180.0) + 0.0, unwarped(c.w, period_s), c.touch)


def _far_note(far: int) -> tuple[str, ...]:
    if not far:
        return ()
    crossings = "1 crossing" if far == 1 else f"{far} crossings"
    return (f"not listed, as their margin is beyond 200 dB: {crossings} of the negative real axis",)


def _verdict(agreement: Agreement) -> Verdict:
    """From the two ways; both are asked only where no pole is at the stability limit."""
    counts = {agreement.unstable_poles, agreement.unstable_nyquist} - {None}
    if not counts or not agreement.agree:
        return "undecided"
    if counts != {0}:
        return "unstable"
    return "at the stability limit" if agreement.poles_at_limit else "stable"


def delay_margins(phase_margins: tuple[PhaseMargin, ...], period_s: float | None) -> tuple[DelayMargin, ...]:
    """The delay that uses up each phase margin; a negative margin by way of a full turn."""
    lags = (math.radians(one.deg if one.deg >= 0.0 else one.deg + 360.0) for one in phase_margins)
    pairs = [(lag / one.frequency_rad_s, one) for lag, one in zip(lags, phase_margins, strict=True)]
    return tuple(DelayMargin(t, t / period_s if period_s else None, one.frequency_rad_s) for t, one in pairs)


def _within(margins: StabilityMargins, low: float, high: float) -> StabilityMargins:
    lists: dict[str, Any] = {
        name: tuple(one for one in getattr(margins, name) if low <= one.frequency_rad_s <= high)
        for name in ("gain_margins", "phase_margins", "delay_margins")
    }
    return replace(margins, **lists)
