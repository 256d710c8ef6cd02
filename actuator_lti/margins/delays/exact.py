"""A loop with exact delays as two quasi-polynomials with exact coefficients."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpq_mat, fmpq_poly

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.delays.form import DelayForm
from actuator_lti.margins.exact.loop import exact_loop, neighbours, rational
from actuator_lti.margins.exact.roots import NOTHING_HIDDEN, HalfPlanes
from actuator_lti.margins.given import ULP, Given, moved

_MOST_DELAYS = 8
HIGHEST_ORDER = 16
_FEED_THROUGH = (
    "a direct feed-through with a delay that is fed back or beside another path: allowed are systems whose "
    "gain falls off at high frequency, or one delay in series with all of the system"
)


@dataclass(frozen=True)
class Quasi:
    """f(s) = sum of p_k(s) exp(-s tau_k), everything rational."""

    terms: tuple[tuple[fmpq_poly, fmpq], ...]

    def derivative(self) -> Quasi:
        """df/ds: each term (p' - tau p) exp(-s tau)."""
        return Quasi(tuple((p.derivative() - tau * p, tau) for p, tau in self.terms))

    def __add__(self, other: Quasi) -> Quasi:
        return Quasi((*self.terms, *other.terms))

    def late(self, delay: fmpq) -> Quasi:
        return Quasi(tuple((p, tau + delay) for p, tau in self.terms))

    def times(self, factor: int) -> Quasi:
        return Quasi(tuple((factor * p, tau) for p, tau in self.terms))

    def series(self, order: int) -> fmpq_poly:
        """Its Taylor series at s = 0 below ``order``, exact."""
        out = fmpq_poly()
        for p, tau in self.terms:
            part, factor = fmpq_poly(), fmpq(1)
            for k in range(order):
                part += fmpq_poly([0] * k + [factor])
                factor = factor * -tau / (k + 1)
            out += p * part
        return out.truncate(order)

    def __call__(self, s: acb) -> acb:
        """The value at s, an interval or a point, at the working precision of the first call."""
        return sum((p(s) * (-s * tau).exp() if tau else p(s) for p, tau in self._balls), acb(0))

    @cached_property
    def _balls(self) -> list[tuple[acb_poly, arb]]:
        return [(acb_poly(p), arb(tau)) for p, tau in self.terms]


@dataclass(frozen=True)
class ExactDelayLoop:
    """L = N/D, hidden modes cancelled; retarded: the term of D without delay has the highest power alone."""

    N: Quasi
    D: Quasi
    degree: int
    hidden: HalfPlanes = NOTHING_HIDDEN

    @cached_property
    def at_rest(self) -> tuple[fmpq_poly, fmpq_poly]:
        """Taylor series of N and D at s = 0."""
        return self.N.series(HIGHEST_ORDER), self.D.series(HIGHEST_ORDER)

    @property
    def delay(self) -> float:
        """The longest delay of any term, s."""
        return max(float(arb(tau).mid()) for _, tau in (*self.N.terms, *self.D.terms))

    @cached_property
    def early(self) -> ExactDelayLoop:
        """Without the delay that all of N has, which does not change abs(L)."""
        common = min((tau for _, tau in self.N.terms), default=fmpq(0))
        return replace(self, N=self.N.late(-common))

    @property
    def lead(self) -> arb:
        """The coefficient of the highest power of s in D."""
        return arb(self.D.terms[0][0][self.degree])

    @cached_property
    def lowest(self) -> float:
        """A frequency below the smallest root of any of the polynomials, and the turn of any delay."""
        sizes = [1.0]
        for p, tau in (*self.D.terms, *self.N.terms):
            c = [abs(float(arb(x).mid())) for x in p.coeffs()]
            first = next(k for k, x in enumerate(c) if x)
            if len(c) > first + 1:
                sizes.append(
                    min((c[first] / x) ** (1.0 / (k - first)) for k, x in enumerate(c) if k > first and x)
                )
            if tau != 0:
                sizes.append(1.0 / float(arb(tau).mid()))
        if not (low := 0.1 * min(sizes[1:] or sizes)) > 0.0:
            raise NumericalError("the coefficients of the loop are too far apart")
        return low

    def beyond(self, gain: float) -> float:
        """A frequency above which |L| < gain: the leading power against all other coefficients together."""
        sizes_N, sizes_D = _sizes(self.N), _sizes(self.D)

        def holds(x: float) -> bool:
            above, rest = sizes_N(arb(x)), sizes_D(arb(x))
            return bool(above < gain * (2 * abs(self.lead) * arb(x) ** self.degree - rest))

        x = max(self.lowest, 1e-300)
        while not holds(x):
            x *= 2.0
            if x > 1e300:
                raise NumericalError("the gain of the loop does not fall off")
        return x


def _sizes(f: Quasi) -> arb_poly:
    """The polynomial that no f(j x) exceeds."""
    return sum((arb_poly([abs(arb(c)) for c in p.coeffs()]) for p, _ in f.terms), arb_poly())


def exact_behind_delay(given: Given, delay_s: float) -> tuple[ExactDelayLoop, ...]:
    """A continuous rational loop behind a delay, common factors cancelled, and its neighbours 8 ulp away."""
    loop = exact_loop(given)
    if loop.N.degree() >= loop.D.degree():
        raise InputError(_FEED_THROUGH)
    out = []
    for near, way in zip((loop, *neighbours(given, loop)), (0.0, 1.0, -1.0), strict=True):
        delay = rational(delay_s + way * ULP * float(np.spacing(delay_s)))
        N, D = (Quasi(((fmpq_poly(p), tau),)) for p, tau in ((near.N, delay), (near.D, fmpq(0))))
        out.append(ExactDelayLoop(N, D, near.degree, loop.hidden_modes))
    return tuple(out)


def exact_inside_delays(form: DelayForm, *, reduced: bool = True) -> tuple[ExactDelayLoop, ...]:
    """A loop with delays inside, and its neighbours."""
    near = [DelayForm(*moved(way, form.whole, form.delays_s, form.series_s)) for way in (1.0, -1.0)]
    return tuple(exact_delay_loop(each, reduced=reduced) for each in (form, *near))


def exact_delay_loop(form: DelayForm, *, reduced: bool = True) -> ExactDelayLoop:
    r"""Expand the determinants, affine in each exp(-s tau_k): one polynomial for each subset of delays.

    D = det [sI - A, -B2 E; -C2, I - D22 E] with E = diag exp(-s tau_k), and N the same bordered by
    (-B1, -D21; C1, D12 E, D11), which is (D11 - 1) D and D less the product of that column and row. A power
    of s in every term of both is cancelled where the loop is to be ``reduced``.

    Raises `InputError`: for too many delays, or a neutral loop.
    """
    q, n = form.delays_s.size, form.states
    if q > _MOST_DELAYS:
        raise InputError(f"exact arithmetic takes at most {_MOST_DELAYS} inner delays; this loop has {q}")
    delays = [rational(tau) for tau in form.delays_s]
    late = [sum((tau for k, tau in enumerate(delays) if mask >> k & 1), fmpq(0)) for mask in range(1 << q)]
    m = n + q
    whole, column = _exact_matrix(form.whole[:m, :m]), _exact_matrix(form.whole[:m, m:])
    row, through = _exact_matrix(form.whole[m:, :m]), rational(form.whole[m, m])
    below = list(zip(_determinants(whole, n), late, strict=True))
    fed_back = _determinants(whole - column * row, n)
    above = [(p + (through - 1) * d, tau) for p, (d, tau) in zip(fed_back, below, strict=True)]
    if any(p.degree() >= n for p, _ in below[1:]) or any(p.degree() >= n for p, _ in above):
        raise InputError(_FEED_THROUGH)
    N, D = ([(p, tau) for p, tau in terms if p.degree() >= 0] for terms in (above, below))
    while reduced and N and n and all(p[0] == 0 for p, _ in (*N, *D)):
        N, D = ([(p // fmpq_poly([0, 1]), tau) for p, tau in terms] for terms in (N, D))
        n -= 1
    return ExactDelayLoop(Quasi(tuple(N)).late(rational(form.series_s)), Quasi(tuple(D)), n)


def _determinants(whole: fmpq_mat, n: int) -> list[fmpq_poly]:
    """Of [sI - A, -B E; -C, I - D E], E = diag(e_k): the polynomials at each product of e_k, by its mask.

    With e_k one or zero it is det(I - D) det(sI - A - B (I - D)^-1 C) of the delays that are there.
    """
    states, q, found = range(n), whole.nrows() - n, []
    for mask in range(1 << q):
        there = [n + k for k in range(q) if mask >> k & 1]
        A, B, C, D = (
            fmpq_mat(len(rows), len(columns), [whole[r, c] for r in rows for c in columns])
            for rows in (states, there) for columns in (states, there)
        )  # fmt: skip
        K = _exact_matrix(np.eye(len(there))) - D
        if K.det() == 0:
            raise InputError("delays feed back on themselves at once: of neutral type, no margins are given")
        found.append((A + B * K.inv() * C).charpoly() * K.det() if there else A.charpoly())
    for k in range(q):
        for mask in range(len(found)):
            if mask >> k & 1:
                found[mask] -= found[mask ^ (1 << k)]
    return found


def _exact_matrix(M: Any) -> fmpq_mat:
    rows, columns = M.shape
    return fmpq_mat(rows, columns, [rational(x) for x in M.ravel()])
