"""What scipy has for one matrix but not for many, and not for compiled code: balance, Hessenberg form.

Matrices are flat rows, a[i n + j]; everything works in place on rows that the caller owns.
Golub and Van Loan, Matrix Computations, 4th ed., 7.4.3 (Householder to Hessenberg form); scaling by powers
of two after Parlett and Reinsch (1969).
"""

# mypy: disallow-untyped-defs=False
import math

KERNELS = True


LOG_2 = 0.6931471805599453


def balance(n, a, b, c):
    """Scale the states by powers of two until rows and columns of a weigh the same."""
    for _round in range(30):
        done = True
        for i in range(n):
            column = abs(c[i])
            beside = abs(b[i])
            for j in range(n):
                if j != i:
                    column += abs(a[j * n + i])
                    beside += abs(a[i * n + j])
            if column == 0.0 or beside == 0.0:
                continue
            power = float(math.floor(0.5 * math.log(beside / column) / LOG_2 + 0.5))
            factor = math.ldexp(1.0, int(power))
            if (column * factor + beside / factor) < 0.95 * (column + beside):
                done = False
                for j in range(n):
                    a[i * n + j] /= factor
                b[i] /= factor
                for j in range(n):
                    a[j * n + i] *= factor
                c[i] *= factor
        if done:
            return


def _reflect(n, a, b, c, k, v, beta):
    """Apply I - beta v v' to a from both sides, to b from the left, to c from the right; v zero up to k."""
    for j in range(n):
        total = 0.0
        for i in range(k + 1, n):
            total += v[i] * a[i * n + j]
        for i in range(k + 1, n):
            a[i * n + j] -= beta * total * v[i]
    for i in range(n):
        total = 0.0
        for j in range(k + 1, n):
            total += a[i * n + j] * v[j]
        for j in range(k + 1, n):
            a[i * n + j] -= beta * total * v[j]
    total_b, total_c = 0.0, 0.0
    for i in range(k + 1, n):
        total_b += v[i] * b[i]
        total_c += v[i] * c[i]
    for i in range(k + 1, n):
        b[i] -= beta * total_b * v[i]
        c[i] -= beta * total_c * v[i]


def hessenberg(n, a, b, c, v):
    """Bring a to upper Hessenberg form by Householder reflections, b and c in the same coordinates."""
    for k in range(n - 2):
        norm = 0.0
        for i in range(k + 1, n):
            norm += a[i * n + k] * a[i * n + k]
        norm = math.sqrt(norm)
        if norm == 0.0:
            continue
        alpha = -norm if a[(k + 1) * n + k] > 0.0 else norm
        square = 0.0
        for i in range(k + 1, n):
            v[i] = a[i * n + k]
            if i == k + 1:
                v[i] -= alpha
            square += v[i] * v[i]
        if square == 0.0:
            continue
        beta = 2.0 / square
        _reflect(n, a, b, c, k, v, beta)
        for i in range(k + 2, n):
            a[i * n + k] = 0.0
