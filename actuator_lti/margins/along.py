"""What a loop does along the whole stability boundary, from its factors: crossings, turns, distances."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np

from actuator_lti.axis._search import FAR_LOG
from actuator_lti.margins.assemble import Crossing, Figures, assembled
from actuator_lti.margins.axis_parts import axis_parts
from actuator_lti.margins.axis_search import Factored
from actuator_lti.margins.distances import DISK, MODULUS, Distance, Place
from actuator_lti.margins.factored import SAME, polished
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.tail import tail_note
from actuator_lti.margins.trust import Doubtful
from actuator_lti.types import Complex, Real

_ROUNDED = 1e-12
_STEP, _ROUNDS = 1e-6, 12  # relative; of secants
_ACCURATE = 1e-9  # relative: a smallest distance
_METHOD = "factors of the loop, bounded over whole intervals of frequency; crossings polished by Newton"


class Along:
    """A loop searched along its factors: ``ends``, L at both of them, infinity where it has a pole.

    After `polish` also ``gain_w``, ``gain_L``, ``real_w``, ``real_L``: crossings of the unit circle and of
    the negative real axis between the ends, and ``half_turns`` of 1 + L about the origin.
    """

    def __init__(self, factors: Factored, loop: RationalLoop, band: tuple[float, float] | None) -> None:
        self.factors, self.loop, self._band = factors, loop, band
        self._parts, self._listed_to, self._quiet = axis_parts(factors, band)
        order = factors.at_zero
        first = complex(math.inf if order < 0.0 else 0.0) if order else loop.at_rest()
        self.ends = first, loop.at_end()

    def polish(self) -> Along:
        """Find the crossings of the loop itself; those beyond 200 dB, which are not listed, as the factors
        have them.
        """
        parts = zip(*(part.in_w for part in self._parts), strict=True)
        gain_w, self.real_w, self._rising = map(np.concatenate, parts)
        self.gain_w, self.gain_L = polished(self.loop, gain_w, gain=True)
        log_gain = self.factors.log_value(self.real_w)[0]
        for k in np.flatnonzero(np.abs(log_gain) > FAR_LOG):
            self.real_w[k] = self.factors.onto_axis(float(self.real_w[k]))
            log_gain[k] = self.factors.log_at(float(self.real_w[k]))[0]
        self.real_L = -np.exp(log_gain).astype(complex)
        near = np.abs(log_gain) <= FAR_LOG + SAME
        self.real_w[near], self.real_L[near] = polished(self.loop, self.real_w[near], gain=False)
        self.half_turns = self._turned()
        return self

    @property
    def gains(self) -> tuple[Crossing, ...]:
        """The crossings of the unit circle."""
        return _crossings(self.gain_w, self.gain_L)

    @property
    def reals(self) -> tuple[Crossing, ...]:
        """Those of the negative real axis, the ends among them."""
        turning = self.loop.period_s is None and self.loop.delay
        end = self.ends[1]
        if self.loop.delay:  # behind part of a sample L jumps to its conjugate, over the axis at their mean
            # where it moves away from the axis before that, the crossing that goes with it lies below
            towards = not turning and end.imag * (end * self.loop.rate_at_end()).imag < 0.0
            end = complex(end.real) if towards and abs(end.real) > _ROUNDED * abs(end) else 0j
        ends = (0.0, self.ends[0]), (math.inf, end)
        first, last = ([Crossing(w, L)] if -math.inf < L.real < 0.0 else [] for w, L in ends)
        return (*first, *_crossings(self.real_w, self.real_L), *last)

    def margins(
        self,
        agreement: Agreement,
        reason: str,
        delay_s: float,
        notes: tuple[str, ...] = (),
        hidden_at_limit: int = 0,
        reals: tuple[Crossing, ...] | None = None,
    ) -> StabilityMargins:
        """The result, within the band; ``reals`` in place of its own."""
        far = sum(part.found.far for part in self._parts)
        return assembled(
            self.loop.period_s,
            agreement,
            Figures(self.gains, self.reals if reals is None else reals, self.nearest((MODULUS, DISK)), far),
            method=_METHOD,
            notes=(*notes, *self._tail_note()),
            evidence="checked",
            reason=reason,
            delay_s=delay_s,
            listed_to=self._listed_to,
            band_rad_s=self._band,
            hidden_at_limit=hidden_at_limit,
        )

    def nearest(self, distances: Sequence[Distance]) -> list[Place]:
        """Smallest values of distances, each with its w."""
        last = complex(-abs(self.ends[1])) if self.factors.delay else self.ends[1]
        best = [min((d.at(self.ends[0]), 0.0), (d.at(last), math.inf)) for d in distances]
        for part in self._parts:
            found = part.factors.nearest(part.found, distances, best)
            best = [
                (new[0], 1.0 / new[1] if part.beyond else new[1]) if new[0] < old[0] else old
                for new, old in zip(found, best, strict=True)
            ]
        # what the search leaves, a part in 1e8, may be all that a small loop has
        reals = self.reals
        best = [
            min([old, *((d.at(at.L), at.w) for at in reals)]) for old, d in zip(best, distances, strict=True)
        ]
        inside = [w for _, w in best if 0.0 < w < math.inf]
        L = {0.0: self.ends[0]}
        L |= dict(zip(inside, self.loop.at(np.array(inside)).tolist(), strict=True)) if inside else {}
        found = [(d.at(L[w]) if w in L else value, w) for d, (value, w) in zip(distances, best, strict=True)]
        # where the factors are off, so is their smallest place, and the value there by the square of that
        off = self.factors.slack / math.sqrt(_ACCURATE)
        pairs = zip(distances, found, strict=True)
        return [self._lowest(d, place) if place[0] < off else place for d, place in pairs]

    def _lowest(self, distance: Distance, place: Place) -> Place:
        """The smallest value of the loop itself next to a place: where its own slope is zero, by secants."""
        loop, (value, w) = self.loop, place
        if not 0.0 < w < math.inf:
            return place

        def slope_at(x: float) -> tuple[float, complex]:
            at = np.array([x])
            L, slope = loop.response_and_slope(at)
            turned, late = loop.late_rate(at, slope / L)[0], complex(loop.late(at, L)[0])
            above, below = distance.over(late, 1.0)
            if not above or not below:
                return 0.0, late
            return float((late * turned * (distance.a / above - distance.c / below)).real), late

        x = float(loop.x(np.array([w]))[0])
        before, step = slope_at(x)[0], _STEP * x
        for _ in range(_ROUNDS):
            x += step
            at = math.tan(0.5 * x) if loop.in_z else x
            if not 0.0 < at < math.inf:
                break
            slope, L = slope_at(x)
            value, w = min((value, w), (distance.at(L), at))
            if slope == before or not abs(step) > _ROUNDED * x:
                break
            before, step = slope, -slope * step / (slope - before)
        return value, w

    def _turned(self) -> int:
        """Turns of 1 + L about the origin from zero frequency to the end of the axis, in half turns."""
        around = np.abs(self.real_L) > 1.0
        cut = int(np.count_nonzero(self._rising & around)) - int(np.count_nonzero(~self._rising & around))
        cut += sum(part.found.turns for part in self._parts)
        angle, first = self._from_zero()
        F = 1.0 + self.ends[1]
        if self.loop.delay:  # onto the real axis at the end
            angle, last = angle + _angle_between(F, complex(F.real)), cmath.phase(F)
        else:
            last = -_leaving(F.real, self._parts[-1].found.rate)
        return round((angle + last - first) / math.pi) + 2 * cut

    def _from_zero(self) -> tuple[float, float]:
        """The turn of 1 + L up to just above zero frequency, and its angle there."""
        factors, found = self.factors, self._parts[0].found
        if not factors.at_zero < 0.0:
            return 0.0, _leaving(1.0 + self.ends[0].real, found.rate)
        low = float(found.known[0, 0])
        on_real, on_axis = self.loop.beside_zero(low)
        gain, phase = factors.log_at(low)
        if not abs(on_axis * cmath.exp(complex(-gain, -phase)) - 1.0) <= SAME:  # integrators that cancel
            raise Doubtful("poles and zeros do not make up the loop next to zero frequency")
        turn, about = _angle_between(1.0 + on_real, 1.0 + on_axis), 0.5 * math.pi * factors.at_zero
        turn += 2.0 * math.pi * round((about - turn) / (2.0 * math.pi))
        return turn, cmath.phase(1.0 + on_axis)

    def _tail_note(self) -> tuple[str, ...]:
        top, factors = self._listed_to, self.factors
        if not factors.delay or self._band is not None:
            return ()
        if factors.at_infinity:
            return tail_note(top, self._quiet)
        every = 2.0 * math.pi / factors.delay
        return (
            f"gain margins beyond {top:.4g} rad/s, every {every:.4g} rad/s without end, are not listed: "
            f"their ratio is {math.exp(-factors.log_gain):.6g}",
        )


def _crossings(w: Real, L: Complex) -> tuple[Crossing, ...]:
    return tuple(Crossing(*each) for each in zip(w.tolist(), L.tolist(), strict=True))


def _angle_between(start: complex, stop: complex) -> float:
    """Angle from one point to another of the same closed half plane."""
    return cmath.phase(stop * start.conjugate())


def _leaving(F: float, rate: float) -> float:
    """The angle of 1 + L beside an end of the axis, where it is F and its phase turns at a rate."""
    return 0.0 if F >= 0.0 else -math.pi if rate > 0.0 else math.pi
