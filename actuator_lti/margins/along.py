"""What a loop does along the whole stability boundary, from its factors: crossings, turns, distances."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.axis._search import FAR_LOG
from actuator_lti.margins.assemble import Figures, assembled, far_note, out_of_sight, within
from actuator_lti.margins.axis_parts import (
    Part,
    axis_ends,
    axis_parts,
    distances_over,
    half_turns_about,
    merged,
)
from actuator_lti.margins.axis_search import Factored
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.factored import Response
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement, GainMargin, PhaseMargin

_METHOD = "factors of the loop, bounded over whole intervals of frequency; crossings polished by Newton"


@dataclass(frozen=True)
class Along:
    """Crossings of the unit circle and of the negative real axis, and what their listing needs."""

    factors: Factored
    response: Response
    band: tuple[float, float] | None
    parts: list[Part]
    ends: tuple[complex, complex]
    listed_to: float
    floor: float  # gain below which, behind a delay, no crossing of the real axis is listed
    gain_x: Real
    gain_L: Complex
    real_x: Real
    real_L: Complex
    half_turns: int  # of 1 + L about the origin
    far: int  # crossings that are not listed

    @classmethod
    def of(cls, factors: Factored, response: Response, band: tuple[float, float] | None) -> Along:
        """Search the axis, and polish what is found by the loop itself."""
        parts, listed_to, floor = axis_parts(factors, band)
        ends = axis_ends(factors, response)
        gain_w, real_w, rising, far = merged(parts)
        gains, reals = response.polished(gain_w, gain=True), _polished(factors, response, real_w)
        turned = half_turns_about(factors, response, parts, ends, reals[1], rising)
        far += int(np.count_nonzero(np.abs(np.log(np.abs(reals[1]))) > FAR_LOG))
        far += sum(-math.inf < value.real < 0.0 and out_of_sight(value) for value in ends)
        return cls(factors, response, band, parts, ends, listed_to, floor, *gains, *reals, turned, far)

    @property
    def listed(self) -> Mask:
        """Which crossings of the real axis are told as gain margins."""
        size = np.abs(self.real_L)
        floored = math.isfinite(self.listed_to) and self.band is None and self.factors.at_infinity
        return np.asarray((np.abs(np.log(size)) <= FAR_LOG) & (size >= (self.floor if floored else 0.0)))

    @property
    def on_real_axis(self) -> tuple[tuple[float, complex], ...]:
        """The argument of the loop and L at its ends, where L lies on the negative real axis there."""
        response = self.response
        turning = response.loop.period_s is None and response.delay
        last = 0j if turning else response.onto_axis(self.ends[1])
        both = ((0.0, self.ends[0]), (response.loop.end, last))
        return tuple((x, L) for x, L in both if L.real < 0.0 and not out_of_sight(L))

    def margins(
        self,
        agreement: Agreement,
        reason: str,
        delay_s: float,
        notes: tuple[str, ...] = (),
        hidden_border: int = 0,
    ) -> StabilityMargins:
        """The result, within the band."""
        result = assembled(
            self.response.loop.period_s,
            agreement,
            Figures(
                self._gain_margins(),
                self._phase_margins(),
                *distances_over(self.factors, self.response, self.parts, self.ends, (MODULUS, DISK)),
            ),
            method=_METHOD,
            notes=(*notes, *far_note(self.far), *self._tail_note()),
            evidence="checked",
            reason=reason,
            delay_s=delay_s,
            band_rad_s=(0.0, self.listed_to) if math.isfinite(self.listed_to) else None,
            hidden_border=hidden_border,
        )
        return within(result, self.band)

    def _gain_margins(self) -> tuple[GainMargin, ...]:
        first, last = ([at for at in self.on_real_axis if bool(at[0]) == end] for end in (False, True))
        crossed = zip(self.real_x[self.listed], self.real_L[self.listed], strict=True)
        frequency = self.response.loop.frequency
        return tuple(GainMargin(float(1.0 / abs(L)), frequency(x)) for x, L in (*first, *crossed, *last))

    def _phase_margins(self) -> tuple[PhaseMargin, ...]:
        angles = np.degrees(np.angle(-self.gain_L)).tolist()
        return tuple(
            PhaseMargin(deg if deg > -180.0 else 180.0, self.response.loop.frequency(x))
            for deg, x in zip(angles, self.gain_x, strict=True)
        )

    def _tail_note(self) -> tuple[str, ...]:
        top, floor, factors = self.listed_to, self.floor, self.factors
        if not math.isfinite(top) or self.band is not None:
            return ()
        if not factors.at_infinity:
            every = 2.0 * math.pi / factors.delay
            return (
                f"gain margins beyond {top:.4g} rad/s, every {every:.4g} rad/s without end, are not listed: "
                f"their ratio is {math.exp(-factors.log_gain):.6g}",
            )
        quiet = -20.0 * math.log10(floor)
        return (f"gain margins above {quiet:.4g} dB beyond {top:.4g} rad/s are not listed",)


def _polished(factors: Factored, response: Response, w: Real) -> tuple[Real, Complex]:
    """Crossings of the real axis; those beyond 200 dB, which are not listed, as the factors have them."""
    log_gain = factors.log_value(w)[0]
    listed = np.abs(log_gain) <= FAR_LOG
    x, L = response.x(w), -np.exp(log_gain).astype(complex)
    x[listed], L[listed] = response.polished(w[listed], gain=False)
    return x, L
