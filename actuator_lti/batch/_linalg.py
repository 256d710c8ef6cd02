"""What scipy has for one matrix but not for many, and not for compiled code: balance, Hessenberg form.

Everything here works in place on arrays that the caller owns.  Golub and Van Loan, Matrix Computations,
4th ed., 7.4.3 (Householder to Hessenberg form); scaling by powers of two after Parlett and Reinsch (1969).
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel


@kernel
def balance(n, a, b, c):
    """Scale the states by powers of two until rows and columns of a weigh the same."""
    for _ in range(30):
        done = True
        for i in range(n):
            column = abs(c[i])
            row = abs(b[i])
            for j in range(n):
                if j != i:
                    column += abs(a[j, i])
                    row += abs(a[i, j])
            if column == 0.0 or row == 0.0:
                continue
            factor = 2.0 ** np.floor(0.5 * np.log2(row / column) + 0.5)
            if (column * factor + row / factor) < 0.95 * (column + row):
                done = False
                for j in range(n):
                    a[i, j] /= factor
                b[i] /= factor
                for j in range(n):
                    a[j, i] *= factor
                c[i] *= factor
        if done:
            return


@kernel
def hessenberg(n, a, b, c, v):
    """Bring a to upper Hessenberg form by Householder reflections, b and c in the same coordinates."""
    for k in range(n - 2):
        norm = 0.0
        for i in range(k + 1, n):
            norm += a[i, k] * a[i, k]
        norm = np.sqrt(norm)
        if norm == 0.0:
            continue
        alpha = -norm if a[k + 1, k] > 0.0 else norm
        vv = 0.0
        for i in range(k + 1, n):
            v[i] = a[i, k]
            if i == k + 1:
                v[i] -= alpha
            vv += v[i] * v[i]
        if vv == 0.0:
            continue
        beta = 2.0 / vv
        for j in range(n):
            total = 0.0
            for i in range(k + 1, n):
                total += v[i] * a[i, j]
            for i in range(k + 1, n):
                a[i, j] -= beta * total * v[i]
        for i in range(n):
            total = 0.0
            for j in range(k + 1, n):
                total += a[i, j] * v[j]
            for j in range(k + 1, n):
                a[i, j] -= beta * total * v[j]
        total_b = 0.0
        total_c = 0.0
        for i in range(k + 1, n):
            total_b += v[i] * b[i]
            total_c += v[i] * c[i]
        for i in range(k + 1, n):
            b[i] -= beta * total_b * v[i]
            c[i] -= beta * total_c * v[i]
        for i in range(k + 2, n):
            a[i, k] = 0.0
