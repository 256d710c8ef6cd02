"""Positive roots against polynomials made of chosen roots, and against all complex roots."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb, ctx, fmpq, fmpz_poly

from actuator_lti.margins.exact import real_roots
from actuator_lti.margins.exact.real_roots import positive_roots
from actuator_lti.margins.exact.roots import all_roots


@pytest.fixture(autouse=True)
def _of_any_degree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(real_roots, "FEW", 0)


CASES = {
    "none": ([], []),
    "negative": ([-3, -1, 0, 0], []),
    "one": ([2], [2]),
    "powers of two": ([fmpq(1, 4), 1, 1024, -1], [fmpq(1, 4), 1, 1024]),
    "repeated": ([5, 5, 5, 7, 7, -2, -2, 0], [5, 5, 5, 7, 7]),
    "far apart": ([fmpq(1, 10**40), 3, 10**45], [fmpq(1, 10**40), 3, 10**45]),
    "side by side": ([3, 3 + fmpq(1, 10**60)], [3, 3 + fmpq(1, 10**60)]),
    "many": ([fmpq(k, 7) for k in range(-20, 60)], [fmpq(k, 7) for k in range(1, 60)]),
}


def of_roots(roots: list[fmpq], times: fmpz_poly | None = None) -> fmpz_poly:
    """The polynomial with these roots, times another one."""
    p = fmpz_poly([1]) if times is None else times
    for root in map(fmpq, roots):
        p = p * fmpz_poly([-root.p, root.q])
    return p


@pytest.mark.parametrize("beside", [[1], [5, 2, 1], [10**30 + 1, -2 * 10**30, 10**30]])
@pytest.mark.parametrize("case", CASES)
def test_chosen_roots(case: str, beside: list[int]) -> None:
    """Every positive root, as often as it is repeated, whatever complex pair is beside them."""
    roots, positive = CASES[case]
    with ctx.workprec(96):
        found = positive_roots(of_roots(roots, fmpz_poly(beside)))
        assert [times for _, times in found] == [positive.count(x) for x in dict.fromkeys(positive)]
        for (root, _), value in zip(found, sorted(set(positive)), strict=True):
            assert root.overlaps(arb(value))
            assert root.rel_accuracy_bits() >= 90


@pytest.mark.parametrize("seed", range(20))
def test_all_roots_agree(seed: int) -> None:
    """Coefficients of any size: the real ones among all certified roots."""
    rng = np.random.default_rng(seed)
    p = fmpz_poly([int(rng.choice([-1, 1])) << int(rng.integers(1, 200)) for _ in range(rng.integers(2, 60))])
    with ctx.workprec(96):
        real = [root.real for root, _ in all_roots(p) if root.imag.is_zero() and root.real > 0]
        found = positive_roots(p)
    assert len(found) == len(real)
    ordered = sorted(real, key=lambda root: float(root.mid()))
    assert all(root.overlaps(other) for (root, _), other in zip(found, ordered, strict=True))
