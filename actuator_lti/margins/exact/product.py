"""A rational loop behind any delay, held by its certified zeros and poles, and what its data determine.

Where the factors of double precision are in doubt, those of the exact polynomials are not: each root is known
to more digits than a double has, and so is its way to any point beside it. What is asked of the axis is the
same, once for the loop as given and once for each of its neighbours 8 ulp away.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from flint import acb, arb

from actuator_lti.margins.along import Along
from actuator_lti.margins.checked import passed_into, refuse_neutral
from actuator_lti.margins.distances import Distance, Place
from actuator_lti.margins.exact.certified import certified_margins
from actuator_lti.margins.exact.decided import ACROSS, counted, hidden_notes, shared
from actuator_lti.margins.exact.loop import ExactLoop, exact_loop, neighbours
from actuator_lti.margins.factored import with_delay
from actuator_lti.margins.given import ULP, Given
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.trust import Doubtful, in_double_precision
from actuator_lti.systems.precision import precision
from actuator_lti.types import Complex, Real

_BITS = 160  # of the roots


@dataclass(frozen=True)
class ProductLoop(RationalLoop):
    """L = lead times the product of (s - root)^weight; zeros weigh 1, poles -1."""

    roots: Complex = field(default_factory=lambda: np.empty((2, 0), dtype=complex))  # doubles, what they lack
    weights: Real = field(default_factory=lambda: np.empty(0))
    lead: float = 0.0

    def response_and_slope(self, x: Real) -> tuple[Complex, Complex]:
        """L without the delay and dL/dx on the axis."""
        away = self._away(1j * x)
        L = self._product(away)
        slope: Complex = L * (1j / away @ self.weights)
        return L, slope

    def _values(self, p: Complex) -> Complex:
        return self._product(self._away(p))

    def _product(self, away: Complex) -> Complex:
        return np.asarray(self.lead * np.exp(np.log(away) @ self.weights.astype(complex)))

    def _away(self, p: Complex) -> Complex:
        """From each root to points, right to its last digit: the difference of two close doubles is exact."""
        away: Complex = (p[:, None] - self.roots[0]) - self.roots[1]
        return away


@in_double_precision()
def late_margins(given: Given, delay_s: float, band: tuple[float, float] | None) -> StabilityMargins:
    """All margins of a rational loop behind a delay; `Doubtful` where its data do not determine them."""
    with precision(_BITS):
        loop = exact_loop(given)
        if loop.N.degree() < 0:  # nothing is fed back, early or late
            return replace(certified_margins(given, band), delay_s=delay_s)
        delays = (delay_s + way * ULP * float(np.spacing(delay_s)) for way in (0.0, 1.0, -1.0))
        near = (loop, *neighbours(given, loop, placed=0))
        one = len({_above_one(each) for each in near}) > 1 or _above_one(loop) == 0
        pairs = zip(near, delays, strict=True)
        base, *others = [_found(each, given.period_s, delay, band, one) for each, delay in pairs]
    found, nyquist, poles = base
    notes = counted([nyquist, *(other for _, other, _ in others)])
    if notes is None:
        raise Doubtful(ACROSS)
    common = shared(*((each.gains, each.reals) for each, *_ in (base, *others)))
    hidden = loop.hidden_modes
    return found.margins(
        Agreement(None if poles is None else poles + hidden.right, nyquist + hidden.right),
        f"zeros and poles certified, intervals leave no crossing out; {common.moved_text}",
        delay_s,
        (*hidden_notes(hidden), *common.notes, *notes),
        hidden.at_limit + loop.hidden_at_end,
        common.reals,
    )


@in_double_precision()
def late_distances(given: Given, delay_s: float, distances: Sequence[Distance]) -> list[Place]:
    """Smallest values of distances of a loop behind a delay, each with its w, as its doubles have them."""
    with precision(_BITS):
        loop = exact_loop(given)
        if loop.N.degree() < 0:
            return [(distance.at_no_gain, 0.0) for distance in distances]
        return _along(loop, given.period_s, delay_s, None, True).nearest(distances)


def _above_one(loop: ExactLoop) -> int:
    """The sign of L(0) - 1: where neighbours do not share it, no crossing next to zero frequency is told."""
    above, below = loop.N[0] * loop.D[0], loop.D[0] * loop.D[0]
    return int(above > below) - int(above < below)


def _found(
    loop: ExactLoop, period_s: float | None, delay_s: float, band: tuple[float, float] | None, one: bool
) -> tuple[Along, int, int | None]:
    """What one of them does along the axis, and its unstable closed-loop poles by both ways."""
    found, free = _along(loop, period_s, delay_s, band, one), loop.closed_poles
    nyquist = loop.poles.right - found.half_turns
    if period_s is not None or free.at_limit:
        return found, nyquist, None
    if nyquist != free.right + passed_into(found.loop, found.gain_w):
        raise Doubtful("poles and Nyquist count disagree")
    return found, nyquist, nyquist


def _along(
    loop: ExactLoop, period_s: float | None, delay_s: float, band: tuple[float, float] | None, one: bool
) -> Along:
    if loop.D.degree() < loop.degree:
        raise Doubtful("a pole at z = -1, where L behind part of a sample jumps")
    product = _product(loop, period_s, delay_s)
    refuse_neutral(product)
    factors = replace(
        with_delay(product.roots[0], product.weights, product),
        log_gain=math.log(abs(product.lead)),
        phase=math.pi * (loop.zeros.right - loop.poles.right + (product.lead < 0.0)),
        one_at_rest=one,
    )
    return Along(factors, product, band).polish()


def _product(loop: ExactLoop, period_s: float | None, delay_s: float) -> ProductLoop:
    n, below = loop.degree, arb(loop.D[loop.degree])
    coefficients = np.array([[float(arb(p[k]) / below) for k in range(n, -1, -1)] for p in (loop.N, loop.D)])
    roots = [*loop.zeros.roots, *loop.poles.roots]
    whole = [complex(root) for root in roots]
    rest = [complex(root - acb(near)) for root, near in zip(roots, whole, strict=True)]
    return ProductLoop(
        np.zeros((n, n)), np.zeros(n), np.zeros(n), float(coefficients[0, 0]), period_s,
        coefficients=coefficients, delay=delay_s / (period_s or 1.0), roots=np.array((whole, rest)),
        weights=np.repeat((1.0, -1.0), (len(loop.zeros.roots), len(loop.poles.roots))),
        lead=float(arb(loop.N[loop.N.degree()]) / below),
    )  # fmt: skip
