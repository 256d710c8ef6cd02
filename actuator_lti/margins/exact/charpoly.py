"""Characteristic polynomials and numerators of matrices of integers, with the structure of loops made use of.

Delays of whole samples are chains of states that only hand on; a computing delay of a hundred ticks makes a
hundred of them. A chain is taken out before any determinant is formed.
"""

from __future__ import annotations

from itertools import pairwise

from flint import fmpz, fmpz_mat, fmpz_poly

Rows = list[list[int]]

_WORTH = 0.2  # of all states: a determinant takes the fourth power of their number, and a chain two of them


def characteristic(rows: Rows) -> fmpz_poly:
    """det(z I - M).

    A chain x_1 -> ... -> x_k hands x_1 on as g z^(1-k) x_1, g the product of its entries. With M_0 what is
    left without x_2 ... x_k, and M_1 the same with x_1 read where x_k was: det = z^(k-1) P_0 - g (P_0 - P_1).
    """
    chain = _longest_chain(rows)
    if len(chain) <= 1 + _WORTH * len(rows):
        return fmpz_mat(rows).charpoly() if rows else fmpz_poly([1])
    gain = fmpz(1)
    for before, after in pairwise(chain):
        gain *= rows[after][before]
    gone = set(chain[1:])
    kept = [k for k in range(len(rows)) if k not in gone]
    without = [[rows[r][c] for c in kept] for r in kept]
    at_once = [
        [entry + rows[r][chain[-1]] * (c == chain[0]) for c, entry in zip(kept, part, strict=True)]
        for r, part in zip(kept, without, strict=True)
    ]
    first = characteristic(without)
    return first.left_shift(len(gone)) - gain * (first - characteristic(at_once))


def _longest_chain(rows: Rows) -> list[int]:
    """States of which each is computed from the one before alone, which nothing else reads."""
    sources = [[c for c, entry in enumerate(row) if entry] for row in rows]
    readers: list[list[int]] = [[] for _ in rows]
    for r, row in enumerate(sources):
        for c in row:
            readers[c].append(r)
    hands_to = {
        row[0]: r
        for r, row in enumerate(sources)
        if len(row) == 1 and row[0] != r and len(readers[row[0]]) == 1
    }
    ends = set(hands_to.values())
    best: list[int] = []
    for start in hands_to:
        if start in ends:
            continue
        chain = [start]
        while chain[-1] in hands_to:
            chain.append(hands_to[chain[-1]])
        best = max(best, chain, key=len)
    return best


def numerator(rows: Rows, b: list[int], c: list[int], below: fmpz_poly) -> fmpz_poly:
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
