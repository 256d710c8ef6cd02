"""Exact polynomials of many states, and the positive roots of one: truth by construction."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, ctx, fmpq, fmpz_mat, fmpz_poly

from actuator_lti.margins import certified_roots
from actuator_lti.margins.certified_roots import all_roots, places, roots_on_axis
from actuator_lti.margins.exact_charpoly import characteristic, numerator
from actuator_lti.margins.positive_axis import positive_axis_roots
from actuator_lti.margins.root_isolation import NotIsolated, square_free

X = fmpz_poly([0, 1])


def with_chain(rng: np.random.Generator, n: int, k: int) -> list[list[int]]:
    """A matrix of integers with a chain of k states that hand on, in an order of its own."""
    A = np.zeros((n + k, n + k), dtype=int)
    A[:n, :n] = rng.integers(-9, 10, (n, n))
    A[n, :n] = rng.integers(-9, 10, n)
    for j in range(n + 1, n + k):
        A[j, j - 1] = rng.choice([1, 3, -2])
    A[:n, n + k - 1] = rng.integers(-9, 10, n)
    order = rng.permutation(n + k)
    return [[int(x) for x in row] for row in A[order][:, order]]


@pytest.mark.parametrize(("n", "k"), [(3, 12), (1, 5), (4, 30), (5, 2), (6, 0)])
def test_a_chain_taken_out_leaves_the_determinant(n: int, k: int) -> None:
    rng = np.random.default_rng([n, k])
    rows = with_chain(rng, n, k) if k else rng.integers(-9, 10, (n, n)).tolist()
    p = characteristic(rows)
    assert p.degree() == n + k
    for z in range(-(n + k), n + k + 1):  # more points than coefficients
        shifted = fmpz_mat([[z * (r == c) - x for c, x in enumerate(row)] for r, row in enumerate(rows)])
        assert p(z) == shifted.det()


@pytest.mark.parametrize("seed", range(3))
def test_a_numerator_is_a_bordered_determinant(seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    rows = with_chain(rng, 3, 4 + seed)
    n = len(rows)
    b, c = (rng.integers(-9, 10, n).tolist() for _ in range(2))
    p = numerator(rows, b, c, characteristic(rows))
    for z in range(-n, n + 1):
        bordered = [[z * (r == k) - x for k, x in enumerate(row)] + [-b[r]] for r, row in enumerate(rows)]
        assert p(z) == fmpz_mat([*bordered, [*c, 0]]).det()


def from_roots(rng: np.random.Generator, reals: int, pairs: int) -> tuple[fmpz_poly, list[Fraction]]:
    """A polynomial with real roots of either sign and pairs near the axis, and its positive roots."""
    p, positive = fmpz_poly([1]), set()
    for k in range(reals):
        root = Fraction(int(10.0 ** rng.uniform(0.0, 9.0)) + 1, 10**4) * (-1 if k % 3 == 0 else 1)
        if root not in positive:
            p *= root.denominator * X - root.numerator
            positive |= {root} if root > 0 else set()
    for _ in range(pairs):
        real, imag = int(10.0 ** rng.uniform(0.0, 9.0)), int(10.0 ** rng.uniform(0.0, 7.0)) + 1
        p *= (10**4 * X - real) ** 2 + imag**2
    return p, sorted(positive)


def holds(ball: arb, root: Fraction) -> bool:
    """Whether an interval holds a fraction, which is no double: asked with many more bits than its own."""
    with ctx.workprec(1000):
        return bool(ball.contains(arb(fmpq(root.numerator, root.denominator))))


@pytest.mark.parametrize("seed", range(8))
def test_every_positive_root_is_found_and_no_other(seed: int) -> None:
    rng = np.random.default_rng([seed, 9])
    p, exact = from_roots(rng, 9 + seed, 20 + 4 * seed)
    with ctx.workprec(96):
        found = positive_axis_roots(p)
    assert len(found) == len(exact)
    for ball, root in zip(found, exact, strict=True):
        assert holds(ball, root)
        assert ball.rel_accuracy_bits() >= 90


def test_two_positive_roots_that_all_but_meet_are_parted() -> None:
    p = fmpz_poly([1])
    for k in range(45):
        p *= X + (3 + k)
    p *= (10**40 * X - 10**40 - 1) * (X - 1)
    with ctx.workprec(200):
        try:
            low, high = positive_axis_roots(p)
        except NotIsolated:  # closer than intervals of doubles part: the general way does
            (low, _), (high, _) = roots_on_axis(p)
        assert bool(low < high)
        assert low.contains(arb(1))


def test_multiple_roots_on_the_axis_come_with_their_multiplicity() -> None:
    p = (X - 2) ** 2 * (X + 1) ** 7 * (3 * X - 1)
    for k in range(40):
        p *= X**2 + X + (2 + k)
    assert p.degree() > certified_roots._HIGH
    found = roots_on_axis(p)
    assert [times for _, times in found] == [1, 2]
    assert holds(found[0][0], Fraction(1, 3))
    assert holds(found[1][0], Fraction(2))
    assert sorted(times for _, times in square_free(p)) == [1, 2, 7]


@pytest.mark.parametrize("move", [1e-9, 1e-3, 3.0])
def test_a_start_next_to_the_roots_or_far_from_them_changes_none(move: float) -> None:
    rng = np.random.default_rng(3)
    p, _ = from_roots(rng, 10, 30)
    alone = all_roots(p)
    near = places(alone)
    moved = tuple(z * (1.0 + move * rng.standard_normal()) for z in near)
    for start in (moved, moved[:-6], moved[:5]):
        again = all_roots(p, start)
        assert len(again) == len(alone) == p.degree()
        for root, _ in alone:
            assert sum(bool(root.overlaps(other)) for other, _ in again) == 1
