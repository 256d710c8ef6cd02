"""Roots of polynomials with integer coefficients, each in an interval that is known to hold it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise, zip_longest
from typing import Any, TypeVar

from flint import acb, arb, arb_poly, ctx, fmpq_poly, fmpz_poly

from actuator_lti.errors import NumericalError
from actuator_lti.systems.precision import precision

_MOST_BITS = 1 << 15
_MANY_BITS = 2000  # of coefficients: of a usual loop of four states 500
FEW = 16  # degree up to which all roots at once take less time
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


def is_crowded(p: fmpz_poly) -> bool:
    """Whether some roots may be so near each other that all of them at once would take minutes."""
    return bool(p.height_bits() > _MANY_BITS)


@lru_cache(maxsize=32)
def _isolated(coefficients: tuple[Any, ...], bits: int) -> list[tuple[acb, int]]:
    """Margins and peaks of one loop ask for the same roots, which take seconds of a hundred states."""
    with precision(bits):
        p = fmpz_poly(list(coefficients))
        factors: Any = p.factor()[1] if is_crowded(p) and p.degree() <= FEW else [(p, 1)]
        found = ((root, times * own) for q, times in factors for root, own in q.complex_roots())
        return [(acb(root), times) for root, times in found]


@dataclass(frozen=True)
class HalfPlanes:
    right: int  # roots with a positive real part, multiplicities counted
    at_zero: int  # multiplicity of the root zero
    undamped: tuple[tuple[arb, int], ...]  # w > 0 of the roots +-j w, with their multiplicity
    find: Callable[[], tuple[acb, ...]]

    @cached_property
    def roots(self) -> tuple[acb, ...]:
        """All of them, each as often as it is repeated."""
        return self.find()

    @property
    def values(self) -> tuple[complex, ...]:
        """All of them, in double precision."""
        return tuple(complex(root) for root in self.roots)

    @property
    def at_limit(self) -> int:
        """Number of roots on the axis."""
        return self.at_zero + 2 * sum(times for _, times in self.undamped)


NOTHING_HIDDEN = HalfPlanes(0, 0, (), tuple)


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
    undamped: list[tuple[arb, int]] = []
    right, placed = 0, [(acb(0), at_zero)]
    if symmetric.degree() > 0:
        mirrored = symmetric(_SQUARE)
        p = p // (mirrored // mirrored.content())
        for v, times in all_roots(symmetric):  # v = -s^2: s on the axis exactly where v is real and positive
            on_axis = v.imag.is_zero() and v.real > 0
            root = acb(0, v.real.sqrt()) if on_axis else (-v).sqrt()
            undamped += [(root.imag, times)] if on_axis else []
            placed += [(root, times), (-root, times)]
        undamped.sort(key=lambda pair: float(pair[0].mid()))
        right = symmetric.degree() - sum(times for _, times in undamped)
    beyond = right_of_axis(p)
    if beyond is None:
        beyond = sum(times for root, times in _clear_of_axis(p) if root.real > 0)

    def found() -> tuple[acb, ...]:
        return tuple(root for root, times in (*placed, *_clear_of_axis(p)) for _ in range(times))

    return HalfPlanes(right + beyond, at_zero, tuple(undamped), found)


def right_of_axis(p: fmpz_poly) -> int | None:
    """Roots to the right of the axis, by the signs of Routh's first column; ``None`` where one is zero."""
    for doubled in range(6):
        with precision((p.degree() + 64) << doubled):
            column = _routh(p)
        if all(x > 0 or x < 0 for x in column):
            return sum((x > 0) is not (y > 0) for x, y in pairwise(column))
    return None


def _routh(p: fmpz_poly) -> list[arb]:
    coefficients = [arb(c) for c in reversed(p.coeffs())]
    above, row, column = coefficients[0::2], coefficients[1::2], coefficients[:1]
    while row:
        column.append(row[0])
        ratio = above[0] / row[0]
        pairs = zip_longest(above[1:], row[1:], fillvalue=arb(0))
        above, row = row, [x - ratio * y for x, y in pairs]
    return column


def within(p: fmpz_poly, size: float) -> int | None:
    """How many roots but zero are smaller than a size; ``None`` where one may be just as large."""
    while p.degree() > 0 and p[0] == 0:
        p = p.right_shift(1)
    above, below = size.as_integer_ratio()
    n = p.degree()
    scaled = fmpz_poly([c * above**k * below ** (n - k) for k, c in enumerate(p.coeffs())])
    moved = warped(scaled, n)
    outside = right_of_axis(moved) if moved.degree() == n else None
    return None if outside is None else n - outside


def warped(p: Polynomial, degree: int) -> Polynomial:
    """(1 - s)^degree p((1 + s)/(1 - s)), by way of z = -1 + 2/(1 - s)."""
    kind = type(p)
    about: list[Any] = list(p(kind([-1, 2])).coeffs())
    about += [0] * (degree + 1 - len(about))
    return kind(about[::-1])(kind([1, -1]))


def _clear_of_axis(p: fmpz_poly) -> list[tuple[acb, int]]:
    """All roots of a polynomial that has none on the axis, each known to lie left or right of it."""

    def isolated() -> list[tuple[acb, int]] | None:
        roots = all_roots(p)
        return roots if all(root.real > 0 or root.real < 0 for root, _ in roots) else None

    return at_enough_bits(isolated, ctx.prec, "a closed-loop pole")


def at_enough_bits(find: Callable[[], Answer | None], bits: int, what: str) -> Answer:
    """The first answer that is not ``None``, the working precision doubled each time."""
    while bits <= _MOST_BITS:
        with precision(bits):
            if (answer := find()) is not None:
                return answer
        bits *= 2
    raise NumericalError(f"{what} could not be separated from what lies beside it")
