"""Small dense linear algebra for compiled kernels: no LAPACK, so that the bits depend on nothing else.

Everything here works in place on arrays that the caller owns.  Golub and Van Loan, Matrix Computations,
4th ed., 7.4.3 (Householder to Hessenberg form), 7.5 (shifted QR); the shift and deflation strategy is
that of EISPACK's ``hqr`` (Martin, Peters, Wilkinson 1970); scaling by powers of two after Parlett and
Reinsch (1969).
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel

_EPS = 2.220446049250313e-16


@kernel
def multiply(n, a, b, out):
    """Write a @ b into out, all n by n (leading block)."""
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@kernel
def exponential(n, m, out, term, work):
    """Write expm(m) into out: Taylor series after halving to norm 1/2, then squaring (m is kept)."""
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(m[i, j])
        norm = max(norm, row)
    halvings = 0
    while norm > 0.5:
        norm *= 0.5
        halvings += 1
    scale = 0.5**halvings
    for i in range(n):
        for j in range(n):
            term[i, j] = 1.0 if i == j else 0.0
            out[i, j] = term[i, j]
    for order in range(1, 17):
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += term[i, k] * m[k, j]
                work[i, j] = total * scale / order
        for i in range(n):
            for j in range(n):
                term[i, j] = work[i, j]
                out[i, j] += work[i, j]
    for _ in range(halvings):
        multiply(n, out, out, work)
        for i in range(n):
            for j in range(n):
                out[i, j] = work[i, j]


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


@kernel
def eigenvalues(n, a, wr, wi):
    """Eigenvalues of an upper Hessenberg matrix (destroyed) into wr, wi; status 1 if QR does not end."""
    norm = 0.0
    for i in range(n):
        for j in range(max(i - 1, 0), n):
            norm += abs(a[i, j])
    end = n - 1
    shift = 0.0
    while end >= 0:
        iterations = 0
        while True:
            low = end
            while low >= 1:
                s = abs(a[low - 1, low - 1]) + abs(a[low, low])
                if s == 0.0:
                    s = norm
                if abs(a[low, low - 1]) <= _EPS * s:
                    a[low, low - 1] = 0.0
                    break
                low -= 1
            x = a[end, end]
            if low == end:
                wr[end] = x + shift
                wi[end] = 0.0
                end -= 1
                break
            y = a[end - 1, end - 1]
            w = a[end, end - 1] * a[end - 1, end]
            if low == end - 1:
                _two_by_two(end, x, y, w, shift, wr, wi)
                end -= 2
                break
            if iterations == 60:
                return 1
            if iterations in (10, 20, 40):
                shift += x
                for i in range(end + 1):
                    a[i, i] -= x
                s = abs(a[end, end - 1]) + abs(a[end - 1, end - 2])
                x = 0.75 * s
                y = x
                w = -0.4375 * s * s
            iterations += 1
            _double_shift(a, low, end, x, y, w)
    return 0


@kernel
def _two_by_two(end, x, y, w, shift, wr, wi):
    """The two eigenvalues of a deflated 2 by 2 block."""
    p = 0.5 * (y - x)
    q = p * p + w
    z = np.sqrt(abs(q))
    x += shift
    if q >= 0.0:
        z = p + (z if p >= 0.0 else -z)
        wr[end - 1] = x + z
        wr[end] = x + z
        if z != 0.0:
            wr[end] = x - w / z
        wi[end - 1] = 0.0
        wi[end] = 0.0
    else:
        wr[end - 1] = x + p
        wr[end] = x + p
        wi[end - 1] = z
        wi[end] = -z


@kernel
def _double_shift(a, low, end, x, y, w):
    """One Francis step with two shifts on rows and columns low to end."""
    p = 0.0
    q = 0.0
    r = 0.0
    m = end - 2
    while m >= low:
        z = a[m, m]
        r = x - z
        s = y - z
        p = (r * s - w) / a[m + 1, m] + a[m, m + 1]
        q = a[m + 1, m + 1] - z - r - s
        r = a[m + 2, m + 1]
        s = abs(p) + abs(q) + abs(r)
        p /= s
        q /= s
        r /= s
        if m == low:
            break
        u = abs(a[m, m - 1]) * (abs(q) + abs(r))
        v = abs(p) * (abs(a[m - 1, m - 1]) + abs(z) + abs(a[m + 1, m + 1]))
        if u <= _EPS * v:
            break
        m -= 1
    for i in range(m + 2, end + 1):
        a[i, i - 2] = 0.0
        if i != m + 2:
            a[i, i - 3] = 0.0
    for k in range(m, end):
        if k != m:
            p = a[k, k - 1]
            q = a[k + 1, k - 1]
            r = a[k + 2, k - 1] if k != end - 1 else 0.0
            x = abs(p) + abs(q) + abs(r)
            if x != 0.0:
                p /= x
                q /= x
                r /= x
        s = np.sqrt(p * p + q * q + r * r)
        if p < 0.0:
            s = -s
        if s == 0.0:
            continue
        if k == m:
            if low != m:
                a[k, k - 1] = -a[k, k - 1]
        else:
            a[k, k - 1] = -s * x
        p += s
        x = p / s
        y = q / s
        z = r / s
        q /= p
        r /= p
        for j in range(k, end + 1):
            t = a[k, j] + q * a[k + 1, j]
            if k != end - 1:
                t += r * a[k + 2, j]
                a[k + 2, j] -= t * z
            a[k + 1, j] -= t * y
            a[k, j] -= t * x
        last = end if end < k + 3 else k + 3
        for i in range(low, last + 1):
            t = x * a[i, k] + y * a[i, k + 1]
            if k != end - 1:
                t += z * a[i, k + 2]
                a[i, k + 2] -= t * r
            a[i, k + 1] -= t * q
            a[i, k] -= t
