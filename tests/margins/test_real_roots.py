"""Positive roots against polynomials made of chosen roots, and against all complex roots."""

from __future__ import annotations

import numpy as np
import pytest
from flint import acb, acb_poly, arb, ctx, fmpq, fmpz, fmpz_poly

from actuator_lti.margins.distances import MODULUS
from actuator_lti.margins.exact import real_roots
from actuator_lti.margins.exact.crossings import smallest
from actuator_lti.margins.exact.real_roots import positive_roots
from actuator_lti.margins.exact.roots import all_roots


@pytest.fixture(autouse=True)
def _of_any_degree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(real_roots, "FEW", 0)


AT_AN_END = [fmpq(40503, 2**14), *(fmpq(k, 4) for k in range(1, 20))]
CASES = {
    "at an end of an interval": (AT_AN_END, AT_AN_END),
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


@pytest.mark.parametrize("seed", range(6))
def test_smallest_distance_of_many_states(seed: int) -> None:
    """Of a loop with narrow and wide resonances: no sample of the response is lower, and one is as low."""
    rng = np.random.default_rng(seed)
    N, D = fmpz_poly([1]), fmpz_poly([1])
    for _ in range(32):
        w, z = 10.0 ** rng.uniform(-2, 2), 10.0 ** rng.uniform(-4, 0)
        D *= fmpz_poly([int(x * 2**40) for x in (w * w, 2.0 * z * w, 1.0)])
        N *= fmpz_poly([int(x * 2**40) for x in (w * w * rng.uniform(0.8, 1.3), z * w, 0.9)])
    value, place = smallest(N, D, MODULUS)
    w = np.sort(np.concatenate([np.geomspace(1e-3, 1e3, 4000), place * (1.0 + np.linspace(-1e-6, 1e-6, 21))]))
    with ctx.workprec(300):
        points = [acb(0, float(x)) for x in w]
        seen = [float(abs(1 + acb_poly(N)(s) / acb_poly(D)(s)).mid()) for s in points]
    assert min(seen) == pytest.approx(value, rel=1e-9)
    assert min(seen) >= value * (1.0 - 1e-12)


def test_three_roots_in_one_place_are_told_apart() -> None:
    """(x - 1)((2^500 (x - 1))^2 - 2) has 1 and 1 +- sqrt(2)/2^500; far from them 2^-1100."""
    beside = fmpz_poly([-1, 1]) * (fmpz_poly([-(2**500), 2**500]) ** 2 - 2)
    p = beside * fmpz_poly([-1, 2**1100])
    with ctx.workprec(600):
        one, off = arb(1), arb(2).sqrt() / fmpz(2) ** 500
        for found in (positive_roots(p), [(root.real, times) for root, times in all_roots(p)]):
            assert [times for _, times in found] == [1] * 4
            for wanted in (one - off, one, one + off, arb((1, -1100))):
                assert sum(bool(root.overlaps(wanted)) for root, _ in found) == 1
