"""A loop with exact delays as two quasi-polynomials with exact coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from flint import acb, acb_poly, arb, fmpq, fmpq_mat, fmpq_poly

from actuator_lti.errors import InputError
from actuator_lti.margins.delay_form import DelayForm
from actuator_lti.margins.given import ULP

_MOST_DELAYS = 5


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
    """L = N/D; retarded: the term of D without delay has the highest power alone."""

    N: Quasi
    D: Quasi
    degree: int


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


def exact_delay_loop(form: DelayForm) -> ExactDelayLoop:
    r"""Expand the determinants, affine in each exp(-s tau_k): one polynomial for each subset of delays.

    D = det [sI - A, -B2 E; -C2, I - D22 E] and N the same bordered by (-B1, -D21; C1, D12 E, D11), with
    E = diag exp(-s tau_k); a column without its delay is a unit vector, which takes its row away.

    Raises
    ------
    InputError
        Too many delays, or a neutral loop.
    """
    q, n = form.delays.size, form.B1.size
    if q > _MOST_DELAYS:
        raise InputError(f"exact arithmetic takes at most {_MOST_DELAYS} inner delays; this loop has {q}")
    delays = [_exact(tau) for tau in form.delays]
    N, D = [], []
    for size in range(q + 1):
        for chosen in combinations(range(q), size):
            tau = sum((delays[k] for k in chosen), fmpq(0))
            S = list(chosen)
            core = np.block([[-form.A, -form.B2[:, S]], [-form.C2[S], -form.D22[np.ix_(S, S)]]])
            column = np.concatenate((-form.B1, -form.D21[S]))
            row = np.concatenate((form.C1, form.D12[S]))
            whole = np.block([[core, column[:, None]], [row[None], np.array([[form.D11]])]])
            D.append((_determinant(core, n), tau))
            N.append((_determinant(whole, n), tau))
    if any(p.degree() >= n for p, _ in D[1:]) or any(p.degree() >= n for p, _ in N):
        raise InputError(
            "direct feed-through: exact arithmetic with delays takes a loop whose gain falls off"
        )
    late = Quasi(_present(N)).late(_exact(form.series_s))
    return ExactDelayLoop(late, Quasi(_present(D)), n)


def _present(terms: list[tuple[fmpq_poly, fmpq]]) -> tuple[tuple[fmpq_poly, fmpq], ...]:
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
