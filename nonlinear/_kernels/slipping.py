"""The slipping plant: its transition by the matrix exponential, its state at any time in closed form.

With held voltage and torque, (i, w) obeys x' = A x + b.  Written with the derivative at the start,
w(t) = w0 + a(t) w0' + b(t) q0, where q0 = (B x0')_w, B = A - m I, B^2 = d I, and a, b are integrals of
exp(m t) cosh(s t) and exp(m t) sinh(s t)/s, s^2 = d: the same lines hold for real and complex eigenvalues,
and nothing large cancels.  Nearly double eigenvalues go through the matrix exponential.

Matrices lie in a row of work space from a place ``at`` on, row by row: four of up to 7 by 7, `MATRIX` apart.
"""

import math

from nonlinear._kernels import layout

KERNELS = True

MATRIX = 49
TERMS = 19  # Taylor terms at norm 1/2: 0.5**19/19! = 1.6e-23
REAL, COMPLEX, SINGLE = range(3)
NEARLY_DOUBLE = 1e-3  # |s/m| below which the eigenvalues count as nearly double


def matmul(work, a, b, out, n):
    """Product of the n by n matrices at ``a`` and ``b``, written at ``out``."""
    for r in range(n):
        for c in range(n):
            total = 0.0
            for j in range(n):
                total += work[a + r * n + j] * work[b + j * n + c]
            work[out + r * n + c] = total


def halvings_of(work, at, n):
    """How often a matrix is halved until its norm is at most 1/2."""
    norm = 0.0
    for r in range(n):
        total = 0.0
        for c in range(n):
            total += abs(work[at + r * n + c])
        norm = max(norm, total)
    halvings, scale = 0, 1.0
    while norm * scale > 0.5 and halvings < 1000:
        scale *= 0.5
        halvings += 1
    return halvings, scale


def exponential(work, at, n):
    """exp of the n by n matrix at ``at``, which is scaled, at ``at + MATRIX``: Taylor series and squaring."""
    result, term, product = at + MATRIX, at + 2 * MATRIX, at + 3 * MATRIX
    halvings, scale = halvings_of(work, at, n)
    size = n * n
    for j in range(size):
        work[at + j] *= scale
        work[result + j] = 0.0
        work[term + j] = 0.0
    for r in range(n):
        work[result + r * n + r] = 1.0
        work[term + r * n + r] = 1.0
    for j in range(1, TERMS):
        matmul(work, term, at, product, n)
        for m in range(size):
            work[term + m] = work[product + m] / j
            work[result + m] += work[term + m]
    for _ in range(halvings):
        matmul(work, result, result, product, n)
        for m in range(size):
            work[result + m] = work[product + m]


def plant(p, reverse, dt, work, at, n):
    """Write dt times the slipping plant at ``at``, n by n: states (i, w, th, u, T, ...), inputs held."""
    for j in range(n * n):
        work[at + j] = 0.0
    J = p[layout.INERTIA]
    Cv = p[layout.VISCOUS_REVERSE] if reverse > 0 else p[layout.VISCOUS]
    if p[layout.SOURCE] > 0.0:
        work[at + n + 3] = dt * p[layout.SOURCE_GAIN] / J
    else:
        L = p[layout.INDUCTANCE]
        work[at] = -dt * p[layout.RESISTANCE] / L
        work[at + 1] = -dt * p[layout.BACK_EMF] / L
        work[at + 3] = dt / L
        work[at + n] = dt * p[layout.TORQUE_CONSTANT] / J
    work[at + n + 1] = -dt * Cv / J
    work[at + n + 4] = dt / J
    work[at + 2 * n + 1] = dt


def transition(p, reverse, dt, work, at, out):
    """Write the twelve coefficients of the slipping plant over dt at ``p[out]``."""
    plant(p, reverse, dt, work, at, layout.SLIP_ORDER)
    exponential(work, at, layout.SLIP_ORDER)
    e = at + MATRIX
    p[out + layout.A11], p[out + layout.A12] = work[e], work[e + 1]
    p[out + layout.A21], p[out + layout.A22] = work[e + 5], work[e + 6]
    p[out + layout.A31], p[out + layout.A32] = work[e + 10], work[e + 11]
    for r in range(3):
        p[out + layout.B1 + r] = work[e + 5 * r + 3]
        p[out + layout.C1 + r] = work[e + 5 * r + 4]


def describe(p, reverse, at):
    """Write kind, mean and half difference of the eigenvalues and A at ``p[at]``."""
    J, L = p[layout.INERTIA], p[layout.INDUCTANCE]
    source = p[layout.SOURCE] > 0.0
    a11 = 0.0 if source else -p[layout.RESISTANCE] / L
    a12 = 0.0 if source else -p[layout.BACK_EMF] / L
    a21 = 0.0 if source else p[layout.TORQUE_CONSTANT] / J
    a22 = -(p[layout.VISCOUS_REVERSE] if reverse > 0 else p[layout.VISCOUS]) / J
    mean, half = 0.5 * (a11 + a22), 0.5 * (a11 - a22)
    d = half * half + a12 * a21
    root = math.sqrt(abs(d))
    p[at + layout.KIND] = float(SINGLE) if source else (float(COMPLEX) if d < 0.0 else float(REAL))
    p[at + layout.CLOSE] = 1.0 if root < NEARLY_DOUBLE * abs(mean) else 0.0
    p[at + layout.MEAN], p[at + layout.ROOT] = mean, root
    p[at + layout.M11], p[at + layout.M12] = a11, a12
    p[at + layout.M21], p[at + layout.M22] = a21, a22


def phi12(x):
    """(exp(x) - 1)/x and (exp(x) - 1 - x)/x^2."""
    if abs(x) < 0.5:
        total, term = 0.5, 0.5
        for j in range(3, 18):
            term *= x / j
            total += term
        return 1.0 + x * total, total
    first = math.expm1(x) / x
    return first, (first - 1.0) / x


def phi12_complex(x, y):
    """The same for z = x + j y; returns the two real and imaginary parts."""
    size = x * x + y * y
    if size < 0.25:
        re, im, term_re, term_im = 0.5, 0.0, 0.5, 0.0
        for j in range(3, 18):
            term_re, term_im = (term_re * x - term_im * y) / j, (term_re * y + term_im * x) / j
            re += term_re
            im += term_im
        return 1.0 + x * re - y * im, x * im + y * re, re, im
    half = math.sin(0.5 * y)
    # exp(z) - 1, then divided by z twice
    re = math.expm1(x) * math.cos(y) - 2.0 * half * half
    im = math.exp(x) * math.sin(y)
    first_re, first_im = (re * x + im * y) / size, (im * x - re * y) / size
    re, im = first_re - 1.0, first_im
    return first_re, first_im, (re * x + im * y) / size, (im * x - re * y) / size


def integrals(kind, m, s, t):
    """a(t), b(t) and their integrals (real distinct or complex eigenvalues m +- s, m +- j s)."""
    if kind == REAL:
        e1, f1 = phi12((m + s) * t)
        e2, f2 = phi12((m - s) * t)
        scale = t / (2.0 * s)
        return 0.5 * t * (e1 + e2), scale * (e1 - e2), 0.5 * t * t * (f1 + f2), t * scale * (f1 - f2)
    er, ei, fr, fi = phi12_complex(m * t, s * t)
    return t * er, t * ei / s, t * t * fr, t * t * fi / s


def slip_close(p, s, reverse, t, i, w, th, u, T):
    """The same for nearly double eigenvalues."""
    at = int(p[layout.AT_WORK])
    plant(p, reverse, t, s, at, layout.SLIP_ORDER)
    exponential(s, at, layout.SLIP_ORDER)
    e = at + MATRIX
    return (
        s[e] * i + s[e + 1] * w + s[e + 3] * u + s[e + 4] * T,
        s[e + 5] * i + s[e + 6] * w + s[e + 8] * u + s[e + 9] * T,
        th + s[e + 10] * i + s[e + 11] * w + s[e + 13] * u + s[e + 14] * T,
    )


def slip_at(p, s, at, reverse, t, i, w, th, u, T):
    """State (i, w, th) after slipping for t under held u and torque T (dry friction included in T)."""
    kind = int(p[at + layout.KIND])
    if kind == SINGLE:
        rate = p[at + layout.M22]
        dw = rate * w + (p[layout.SOURCE_GAIN] * u + T) / p[layout.INERTIA]
        first, second = phi12(rate * t)
        return 0.0, w + t * first * dw, th + t * (w + t * second * dw)
    if p[at + layout.CLOSE] > 0.0:
        return slip_close(p, s, reverse, t, i, w, th, u, T)
    di, dw = derivative(p, at, i, w, u, T)
    m = p[at + layout.MEAN]
    a, b, a2, b2 = integrals(kind, m, p[at + layout.ROOT], t)
    qi = (p[at + layout.M11] - m) * di + p[at + layout.M12] * dw
    qw = p[at + layout.M21] * di + (p[at + layout.M22] - m) * dw
    return i + a * di + b * qi, w + a * dw + b * qw, th + w * t + a2 * dw + b2 * qw


def derivative(p, at, i, w, u, T):
    """(i', w') while slipping."""
    if int(p[at + layout.KIND]) == SINGLE:
        return 0.0, p[at + layout.M22] * w + (p[layout.SOURCE_GAIN] * u + T) / p[layout.INERTIA]
    di = p[at + layout.M11] * i + p[at + layout.M12] * w + u / p[layout.INDUCTANCE]
    dw = p[at + layout.M21] * i + p[at + layout.M22] * w + T / p[layout.INERTIA]
    return di, dw


def first_extremum(p, at, i, w, u, T, after):
    """First time later than ``after`` at which w' = 0; inf if there is none."""
    kind = int(p[at + layout.KIND])
    if kind == SINGLE:
        return math.inf
    di, dw = derivative(p, at, i, w, u, T)
    m, s = p[at + layout.MEAN], p[at + layout.ROOT]
    q = p[at + layout.M21] * di + (p[at + layout.M22] - m) * dw
    if q == 0.0 and (dw == 0.0 or kind == REAL):
        return math.inf
    if kind == COMPLEX:  # dw cos(s t) + q sin(s t)/s = 0
        step = math.pi / s
        t = math.atan2(-s * dw, q) / s
        return t + step * max(math.ceil((after - t) / step), 0.0)
    ratio = -dw / q  # tanh(s t)/s
    t = ratio
    if s > 0.0:
        t = math.atanh(s * ratio) / s if abs(s * ratio) < 1.0 else math.inf
    return t if t > after else math.inf
