"""A loop with exact delays as two quasi-polynomials with exact coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from flint import acb, acb_poly, arb, fmpq, fmpq_mat, fmpq_poly

from actuator_lti.errors import InputError
from actuator_lti.margins.certified_roots import NOTHING_HIDDEN, HalfPlanes, half_planes
from actuator_lti.margins.delay_form import DelayForm
from actuator_lti.margins.exact_loop import exact_loop, neighbours
from actuator_lti.margins.given import ULP, Given

_MOST_DELAYS = 5
_MOST_AT_REST = 6
Terms = tuple[tuple[fmpq_poly, fmpq], ...]


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
        """Behind one more delay."""
        return Quasi(tuple((p, tau + delay) for p, tau in self.terms))

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

    def balls(self) -> list[tuple[acb_poly, arb]]:
        """The terms at the working precision, for `at`."""
        return [(acb_poly(p), arb(tau)) for p, tau in self.terms]


def at(balls: list[tuple[acb_poly, arb]], s: acb) -> acb:
    """The value at s, an interval or a point."""
    total = acb(0)
    for p, tau in balls:
        total += p(s) * (-s * tau).exp()
    return total


@dataclass(frozen=True)
class ExactDelayLoop:
    """L = N/D, hidden modes cancelled; retarded: the term of D without delay has the highest power alone."""

    N: Quasi
    D: Quasi
    degree: int
    hidden: HalfPlanes = NOTHING_HIDDEN


def neighbour(form: DelayForm, way: float) -> DelayForm:
    """The same with every entry and delay 8 ulp away, see `Given.neighbours`."""
    rng = np.random.default_rng(0)

    def moved(entries: Any) -> Any:
        x = np.asarray(entries, dtype=float)
        y = x + way * ULP * np.spacing(x) * rng.choice([-1.0, 1.0], x.shape) * (x != 0.0)
        return y if y.ndim else float(y)

    names = ("A", "B1", "B2", "C1", "C2", "D11", "D12", "D21", "D22", "delays", "series_s")
    values = {name: getattr(form, name) for name in DelayForm.__dataclass_fields__}
    return DelayForm(**{**values, **{name: moved(values[name]) for name in names}})


def exact_behind_delay(given: Given, delay_s: float) -> tuple[ExactDelayLoop, ...]:
    """A continuous rational loop behind a delay, common factors cancelled, and its neighbours 8 ulp away."""
    loop = exact_loop(given)
    if loop.N.degree() >= loop.D.degree():
        raise InputError(
            "direct feed-through: exact arithmetic with delays takes a loop whose gain falls off"
        )
    hidden = half_planes(loop.hidden)
    out = []
    for near, way in zip((loop, *neighbours(given, loop)), (0.0, 1.0, -1.0), strict=True):
        delay = _exact(delay_s + way * ULP * float(np.spacing(delay_s)))
        N, D = (((fmpq_poly(p), tau),) for p, tau in ((near.N, delay), (near.D, fmpq(0))))
        out.append(ExactDelayLoop(Quasi(N), Quasi(D), near.degree, hidden))
    return tuple(out)


def exact_inside_delays(form: DelayForm) -> tuple[ExactDelayLoop, ...]:
    """A loop with delays inside, and its neighbours."""
    return tuple(exact_delay_loop(f) for f in (form, neighbour(form, 1.0), neighbour(form, -1.0)))


def exact_delay_loop(form: DelayForm) -> ExactDelayLoop:
    r"""Expand the determinants, affine in each exp(-s tau_k): one polynomial for each subset of delays.

    D = det [sI - A, -B2 E; -C2, I - D22 E] and N the same bordered by (-B1, -D21; C1, D12 E, D11), with
    E = diag exp(-s tau_k); a column without its delay is a unit vector, which takes its row away. A power of
    s in every term of both is cancelled.

    Raises
    ------
    InputError
        Too many delays, or a neutral loop.
    """
    q, n = form.delays.size, form.B1.size
    if q > _MOST_DELAYS:
        raise InputError(f"exact arithmetic takes at most {_MOST_DELAYS} inner delays; this loop has {q}")
    delays = [_exact(tau) for tau in form.delays]
    above, below = [], []
    for size in range(q + 1):
        for chosen in combinations(range(q), size):
            tau = sum((delays[k] for k in chosen), fmpq(0))
            S = list(chosen)
            core = np.block([[-form.A, -form.B2[:, S]], [-form.C2[S], -form.D22[np.ix_(S, S)]]])
            column = np.concatenate((-form.B1, -form.D21[S]))
            row = np.concatenate((form.C1, form.D12[S]))
            whole = np.block([[core, column[:, None]], [row[None], np.array([[form.D11]])]])
            below.append((_determinant(core, n), tau))
            above.append((_determinant(whole, n), tau))
    if any(p.degree() >= n for p, _ in below[1:]) or any(p.degree() >= n for p, _ in above):
        raise InputError(
            "direct feed-through: exact arithmetic with delays takes a loop whose gain falls off"
        )
    N, D, n = _without_common_s(_present(above), _present(below), n)
    return ExactDelayLoop(Quasi(N).late(_exact(form.series_s)), Quasi(D), n)


def _without_common_s(N: Terms, D: Terms, degree: int) -> tuple[Terms, Terms, int]:
    """Cancel a factor s that stands in every term of both: a mode at zero frequency that L does not show."""
    while N and degree and all(p[0] == 0 for p, _ in (*N, *D)):
        N, D = (tuple((p // fmpq_poly([0, 1]), tau) for p, tau in terms) for terms in (N, D))
        degree -= 1
    return N, D, degree


def _present(terms: list[tuple[fmpq_poly, fmpq]]) -> Terms:
    return tuple((p, tau) for p, tau in terms if p.degree() >= 0)


def _exact(x: float) -> fmpq:
    above, below = float(x).as_integer_ratio()
    return fmpq(above, below)


def _determinant(M: Any, states: int) -> fmpq_poly:
    """det(M + s I) with s on the first ``states`` rows only: by its values at 0, 1, ..., states."""
    m = M.shape[0]
    if not m:
        return fmpq_poly([1])
    entries = [_exact(x) for x in M.ravel()]
    values = []
    for s in range(states + 1):
        shifted = list(entries)
        for k in range(states):
            shifted[k * m + k] = entries[k * m + k] + s
        values.append(fmpq_mat(m, m, shifted).det())
    return _newton(values)


def _newton(values: list[fmpq]) -> fmpq_poly:
    """The polynomial through (k, values[k])."""
    differences, table = [values[0]], list(values)
    for k in range(1, len(values)):
        table = [(b - a) / k for a, b in pairwise(table)]
        differences.append(table[0])
    out = fmpq_poly([differences[-1]])
    for k in range(len(values) - 2, -1, -1):
        out = out * fmpq_poly([-k, 1]) + differences[k]
    return out


def singular_at_rest(form: DelayForm) -> bool:
    """Whether the open loop has a pole at zero frequency exactly, by its entries."""
    inner = np.block([[form.A, form.B2], [form.C2, form.D22 - np.eye(form.delays.size)]])
    m = inner.shape[0]
    entries = [fmpq(*float(x).as_integer_ratio()) for x in inner.ravel()]
    return bool(fmpq_mat(m, m, entries).det() == 0)


def shown_at_rest(form: DelayForm) -> bool:
    """Whether L shows a pole at zero frequency: N(0) is not zero, and stays what it is for the neighbours.

    The slope of L cannot tell: behind a weak spring the residue may be 1e-6 of what hides it.
    """
    values = [_numerator_at_rest(near) for near in (form, neighbour(form, 1.0), neighbour(form, -1.0))]
    return values[0] != 0 and all(abs(v / values[0] - 1) < fmpq(1, 100) for v in values[1:])


def _numerator_at_rest(form: DelayForm) -> fmpq:
    whole = np.block(
        [
            [-form.A, -form.B2, -form.B1[:, None]],
            [-form.C2, np.eye(form.delays.size) - form.D22, -form.D21[:, None]],
            [form.C1[None], form.D12[None], np.array([[form.D11]])],
        ]
    )
    m = whole.shape[0]
    return fmpq_mat(m, m, [_exact(x) for x in whole.ravel()]).det()


def poles_at_rest(form: DelayForm) -> int | None:
    """Multiplicity of the open loop's pole at zero frequency; ``None`` where rounding decides about it.

    Eigenvalues cannot tell a double one from one at zero beside a slow one (a weak spring that drives).
    """
    series = [_denominator_at_rest(near) for near in (form, neighbour(form, 1.0), neighbour(form, -1.0))]
    first = next((k for k, c in enumerate(series[0]) if c != 0), None)
    if first is None or any(any(near[:first]) for near in series[1:]):
        return None
    steady = all(abs(near[first] / series[0][first] - 1) < fmpq(1, 100) for near in series[1:])
    return first if steady else None


def _denominator_at_rest(form: DelayForm) -> list[fmpq]:
    """The first Taylor coefficients of D at zero, no power of s cancelled."""
    n, total = form.B1.size, fmpq_poly()
    for size in range(form.delays.size + 1):
        for chosen in combinations(range(form.delays.size), size):
            S = list(chosen)
            core = np.block([[-form.A, -form.B2[:, S]], [-form.C2[S], -form.D22[np.ix_(S, S)]]])
            tau = sum((_exact(form.delays[k]) for k in chosen), fmpq(0))
            total += Quasi(((_determinant(core, n), tau),)).series(_MOST_AT_REST)
    return [total[k] for k in range(_MOST_AT_REST)]


def value_at_rest(form: DelayForm) -> float | None:
    """L(0) with the power of s that N and D share cancelled; ``None`` where that leaves a pole."""
    if form.delays.size > _MOST_DELAYS:
        return None
    loop = exact_delay_loop(form)
    above, below = loop.N.series(1)[0], loop.D.series(1)[0]
    return None if below == 0 else float((above / below).p) / float((above / below).q)
