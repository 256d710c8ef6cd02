"""A loop as two polynomials with exact coefficients: its doubles, as the rationals they are."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from flint import fmpq, fmpz, fmpz_mat, fmpz_poly

from actuator_lti.margins.exact.roots import HalfPlanes, half_planes, warped
from actuator_lti.margins.given import ULP, Given
from actuator_lti.margins.poles import diagonal_blocks

_S = fmpz_poly([0, 1])


@dataclass(frozen=True, eq=False)
class ExactLoop:
    """L = N/D without common factors, and the hidden modes that were cancelled; integers, lowest power first.

    A sampled loop is held in the s-plane of z = (1 + s)/(1 - s), exactly: the unit circle is the imaginary
    axis, z = -1 lies at infinity.
    """

    N: fmpz_poly  # coprime numerator and denominator in s
    D: fmpz_poly
    hidden: fmpz_poly  # what they had in common: modes that the loop does not drive or does not see
    degree: int  # number of poles of L, those at infinity (z = -1) counted
    hidden_degree: int  # the same for the hidden modes
    sampled: bool  # whether s comes from z

    @cached_property
    def zeros(self) -> HalfPlanes:
        return half_planes(self.N)

    @cached_property
    def poles(self) -> HalfPlanes:
        """Poles of L, those at infinity left out here and below."""
        return half_planes(self.D)

    @cached_property
    def closed_poles(self) -> HalfPlanes:
        """Closed-loop poles, hidden modes left out."""
        return half_planes(self.N + self.D)

    @cached_property
    def hidden_modes(self) -> HalfPlanes:
        return half_planes(self.hidden)

    @property
    def closed_at_end(self) -> int:
        """Closed-loop poles at z = -1."""
        return self.degree - (self.N + self.D).degree()

    @property
    def unstable(self) -> int:
        """Closed-loop poles outside the stable region, hidden modes among them."""
        return self.closed_poles.right + self.hidden_modes.right

    @property
    def at_limit(self) -> int:
        """Closed-loop poles exactly at the stability limit, hidden modes left out."""
        return self.closed_poles.at_limit + self.closed_at_end

    @property
    def hidden_at_end(self) -> int:
        """Hidden modes at z = -1."""
        return self.hidden_degree - self.hidden.degree()

    @property
    def at_end(self) -> tuple[fmpz, fmpz]:
        """Numerator and denominator of L at infinity (z = -1)."""
        return self.N[self.degree], self.D[self.degree]


def neighbours(given: Given, loop: ExactLoop, placed: int = 1) -> list[ExactLoop]:
    """The same from data 8 ulp away.

    Where more modes at the stability limit cancel exactly than their place shows (``placed``), what is seen
    is moved and they stay: data next to these would have a pole beside a zero there, and nothing in common
    with the loop.
    """
    if loop.hidden_modes.at_limit <= placed and not loop.hidden_at_end:
        return [exact_loop(near) for near in given.neighbours()]
    return [replace(loop, N=_moved(loop.N, way), D=_moved(loop.D, way)) for way in (1, -1)]


def _moved(p: fmpz_poly, way: int) -> fmpz_poly:
    signs = np.random.default_rng(0).choice([-1, 1], p.degree() + 1)
    return fmpz_poly([c * ((1 << 53) + way * ULP * int(k)) for c, k in zip(p.coeffs(), signs, strict=True)])


def exact_loop(given: Given) -> ExactLoop:
    """Bring the given doubles into the exact form; no rounding anywhere."""
    N, D = exact_polynomials(given)
    if given.samples:
        D = D * _S**given.samples
    n = D.degree()
    if given.period_s is not None:
        N, D = warped(N, n), warped(D, n)
    common = N.gcd(D) if N.degree() >= 0 else D
    hidden = common // (common.content() or 1)
    at_end = min(n - N.degree(), n - D.degree()) if N.degree() >= 0 else 0  # common poles at z = -1
    N, D = N // hidden, D // hidden
    both = N.content().gcd(D.content()) if N.degree() >= 0 else D.content()
    hidden_degree = hidden.degree() + at_end
    return ExactLoop(
        N // both, D // both, hidden, n - hidden_degree, hidden_degree, given.period_s is not None
    )


@lru_cache(maxsize=64)
def exact_polynomials(given: Given) -> tuple[fmpz_poly, fmpz_poly]:
    """Numerator and denominator in s or z, hidden modes among them, times one power of two."""
    if given.A is not None:
        return _by_matrices(given)
    (num, den), _ = integers(given.numerator, given.denominator)
    return fmpz_poly(num[::-1]), fmpz_poly(den[::-1])


def rational(x: Any) -> fmpq:
    """A double as the rational number that it is."""
    return fmpq(*float(x).as_integer_ratio())


def integers(*arrays: Any) -> tuple[list[list[int]], int]:
    """All entries times one power of two, as integers, and that power."""
    ratios = [[float(x).as_integer_ratio() for x in np.ravel(array)] for array in arrays]
    shift = max((below.bit_length() - 1 for part in ratios for _, below in part), default=0)
    return [[above << (shift - below.bit_length() + 1) for above, below in part] for part in ratios], shift


def _by_matrices(given: Given) -> tuple[fmpz_poly, fmpz_poly]:
    """D = det(sI - A), N = c adj(sI - A) b + d D."""
    n = given.b.size
    (A, d), shift = integers(given.A, given.d)
    (b,), shift_b = integers(given.b)
    (c,), shift_c = integers(given.c)
    if not n:
        return fmpz_poly(d), fmpz_poly([1 << shift])
    whole = [A[k * n : k * n + n] for k in range(n)]
    below = fmpz_poly([1])
    for block in diagonal_blocks(np.asarray(given.A)):
        below *= fmpz_mat([[whole[j][k] for k in block] for j in block]).charpoly()
    above = _numerator(whole, b, c, below)
    # of 2^shift A: below is 2^(shift n) det(sI - A) at s 2^-shift, above has one power less
    D, N = (fmpz_poly([x * (1 << (shift * k)) for k, x in enumerate(p.coeffs())]) for p in (below, above))
    power = shift_b + shift_c
    return N * (1 << (2 * shift)) + D * (d[0] << power), D * (1 << (shift + power))


def _numerator(rows: list[list[int]], b: list[int], c: list[int], below: fmpz_poly) -> fmpz_poly:
    """c adj(z I - M) b, where ``below`` is det(z I - M).

    It is the polynomial part of ``below`` times the sum of c M^k b z^(-1-k).
    """
    n = len(rows)
    M, state, out = fmpz_mat(rows), fmpz_mat(n, 1, b), fmpz_mat(1, n, c)
    answer = []
    for _ in range(n):
        answer.append((out * state)[0, 0])
        state = M * state
    product = below * fmpz_poly(answer[::-1])
    return product.right_shift(n) if product.degree() >= n else fmpz_poly()
