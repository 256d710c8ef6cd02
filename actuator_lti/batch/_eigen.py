"""Eigenvalues of a real matrix where there is no LAPACK: the shifted QR iteration, emitted only.

Golub and Van Loan, Matrix Computations, 4th ed., 7.5: Francis' double step on a Hessenberg matrix, with
deflation, as in EISPACK's hqr (Wilkinson and Reinsch, Handbook II/14).
"""

# mypy: disallow-untyped-defs=False
import math

from ._linalg import balance, hessenberg

KERNELS = True

EPS = 2.220446049250313e-16
MOST_ROUNDS = 300  # for an eigenvalue: the roots of a periodic loop lie on circles, which takes more


def _split(n, a, last):
    """First row of the block that ends at ``last``, where a subdiagonal is zero but for rounding."""
    low = last
    while low > 0:
        around = abs(a[(low - 1) * n + low - 1]) + abs(a[low * n + low])
        if around == 0.0:
            around = 1.0
        if abs(a[low * n + low - 1]) <= EPS * around:
            a[low * n + low - 1] = 0.0
            return low
        low -= 1
    return low


def _pair(n, a, last, shift, wr, wi):
    """Both eigenvalues of the 2 by 2 block that ends at ``last``."""
    x, y = a[last * n + last], a[(last - 1) * n + last - 1]
    w = a[last * n + last - 1] * a[(last - 1) * n + last]
    p = 0.5 * (y - x)
    q = p * p + w
    z = math.sqrt(abs(q))
    x += shift
    if q >= 0.0:
        z = p + z if p >= 0.0 else p - z
        wr[last - 1] = x + z
        wr[last] = x - w / z if z != 0.0 else x + z
        wi[last - 1], wi[last] = 0.0, 0.0
    else:
        wr[last - 1], wr[last] = x + p, x + p
        wi[last - 1], wi[last] = z, -z


def _start(n, a, low, last, x, y, w):
    """Where the double step begins, and the first column of its reflection."""
    m = last - 2
    p, q, r = 0.0, 0.0, 0.0
    while m >= low:
        z = a[m * n + m]
        rest_x, rest_y = x - z, y - z
        p = (rest_x * rest_y - w) / a[(m + 1) * n + m] + a[m * n + m + 1]
        q = a[(m + 1) * n + m + 1] - z - rest_x - rest_y
        r = a[(m + 2) * n + m + 1]
        size = abs(p) + abs(q) + abs(r)
        p, q, r = p / size, q / size, r / size
        if m == low:
            break
        u = abs(a[m * n + m - 1]) * (abs(q) + abs(r))
        v = abs(p) * (abs(a[(m - 1) * n + m - 1]) + abs(z) + abs(a[(m + 1) * n + m + 1]))
        if u <= EPS * v:
            break
        m -= 1
    return m, p, q, r


def _double_step(n, a, low, last, x, y, w):
    """One double QR step on the rows low to last."""
    m, p, q, r = _start(n, a, low, last, x, y, w)
    for i in range(m + 2, last + 1):
        a[i * n + i - 2] = 0.0
        if i > m + 2:
            a[i * n + i - 3] = 0.0
    for k in range(m, last):
        size = 1.0
        if k > m:
            p, q = a[k * n + k - 1], a[(k + 1) * n + k - 1]
            r = a[(k + 2) * n + k - 1] if k < last - 1 else 0.0
            size = abs(p) + abs(q) + abs(r)
            if size == 0.0:
                continue
            p, q, r = p / size, q / size, r / size
        s = math.sqrt(p * p + q * q + r * r)
        s = -s if p < 0.0 else s
        if k > m:
            a[k * n + k - 1] = -s * size
        elif low < m:
            a[k * n + k - 1] = -a[k * n + k - 1]
        p += s
        first, second, third = p / s, q / s, r / s
        q, r = q / p, r / p
        for j in range(k, last + 1):
            t = a[k * n + j] + q * a[(k + 1) * n + j]
            if k < last - 1:
                t += r * a[(k + 2) * n + j]
                a[(k + 2) * n + j] -= t * third
            a[(k + 1) * n + j] -= t * second
            a[k * n + j] -= t * first
        for i in range(low, min(last, k + 3) + 1):
            t = first * a[i * n + k] + second * a[i * n + k + 1]
            if k < last - 1:
                t += third * a[i * n + k + 2]
                a[i * n + k + 2] -= t * r
            a[i * n + k + 1] -= t * q
            a[i * n + k] -= t


def eigenvalues(n, a, lent, lent_too, wr, wi):
    """Eigenvalues of a (overwritten): real parts, imaginary parts; 1, or 0 where they do not converge.

    ``lent`` and ``lent_too`` are rows of n and 2 n numbers to work in.
    """
    for i in range(n):
        lent[i] = 0.0
        lent_too[i] = 0.0
    balance(n, a, lent, lent)
    hessenberg(n, a, lent, lent, lent_too)
    last, rounds, since = n - 1, 0, 0
    shift = 0.0
    while last >= 0:
        low = _split(n, a, last)
        if low == last:
            wr[last] = a[last * n + last] + shift
            wi[last] = 0.0
            last -= 1
            rounds, since = 0, 0
            continue
        if low == last - 1:
            _pair(n, a, last, shift, wr, wi)
            last -= 2
            rounds, since = 0, 0
            continue
        if rounds >= MOST_ROUNDS:
            return 0
        x, y = a[last * n + last], a[(last - 1) * n + last - 1]
        w = a[last * n + last - 1] * a[(last - 1) * n + last]
        if since == 10:  # an exceptional shift
            since = 0
            shift += x
            for i in range(last + 1):
                a[i * n + i] -= x
            s = abs(a[last * n + last - 1]) + abs(a[(last - 1) * n + last - 2])
            x = 0.75 * s
            y = x
            w = -0.4375 * s * s
        rounds += 1
        since += 1
        _double_step(n, a, low, last, x, y, w)
    return 1
