"""The processor that is not at hand: what it changes, and what it never changes."""

import numpy as np
import pytest
from beside import MOST, moved


@pytest.mark.parametrize("seed", range(3))
def test_every_number_moves_by_a_few_ulp_and_equal_ones_alike(seed: int) -> None:
    x = np.random.default_rng(seed).standard_normal((40, 5)) * 10.0 ** np.arange(-100, 150, 50)
    y = moved(x, seed)
    assert np.all(np.abs(y - x) <= MOST * np.spacing(np.abs(np.maximum(np.abs(x), np.abs(y)))))
    assert 0.7 < np.mean(y != x) < 1.0
    assert np.array_equal(moved(x.T, seed), y.T)
    assert np.array_equal(moved(-x, seed), -y)
    z = x + 1j * x[::-1]
    assert np.array_equal(moved(z.conj(), seed), moved(z, seed).conj())
    assert not np.array_equal(moved(x, seed + 1), y)


def test_what_is_no_rounded_number_stays() -> None:
    for kept in (0.0, -0.0, np.inf, -np.inf, 5e-324, 3, "a", None):
        assert repr(moved(kept, 1)) == repr(kept) or moved(kept, 1) == kept
    assert np.isnan(moved(np.nan, 1))
    pivots = np.array([2, 1, 0])
    assert moved((pivots, 0), 1) == (pivots, 0)
    result = np.linalg.eig(np.array([[0.0, 1.0], [-2.0, -3.0]]))
    assert type(moved(result, 1)) is type(result)
