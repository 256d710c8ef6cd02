"""Crossovers and verdicts of rational loops from polynomial roots at high precision, for the tests only."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from mpmath import mp, mpc, mpf, polyval

DIGITS = 50
REAL = mpf(10) ** -22


@dataclass(frozen=True)
class Truth:
    """Frequencies (rad/s or angle of z), ratios and degrees, and unstable closed-loop poles."""

    gain_crossovers: list[float]
    phase_margins_deg: list[float]
    phase_crossovers: list[float]
    gain_margins: list[float]
    unstable: int
    nearest_to_border: float


def product(factors: list[list[float]]) -> list[mpf]:
    """Polynomial product, exact at the working precision; highest power first."""
    with mp.workdps(DIGITS):
        out = [mpf(1)]
        for factor in factors:
            out = multiply(out, [mpf(c) for c in factor])
        return out


def multiply(a: list[mpf], b: list[mpf]) -> list[mpf]:
    out = [mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def subtract(a: list[mpf], b: list[mpf]) -> list[mpf]:
    n = max(len(a), len(b))
    a, b = [mpf(0)] * (n - len(a)) + a, [mpf(0)] * (n - len(b)) + b
    return [x - y for x, y in zip(a, b, strict=True)]


def divided(p: list[mpf], root: mpf) -> list[mpf]:
    out = [p[0]]
    for c in p[1:-1]:
        out.append(c + root * out[-1])
    return out


def roots(p: list[mpf], ends_too: bool = False) -> list[mpc]:
    """All roots: companion eigenvalues, then Durand-Kerner until 25 digits stand."""
    size = max(abs(c) for c in p)
    while p and abs(p[0]) <= size * mpf(10) ** -40:
        p = p[1:]
    at_zero = 0
    while len(p) > 1 and p[-1] == 0:
        p, at_zero = p[:-1], at_zero + 1
    for end in (2, -2) if ends_too else ():
        while len(p) > 1 and abs(polyval(p, mpf(end))) <= size * mpf(10) ** -40:
            p = divided(p, mpf(end))
    n = len(p) - 1
    if n < 1:
        return [mpc(0)] * at_zero
    # scale the variable so that the roots are about one
    scale = abs(p[-1] / p[0]) ** (mpf(1) / n)
    q = [c / p[0] / scale**k for k, c in enumerate(p)]
    start = np.roots(np.array([float(c) for c in q]))
    z = [mpc(complex(s)) * (1 + mpc(1e-12 * (k + 1), 2e-12)) for k, s in enumerate(start)]
    for _ in range(2000):
        worst = mpf(0)
        for k in range(n):
            below = mpc(1)
            for j in range(n):
                if j != k:
                    below *= z[k] - z[j]
            step = polyval(q, z[k]) / below
            z[k] -= step
            worst = max(worst, abs(step) / abs(z[k]))
        if worst < mpf(10) ** -26:
            return [s * scale for s in z] + [mpc(0)] * at_zero
    raise AssertionError("the roots did not settle")


def _real_roots(p: list[mpf], low: float, high: float) -> list[mpf]:
    found = [r.real for r in roots(p, low == -2) if abs(r.imag) < REAL * (abs(r) + mpf(10) ** -30)]
    return sorted(r for r in found if low < r < high)


def _at(num: list[mpf], den: list[mpf], point: mpc) -> mpc:
    return polyval(num, point) / polyval(den, point)


def truth(num: list[mpf], den: list[mpf], sampled: bool) -> Truth:
    """Everything of num/den (highest power first) under negative unit feedback."""
    with mp.workdps(DIGITS):
        gain, phase = _sampled_equations(num, den) if sampled else _continuous_equations(num, den)
        if sampled:
            gains = sorted(mp.acos(c / 2) for c in _real_roots(gain, -2, 2))
            phases = sorted(mp.acos(c / 2) for c in _real_roots(phase, -2, 2))
        else:
            gains = [mp.sqrt(v) for v in _real_roots(gain, 0, math.inf)]
            phases = [mp.sqrt(v) for v in _real_roots(phase, 0, math.inf)]

        def border(x: mpf) -> mpc:
            return mp.expj(x) if sampled else mpc(0, x)

        degrees = [float(mp.degrees(mp.arg(-_at(num, den, border(x))))) for x in gains]
        real = [(x, _at(num, den, border(x)).real) for x in phases]
        real = [(x, L) for x, L in real if L < 0]
        closed = roots(subtract(den, [-c for c in num]))
        size = [abs(p) - 1 if sampled else p.real for p in closed]
        nearest = min(
            (abs(d) / (1 if sampled else abs(p)) for d, p in zip(size, closed, strict=True) if p != 0),
            default=mpf(0),
        )
        return Truth(
            [float(x) for x in gains], degrees, [float(x) for x, _ in real],
            [float(-1 / L) for _, L in real], sum(d > 0 for d in size), float(nearest),
        )  # fmt: skip


def _split(p: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    """p(j w) = even(v) + j w odd(v) with v = w^2; highest power first."""
    low = p[::-1]
    even = [c * (-1) ** k for k, c in enumerate(low[0::2])][::-1]
    odd = [c * (-1) ** k for k, c in enumerate(low[1::2])][::-1]
    return even or [mpf(0)], odd or [mpf(0)]


def _continuous_equations(num: list[mpf], den: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    (ne, no), (de, do) = _split(num), _split(den)
    v = [mpf(1), mpf(0)]
    square_n = subtract(multiply(ne, ne), [-c for c in multiply(v, multiply(no, no))])
    square_d = subtract(multiply(de, de), [-c for c in multiply(v, multiply(do, do))])
    return subtract(square_n, square_d), subtract(multiply(no, de), multiply(ne, do))


def _sampled_equations(num: list[mpf], den: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    n = max(len(num), len(den))
    a = [mpf(0)] * (n - len(num)) + num
    b = [mpf(0)] * (n - len(den)) + den
    first, second = [[mpf(2)], [mpf(1), mpf(0)]], [[mpf(0)], [mpf(1)]]
    for table in (first, second):
        while len(table) <= n:
            table.append(subtract(multiply([mpf(1), mpf(0)], table[-1]), table[-2]))

    def correlation(p: list[mpf], q: list[mpf], k: int) -> mpf:
        return sum((p[i] * q[i + k] for i in range(n - k)), mpf(0))

    gain, phase = [mpf(0)], [mpf(0)]
    for k in range(n):
        r = correlation(a, a, k) - correlation(b, b, k)
        weight = r / 2 if k == 0 else r
        gain = subtract(gain, [-weight * c for c in first[k]])
        # a(z) b(1/z) - a(1/z) b(z): coefficient of z^k - z^-k
        q = correlation(a, b, k) - correlation(b, a, k)
        phase = subtract(phase, [-q * c for c in second[k]])
    return gain, phase
