"""Exact polynomials of many states: truth by construction."""

import numpy as np
import pytest
from flint import fmpz_mat

from actuator_lti.margins.exact_charpoly import characteristic, numerator


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
