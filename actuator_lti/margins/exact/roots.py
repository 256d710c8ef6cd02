"""Roots of polynomials with integer coefficients, each in an interval that is known to hold it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

from flint import acb, arb, arb_poly, ctx, fmpq_poly, fmpz_poly

from actuator_lti.errors import NumericalError

_MOST_BITS = 1 << 15
_SQUARE = fmpz_poly([0, 0, -1])  # v = -s^2
V = fmpz_poly([0, 1])
Polynomial = TypeVar("Polynomial", fmpz_poly, fmpq_poly)
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Split:
    """p(j w) = even(v) + j w odd(v) with v = w^2."""

    even: fmpz_poly
    odd: fmpz_poly

    @cached_property
    def square(self) -> fmpz_poly:
        """|p(j w)|^2 as a polynomial in v."""
        return self.even * self.even + V * self.odd * self.odd

    def at(self, v: arb) -> acb:
        """p(j w), at the working precision."""
        return acb(arb_poly(self.even)(v), v.sqrt() * arb_poly(self.odd)(v))


def split(p: fmpz_poly) -> Split:
    """Even and odd part on the imaginary axis."""
    c = p.coeffs()
    even, odd = ([-x if k % 2 else x for k, x in enumerate(part)] for part in (c[0::2], c[1::2]))
    return Split(fmpz_poly(even), fmpz_poly(odd))


def free_of(p: fmpz_poly, *others: fmpz_poly) -> fmpz_poly:
    """p without any root that it has in common with others."""
    for q in others:
        while p.degree() > 0 and (common := p.gcd(q)).degree() > 0:
            p = p // common
    return p


def all_roots(p: fmpz_poly) -> list[tuple[acb, int]]:
    """Every root but zero, isolated, with its multiplicity; the real ones have no imaginary part at all."""
    while p.degree() > 0 and p[0] == 0:
        p = p.right_shift(1)
    if p.degree() < 1:
        return []
    return list(_isolated(tuple((p // p.content()).coeffs()), ctx.prec))


@lru_cache(maxsize=32)
def _isolated(coefficients: tuple[Any, ...], bits: int) -> list[tuple[acb, int]]:
    """Margins and peaks of one loop ask for the same roots, which take seconds of a hundred states."""
    with ctx.workprec(bits):
        result: Any = fmpz_poly(list(coefficients)).complex_roots()
        return [(acb(root), times) for root, times in result]


@dataclass(frozen=True)
class HalfPlanes:
    """Where the roots of a polynomial lie."""

    right: int  # roots with a positive real part, multiplicities counted
    at_zero: int  # multiplicity of the root zero
    border: tuple[tuple[arb, int], ...]  # w > 0 of the roots +-j w, with their multiplicity
    roots: tuple[acb, ...]  # all of them, each as often as it is repeated

    @property
    def values(self) -> tuple[complex, ...]:
        """All of them, in double precision."""
        return tuple(complex(root) for root in self.roots)

    @property
    def on_border(self) -> int:
        """Number of roots on the axis."""
        return self.at_zero + 2 * sum(times for _, times in self.border)


NOTHING_HIDDEN = HalfPlanes(0, 0, (), ())


def half_planes(p: fmpz_poly) -> HalfPlanes:
    """Sort the roots by the imaginary axis, exactly.

    Roots that lie symmetrically to the origin, all those on the axis among them, are the common factor of
    even and odd part; what is left has no root on the axis, and precision is doubled until its side is told.
    """
    at_zero = 0
    while p.degree() > 0 and p[0] == 0:
        p, at_zero = p.right_shift(1), at_zero + 1
    parts = split(p)
    symmetric = parts.even.gcd(parts.odd) if parts.odd.degree() >= 0 else parts.even
    border: list[tuple[arb, int]] = []
    right, placed = 0, [(acb(0), at_zero)]
    if symmetric.degree() > 0:
        mirrored = symmetric(_SQUARE)
        p = p // (mirrored // mirrored.content())
        squares = all_roots(symmetric)
        real = [(v.real.sqrt(), times) for v, times in squares if v.imag.is_zero() and v.real > 0]
        border = sorted(real, key=lambda pair: float(pair[0].mid()))
        right = symmetric.degree() - sum(times for _, times in border)
        placed += [(side * _root_of(v), times) for v, times in squares for side in (1, -1)]

    def told() -> list[tuple[acb, int]] | None:
        roots = all_roots(p)
        return roots if all(root.real > 0 or root.real < 0 for root, _ in roots) else None

    others = at_enough_bits(told, ctx.prec, "a closed-loop pole")
    right += sum(times for root, times in others if root.real > 0)
    every = tuple(root for root, times in (*placed, *others) for _ in range(times))
    return HalfPlanes(right, at_zero, tuple(border), every)


def warped(p: Polynomial, degree: int) -> Polynomial:
    """(1 - s)^degree p((1 + s)/(1 - s)), by way of z = -1 + 2/(1 - s)."""
    kind = type(p)
    about: list[Any] = list(p(kind([-1, 2])).coeffs())
    about += [0] * (degree + 1 - len(about))
    return kind(about[::-1])(kind([1, -1]))


def _root_of(v: acb) -> acb:
    """s with v = -s^2, on the axis exactly where v is real and positive."""
    return acb(0, v.real.sqrt()) if v.imag.is_zero() and v.real > 0 else (-v).sqrt()


def at_enough_bits(find: Callable[[], Answer | None], bits: int, what: str) -> Answer:
    """The first answer that is not ``None``, the working precision doubled each time."""
    while bits <= _MOST_BITS:
        with ctx.workprec(bits):
            if (answer := find()) is not None:
                return answer
        bits *= 2
    raise NumericalError(f"{what} could not be separated from what lies beside it")
