"""A rational loop behind any delay, held by its certified zeros and poles, and what its data determine.

Where the factors of double precision are in doubt, those of the exact polynomials are not: each root is known
to more digits than a double has, and so is its way to any point beside it. What is asked of the axis is the
same, once for the loop as given and once for each of its neighbours 8 ulp away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from flint import acb, arb, ctx

from actuator_lti.margins.along import Along
from actuator_lti.margins.assemble import hidden_notes
from actuator_lti.margins.checked import in_double_precision, passed_into
from actuator_lti.margins.exact.certified import (
    Crossings,
    Lists,
    certified_margins,
    compared,
    dropped_note,
    moved_text,
)
from actuator_lti.margins.exact.crossings import Crossing
from actuator_lti.margins.exact.loop import ExactLoop, exact_loop, neighbours
from actuator_lti.margins.exact.roots import HalfPlanes, half_planes
from actuator_lti.margins.factored import Response, with_delay
from actuator_lti.margins.given import ULP, Given
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.trust import Doubtful

_BITS = 160  # of the roots


@dataclass(frozen=True)
class ProductLoop(RationalLoop):
    """L = lead times the product of (s - root)^weight; zeros weigh 1, poles -1."""

    roots: Complex = field(default_factory=lambda: np.empty((2, 0), dtype=complex))  # doubles, what they lack
    weights: Real = field(default_factory=lambda: np.empty(0))
    lead: float = 0.0

    def response_and_slope(self, x: Real) -> tuple[Complex, Complex]:
        """L and dL/dx on the axis."""
        away = self._away(1j * x)
        L = self._product(away)
        slope: Complex = L * (1j / away @ self.weights)
        return L, slope

    def _values(self, p: Any) -> Any:
        L = self._product(self._away(p))
        return L if np.iscomplexobj(p) else L.real

    def _product(self, away: Complex) -> Complex:
        return np.asarray(self.lead * np.exp(np.log(away) @ self.weights.astype(complex)))

    def _away(self, p: Any) -> Complex:
        """From each root to points, right to its last digit: the difference of two close doubles is exact."""
        away: Complex = (p[:, None] - self.roots[0]) - self.roots[1]
        return away


def late_margins(given: Given, delay_s: float, band: tuple[float, float] | None) -> StabilityMargins:
    """All margins of a rational loop behind a delay; `Doubtful` where its data do not determine them."""
    with ctx.workprec(_BITS):
        return in_double_precision(lambda: _margins(given, delay_s, band))


def _margins(given: Given, delay_s: float, band: tuple[float, float] | None) -> StabilityMargins:
    loop = exact_loop(given)
    if loop.N.degree() < 0:  # nothing is fed back, early or late
        return replace(certified_margins(given), delay_s=delay_s)
    hidden = half_planes(loop.hidden)
    base, *others = [
        _found(near, given.period_s, delay_s + way * ULP * float(np.spacing(delay_s)), band)
        for near, way in zip((loop, *neighbours(given, loop, told=0)), (0.0, 1.0, -1.0), strict=True)
    ]
    found, nyquist, poles = base
    if any(other != nyquist for _, other, _ in others):
        raise Doubtful(f"{ULP} ulp of the entries move a closed-loop pole across the stability boundary")
    *_, reals, dropped, moved, problem = compared(
        _crossings(found), [_crossings(near) for near, *_ in others]
    )
    if problem is not None:
        raise Doubtful(problem)
    return _kept(found, reals).margins(
        Agreement(None if poles is None else poles + hidden.right, nyquist + hidden.right),
        f"zeros and poles certified, intervals leave no crossing out; {moved_text(moved)}",
        delay_s,
        (*hidden_notes(hidden.at_zero, hidden.pairs, hidden.right), *dropped_note(dropped)),
        hidden.on_border + loop.hidden_at_end,
    )


def _found(
    loop: ExactLoop, period_s: float | None, delay_s: float, band: tuple[float, float] | None
) -> tuple[Along, int, int | None]:
    """What one of them does along the axis, and its unstable closed-loop poles by both ways."""
    if loop.D.degree() < loop.degree:
        raise Doubtful("a pole at z = -1, where L behind part of a sample jumps")
    zeros, poles, free = half_planes(loop.N), half_planes(loop.D), half_planes(loop.closed)
    product = _product(loop, zeros, poles, period_s)
    response = Response(product, delay_s / (period_s or 1.0))
    factors = replace(
        with_delay(product.roots[0], product.weights, response),
        log_gain=math.log(abs(product.lead)),
        phase=math.pi * (zeros.right - poles.right + (product.lead < 0.0)),
    )
    found = Along.of(factors, response, band)
    nyquist = poles.right - found.half_turns
    if period_s is not None or free.on_border:
        return found, nyquist, None
    if nyquist != free.right + passed_into(response, found.gain_x):
        raise Doubtful("poles and Nyquist count disagree")
    return found, nyquist, nyquist


def _crossings(found: Along) -> Lists:
    """Of the unit circle and of the negative real axis, as neighbours are compared."""
    gains = zip(found.gain_x.tolist(), found.gain_L.tolist(), strict=True)
    reals = (*zip(found.real_x.tolist(), found.real_L.tolist(), strict=True), *found.on_real_axis)
    return tuple(Crossing(x, L) for x, L in gains), tuple(Crossing(x, L) for x, L in reals)


def _kept(found: Along, reals: Crossings) -> Along:
    """With those crossings of the real axis that the neighbours share."""
    keep = np.isin(found.real_x, [c.w for c in reals])
    return replace(found, real_x=found.real_x[keep], real_L=found.real_L[keep])


def _product(loop: ExactLoop, zeros: HalfPlanes, poles: HalfPlanes, period_s: float | None) -> ProductLoop:
    n, below = loop.degree, arb(loop.D[loop.degree])
    coefficients = np.array([[float(arb(p[k]) / below) for k in range(n, -1, -1)] for p in (loop.N, loop.D)])
    roots = [*zeros.roots, *poles.roots]
    whole = [complex(root) for root in roots]
    rest = [complex(root - acb(near)) for root, near in zip(roots, whole, strict=True)]
    weights = np.concatenate((np.ones(len(zeros.roots)), -np.ones(len(poles.roots))))
    states = (np.zeros((n, n)), np.zeros(n), np.zeros(n), float(coefficients[0, 0]))
    lead = float(arb(loop.N[loop.N.degree()]) / below)
    return ProductLoop(*states, period_s, False, coefficients, None, np.array((whole, rest)), weights, lead)
