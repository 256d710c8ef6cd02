"""Rows, and complex numbers as pairs of floats, so that the same text runs in Python and, emitted, in C."""

# mypy: disallow-untyped-defs=False
import math

KERNELS = True


def times(ar, ai, br, bi):
    """Product of two complex numbers."""
    return ar * br - ai * bi, ar * bi + ai * br


def over(ar, ai, br, bi):
    """Quotient a/b (Smith 1962: no overflow on the way)."""
    if abs(br) >= abs(bi):
        ratio = bi / br
        below = br + bi * ratio
        return (ar + ai * ratio) / below, (ai - ar * ratio) / below
    ratio = br / bi
    below = br * ratio + bi
    return (ar * ratio + ai) / below, (ai * ratio - ar) / below


def size_at(row, k):
    """Modulus of the k-th number of a row of pairs."""
    return math.hypot(row[2 * k], row[2 * k + 1])


def distance_at(row, k):
    """|1 + z| of the k-th number of a row of pairs."""
    return math.hypot(1.0 + row[2 * k], row[2 * k + 1])


def copied(count, source, first, to, begin):
    """Copy some numbers of a row from one place to a place of another."""
    for i in range(count):
        to[begin + i] = source[first + i]
