"""A loop as two polynomials with exact coefficients: its doubles, as the rationals they are."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat, fmpz, fmpz_poly

from actuator_lti.margins.exact.roots import HalfPlanes, half_planes, warped
from actuator_lti.margins.given import ULP, Given

_S = fmpz_poly([0, 1])


@dataclass(frozen=True)
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
        """Zeros of L."""
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
        """Hidden modes."""
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
    def on_border(self) -> int:
        """Closed-loop poles exactly on the border, hidden modes left out."""
        return self.closed_poles.on_border + self.closed_at_end

    @property
    def hidden_at_end(self) -> int:
        """Hidden modes at z = -1."""
        return self.hidden_degree - self.hidden.degree()

    @property
    def at_end(self) -> tuple[fmpz, fmpz]:
        """Numerator and denominator of L at infinity (z = -1)."""
        return self.N[self.degree], self.D[self.degree]


def neighbours(given: Given, loop: ExactLoop, told: int = 1) -> list[ExactLoop]:
    """The same from data 8 ulp away.

    Where more modes on the border cancel exactly than are ``told`` by their place, what is seen is moved and
    they stay: data next to these would have a pole beside a zero there, and nothing in common with the loop.
    """
    if loop.hidden_modes.on_border <= told and not loop.hidden_at_end:
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
    """Numerator and denominator in s or z, hidden modes among them, but for one factor of both.

    Of a state space det(sI - A) and, as det(sI - A + b c) is that and c adj(sI - A) b, what they differ by.
    """
    if given.A is None:
        (num, den), _ = integers(given.numerator, given.denominator)
        return fmpz_poly(num[::-1]), fmpz_poly(den[::-1])
    A, b, c = (exact_matrix(each) for each in (given.A, given.b[:, None], given.c[None]))
    D = A.charpoly()
    N = (A - b * c).charpoly() - D + rational(given.d) * D
    return (N * D.denom() * N.denom()).numer(), (D * D.denom() * N.denom()).numer()


def exact_matrix(M: Any) -> fmpq_mat:
    """Of doubles."""
    rows, columns = M.shape
    return fmpq_mat(rows, columns, [rational(x) for x in M.ravel()])


def rational(x: Any) -> fmpq:
    """A double as the rational number that it is."""
    return fmpq(*float(x).as_integer_ratio())


def integers(*arrays: Any) -> tuple[list[list[int]], int]:
    """All entries times one power of two, as integers, and that power."""
    ratios = [[float(x).as_integer_ratio() for x in np.ravel(array)] for array in arrays]
    shift = max((below.bit_length() - 1 for part in ratios for _, below in part), default=0)
    return [[above << (shift - below.bit_length() + 1) for above, below in part] for part in ratios], shift
