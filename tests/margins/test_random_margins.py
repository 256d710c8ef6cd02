"""Thousands of random loops against polynomial roots at high precision: every crossover found, none invented.

Lightly damped, non-minimum-phase, unstable, integrating and sampled loops of order 2 to 12, as transfer
functions and as badly scaled, permuted state spaces. What 8 ulp of the entries change is left out.
"""

import math

import control
import numpy as np
import pytest
from margin_truth import determined, difference, product, truth
from mpmath import mpf

from actuator_lti.margins import stability_margins

PERIOD_S = 0.05
LOOPS = 150  # per seed
SEEDS = range(8)
Factor = list[float]


def factor(rng: np.random.Generator, sampled: bool, mild: bool) -> Factor:
    """A pole or zero, or a pair: 12 % in the right half plane, damping down to 1e-4."""
    wide = 0.55 if mild else 1.5
    if rng.random() < 0.45:
        a = float(10 ** rng.uniform(-1.3 * wide, 1.3 * wide) * rng.choice([-1, 1], p=[0.12, 0.88]))
        return [1.0, -math.exp(-a * PERIOD_S)] if sampled else [1.0, a]
    w = 10 ** rng.uniform(-wide, wide)
    zeta = 10 ** rng.uniform(-4, 0) * rng.choice([-1, 1], p=[0.12, 0.88])
    if not sampled:
        return [1.0, float(2 * zeta * w), float(w * w)]
    p = np.exp(PERIOD_S * w * (-zeta + 1j * math.sqrt(1 - zeta**2)))
    return [1.0, float(-2 * p.real), float(abs(p) ** 2)]


def degree(factors: list[Factor]) -> int:
    return sum(len(f) - 1 for f in factors)


def random_loop(
    rng: np.random.Generator, mild: bool = False
) -> tuple[float, list[Factor], list[Factor], bool]:
    sampled = bool(rng.random() < 0.5)
    order = int(rng.integers(2, 9))
    den: list[Factor] = []
    while degree(den) < order:
        den.append(factor(rng, sampled, mild))
    den += [[1.0, -1.0] if sampled else [1.0, 0.0]] * int(rng.choice([0, 1, 2], p=[0.5, 0.4, 0.1]))
    if sampled:
        den += [[1.0, 0.0]] * int(rng.integers(0, 4))
    num: list[Factor] = []
    zeros = int(rng.integers(0, degree(den) + 1))
    while degree(num) < zeros - 1:
        num.append(factor(rng, sampled, mild))
    x = 10 ** rng.uniform(-1, 1.3)
    p = np.exp(1j * x * PERIOD_S) if sampled else 1j * x
    size = abs(np.prod([np.polyval(f, p) for f in num]) / np.prod([np.polyval(f, p) for f in den]))
    return float(10 ** rng.uniform(-2, 2) * rng.choice([-1, 1], p=[0.15, 0.85]) / size), num, den, sampled


def cascade(gain: float, num: list[Factor], den: list[Factor], dt: float) -> control.StateSpace | None:
    """State space in series of sections, each entry a coefficient; ``None`` where they do not pair up."""
    num, left = sorted(num, key=len, reverse=True), sorted(den, key=len, reverse=True)
    sections = []
    for f in num:
        k = next((i for i, g in enumerate(left) if len(g) >= len(f)), None)
        if k is None:
            return None
        sections.append((f, left.pop(k)))
    sections += [([1.0], g) for g in left]
    A, B, C, D = np.zeros((0, 0)), np.zeros(0), np.zeros(0), gain
    for above, below in sections:
        n = len(below) - 1
        full = [0.0] * (n + 1 - len(above)) + above
        a, b = np.eye(n, k=-1), np.eye(n)[0]
        a[0] = -np.array(below[1:])
        c = np.array(full[1:]) - full[0] * np.array(below[1:])
        A = np.block([[A, np.zeros((B.size, n))], [np.outer(b, C), a]])
        B, C, D = np.concatenate((B, b * D)), np.concatenate((full[0] * C, c)), full[0] * D
    return control.StateSpace(A, B[:, None], C[None, :], [[D]], dt, remove_useless_states=False)


def scrambled(loop: control.StateSpace, rng: np.random.Generator) -> control.StateSpace:
    """States permuted and scaled by powers of two up to 1e5 apart, which loses nothing."""
    n = loop.nstates
    order, scale = rng.permutation(n), 2.0 ** rng.integers(-8, 9, n)
    A = (loop.A * scale[:, None] / scale[None, :])[np.ix_(order, order)]
    B, C = (loop.B * scale[:, None])[order], (loop.C / scale)[:, order]
    return control.StateSpace(A, B, C, loop.D, loop.dt, remove_useless_states=False)


@pytest.mark.parametrize("seed", SEEDS)
def test_transfer_functions(seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    wrong = []
    for k in range(LOOPS):
        gain, num, den, sampled = random_loop(rng)
        above, below = np.array([gain]), np.array([1.0])
        for f in num:
            above = np.polymul(above, f)
        for f in den:
            below = np.polymul(below, f)
        expected = truth([mpf(float(c)) for c in above], [mpf(float(c)) for c in below], sampled)
        loop = control.tf(above, below, PERIOD_S if sampled else 0)
        problem = difference(stability_margins(loop), expected, PERIOD_S if sampled else 1.0, 1e-6)
        if problem and determined(loop, expected, np.random.default_rng(k)):
            wrong.append((k, problem))
    assert not wrong


@pytest.mark.parametrize("seed", SEEDS)
def test_state_spaces(seed: int) -> None:
    rng = np.random.default_rng([seed, 2])
    wrong = []
    for k in range(LOOPS // 2):
        gain, num, den, sampled = random_loop(rng, mild=True)
        loop = cascade(gain, num, den, PERIOD_S if sampled else 0)
        if loop is None:
            continue
        expected = truth(product([[gain], *num]), product(den), sampled)
        given = scrambled(loop, rng)
        problem = difference(stability_margins(given), expected, PERIOD_S if sampled else 1.0, 1e-6)
        if problem and determined(given, expected, np.random.default_rng(k)):
            wrong.append((k, problem))
    assert not wrong
