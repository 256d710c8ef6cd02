"""Roots of polynomials of high degree: each in a square of its own, none left out, real ones marked."""

import numpy as np
import pytest
from flint import acb, ctx, fmpq, fmpz_poly

from actuator_lti.margins.certified_roots import all_roots
from actuator_lti.margins.root_isolation import NotIsolated, isolated_roots

X = fmpz_poly([0, 1])


def made(rng: np.random.Generator, reals: int, pairs: int, decades: float) -> tuple[fmpz_poly, list[complex]]:
    """A polynomial from roots that are exact fractions, and those roots (upper half plane)."""
    p, roots = fmpz_poly([1]), []
    for k in range(reals + pairs):
        size = 10.0 ** rng.uniform(-decades / 2, decades / 2)
        below = 10**9
        above = int(size * below * rng.choice([-1.0, 1.0])) or 1
        if k < reals:
            p *= below * X - above
            roots.append(complex(above / below))
            continue
        imag = int(size * below * 10.0 ** rng.uniform(-4.0, 0.0)) or 1
        p *= (below * X - above) ** 2 + imag**2
        roots.append(complex(above, imag) / below)
    return p, roots


@pytest.mark.parametrize("seed", range(6))
def test_every_root_is_in_a_square_of_its_own(seed: int) -> None:
    rng = np.random.default_rng([seed, 77])
    p, roots = made(rng, 10 + 3 * seed, 32, 1.0 + seed)
    result = [root for root, times in all_roots(p) for _ in range(times)]
    assert p.degree() > 60
    assert len(result) == p.degree()
    assert sum(root.imag.is_zero() for root in result) == 10 + 3 * seed
    with ctx.workprec(200):
        for root in roots:
            exact = acb(fmpq(*root.real.as_integer_ratio()), fmpq(*root.imag.as_integer_ratio()))
            holding = [x for x in result if abs((x - exact).mid()) < 1e-14 * abs(root)]
            assert len(holding) == 1


def test_a_wilkinson_polynomial_of_degree_80() -> None:
    """Roots 1 to 80: 8 ulp of a coefficient scatter them over the plane."""
    p = fmpz_poly([1])
    for k in range(1, 81):
        p *= X - k
    result = sorted(isolated_roots(p), key=lambda root: float(root.real.mid()))
    assert all(root.imag.is_zero() for root in result)
    assert [bool(root.real.contains(k)) for k, root in enumerate(result, 1)] == [True] * 80


def test_roots_closer_than_double_precision_parts_them() -> None:
    """A Mignotte polynomial: two real roots at 0.1, a part in 1e30 apart."""
    p = X**61 - (10 * X - 1) ** 2
    result = [root for root, _ in all_roots(p)]
    small = [root for root in result if abs(complex(root) - 0.1) < 1e-6]
    assert len(result) == 61
    assert len(small) == 2
    assert all(root.imag.is_zero() for root in small)
    assert not small[0].overlaps(small[1])


def test_multiple_roots_keep_their_multiplicity() -> None:
    p = fmpz_poly([1])
    for k in range(1, 64):
        p *= X - k * k
    result = all_roots(p * (X - 5) ** 3 * (X + 2) ** 2)
    assert sorted(times for _, times in result) == [1] * 63 + [2, 3]


def test_what_is_not_square_free_is_refused_not_guessed() -> None:
    p = fmpz_poly([1])
    for k in range(1, 40):
        p *= (X - k) ** 2
    with pytest.raises(NotIsolated):
        isolated_roots(p)
