"""Crossovers and verdicts of rational loops from polynomial roots at high precision, for the tests only."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from mpmath import mp, mpc, mpf

DIGITS = 50
EXACT = 260  # digits in which products of a dozen doubles are exact
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


def polyval(p: list[mpf], x: mpc) -> mpc:
    out = mpc(0)
    for c in p:
        out = out * x + c
    return out


def product(factors: list[list[float]]) -> list[mpf]:
    """Polynomial product, exact at the working precision; highest power first."""
    with mp.workdps(EXACT):
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


def roots(p: list[mpf]) -> list[mpc]:
    """All roots but -1: Aberth in double precision, then at high precision until 25 digits stand."""
    size = max(abs(c) for c in p)
    while p and abs(p[0]) <= size * mpf(10) ** -40:
        p = p[1:]
    at_zero = 0
    while len(p) > 1 and p[-1] == 0:
        p, at_zero = p[:-1], at_zero + 1
    while len(p) > 1 and abs(polyval(p, -1)) <= size * mpf(10) ** -40:  # delays z^-q: multiple, not wanted
        p = divided(p, mpf(-1))
    n = len(p) - 1
    if n < 1:
        return [mpc(0)] * at_zero
    z = [mpc(complex(s)) for s in _estimates(p)]
    derivative = [c * (n - k) for k, c in enumerate(p[:-1])]
    for _ in range(100):
        worst = mpf(0)
        for k in range(n):
            newton = polyval(p, z[k]) / polyval(derivative, z[k])
            push = sum((1 / (z[k] - z[j]) for j in range(n) if j != k), mpc(0))
            step = newton / (1 - newton * push)
            z[k] -= step
            worst = max(worst, abs(step) / abs(z[k]))
        if worst < mpf(10) ** -26:
            return [*z, *[mpc(0)] * at_zero]
    raise AssertionError("the roots did not settle")


def _estimates(p: list[mpf]) -> np.ndarray:
    """Aberth in double precision, from circles whose radii the Newton polygon of the coefficients gives."""
    n = len(p) - 1
    logs = [float(mp.log(abs(c))) if c else -1e300 for c in reversed(p)]
    hull: list[int] = []
    for k in range(n + 1):
        while len(hull) > 1 and (logs[hull[-1]] - logs[hull[-2]]) * (k - hull[-1]) <= (
            logs[k] - logs[hull[-1]]
        ) * (hull[-1] - hull[-2]):
            hull.pop()
        hull.append(k)
    start = []
    for low, high in pairwise(hull):
        radius = np.exp((logs[low] - logs[high]) / (high - low))
        angles = 2 * np.pi * np.arange(high - low) / (high - low) + 0.7 + 0.3 * low
        start += list(radius * np.exp(1j * angles))
    z = np.array(start)
    centre = np.exp(np.mean(np.log(np.abs(z))))
    q = np.array([float(c / p[0] / mpf(centre) ** k) for k, c in enumerate(p)])
    z = z / centre
    derivative = np.polyder(q)
    for _ in range(60):
        newton = np.polyval(q, z) / np.polyval(derivative, z)
        gap = z[:, None] - z[None, :] + np.eye(n)
        step = newton / (1 - newton * ((1 / gap).sum(axis=1) - 1))
        z = z - step
        if (np.abs(step) < 1e-13 * np.abs(z)).all():
            break
    return z * centre * (1 + 1e-14 * np.arange(n))


def _positive_roots(p: list[mpf]) -> list[mpf]:
    return sorted(r.real for r in roots(p) if abs(r.imag) < REAL * abs(r) and r.real > 0)


def _at(num: list[mpf], den: list[mpf], point: mpc) -> mpc:
    return polyval(num, point) / polyval(den, point)


def truth(num: list[mpf], den: list[mpf], sampled: bool) -> Truth:
    """Everything of num/den (highest power first) under negative unit feedback."""
    with mp.workdps(EXACT):
        if sampled:
            degree = len(den) - 1
            num, den = bilinear(num, degree), bilinear(den, degree)
        gain, phase = _equations(num, den)
    with mp.workdps(DIGITS):
        gains = [mp.sqrt(v) for v in _positive_roots(gain)]
        phases = [mp.sqrt(v) for v in _positive_roots(phase)]

        def border(w: mpf) -> mpc:
            return mpc(0, w)

        def frequency(w: mpf) -> float:
            return float(2 * mp.atan(w) if sampled else w)

        degrees = [float(mp.degrees(mp.arg(-_at(num, den, border(x))))) for x in gains]
        real = [(x, _at(num, den, border(x)).real) for x in phases]
        real = [(x, L) for x, L in real if L < 0]
        closed = roots(subtract(den, [-c for c in num]))
        size = [p.real for p in closed]
        nearest = min((abs(p.real) / abs(p) for p in closed if p != 0), default=mpf(0))
        return Truth(
            [frequency(x) for x in gains], degrees, [frequency(x) for x, _ in real],
            [float(-1 / L) for _, L in real], sum(d > 0 for d in size), float(nearest),
        )  # fmt: skip


def _split(p: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    """p(j w) = even(v) + j w odd(v) with v = w^2; highest power first."""
    low = p[::-1]
    even = [c * (-1) ** k for k, c in enumerate(low[0::2])][::-1]
    odd = [c * (-1) ** k for k, c in enumerate(low[1::2])][::-1]
    return even or [mpf(0)], odd or [mpf(0)]


def _equations(num: list[mpf], den: list[mpf]) -> tuple[list[mpf], list[mpf]]:
    (ne, no), (de, do) = _split(num), _split(den)
    v = [mpf(1), mpf(0)]
    square_n = subtract(multiply(ne, ne), [-c for c in multiply(v, multiply(no, no))])
    square_d = subtract(multiply(de, de), [-c for c in multiply(v, multiply(do, do))])
    return subtract(square_n, square_d), subtract(multiply(no, de), multiply(ne, do))


def bilinear(p: list[mpf], degree: int) -> list[mpf]:
    """(1 - s)^degree p((1 + s)/(1 - s)), highest power first: the unit circle becomes the imaginary axis."""
    up, down = [[mpf(1)]], [[mpf(1)]]
    for _ in range(degree):
        up.append(multiply(up[-1], [mpf(1), mpf(1)]))
        down.append(multiply(down[-1], [mpf(-1), mpf(1)]))
    out = [mpf(0)]
    for k, c in enumerate(reversed(p)):
        out = subtract(out, [-c * x for x in multiply(up[k], down[degree - k])])
    return out
