"""One short interval of one mode: Taylor series of the state, and the first fall of a guard to zero.

The interval is short against every mode of the plant, so the series is exact to rounding.  A guard is a
polynomial there; a bound of its second derivative decides whether it can cross, and where it is monotone, so
two crossings that cancel cannot be missed.
"""

from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import layout

KERNELS = True

NEVER = -1.0  # no fall
AT_ONCE = -2.0  # the guard does not hold at the start, nor does it become positive
ROUNDING = 2e-15


def slopes_of(p, m, i, w, W, d, u, torque, load):
    """(i', w', W', delta') of a state in the mode at ``m``, under these inputs."""
    di = p[m + at.A_II] * i + p[m + at.A_IW] * w + p[m + at.B_I] * u
    dw = p[m + at.A_WI] * i + p[m + at.A_WW] * w + p[m + at.A_WV] * W + p[m + at.A_WD] * d
    dw += p[m + at.B_W] * torque
    dW = p[m + at.A_VW] * w + p[m + at.A_VV] * W + p[m + at.A_VD] * d + p[m + at.B_V] * load
    return di, dw, dW, p[m + at.A_DW] * w + p[m + at.A_DV] * W


def fill_series(p, s):
    """Taylor coefficients of (i, w, W, delta) from the present state under the held inputs."""
    m, x = int(s[at.ES_MODE]), at.ES_INPUT
    u, torque, load = s[x + at.IN_U], s[x + at.IN_MOTOR], s[x + at.IN_LOAD]
    i, w, W, d = s[layout.S_CURRENT], s[layout.S_SPEED], s[at.ES_LOAD_SPEED], s[at.ES_TWIST]
    for k in range(int(p[at.EL_TERMS]) + 1):
        x = at.ES_SERIES + 4 * k
        s[x], s[x + 1], s[x + 2], s[x + 3] = i, w, W, d
        di, dw, dW, dd = slopes_of(p, m, i, w, W, d, u, torque, load)
        scale = 1.0 / (k + 1)
        i, w, W, d = di * scale, dw * scale, dW * scale, dd * scale
        u, torque, load = 0.0, 0.0, 0.0  # they act on the first derivative only


def series_state(p, s, t):
    """(i, w, W, delta) at t, and the angle that the motor has turned."""
    n = int(p[at.EL_TERMS])
    x = at.ES_SERIES + 4 * n
    i, w, W, d = s[x], s[x + 1], s[x + 2], s[x + 3]
    turned = s[x + 1] / (n + 1)
    for j in range(n):
        x -= 4
        i = i * t + s[x]
        w = w * t + s[x + 1]
        W = W * t + s[x + 2]
        d = d * t + s[x + 3]
        turned = turned * t + s[x + 1] / (n - j)
    return i, w, W, d, turned * t


def fill_polynomial(p, s, g, offset, h):
    """Coefficients of a guard over [0, h]; returns the rounding that its value may carry there."""
    for k in range(int(p[at.EL_TERMS]) + 1):
        x = at.ES_SERIES + 4 * k
        linear = s[g + at.G_I] * s[x] + s[g + at.G_W] * s[x + 1]
        s[at.ES_POLYNOMIAL + k] = linear + (s[g + at.G_V] * s[x + 2] + s[g + at.G_D] * s[x + 3])
    s[at.ES_POLYNOMIAL] += offset
    return rounding_of(p, s, g, offset, h)


def rounding_of(p, s, g, offset, h):
    """Rounding of a guard over [0, h]: of its terms, and of the terms of its first derivative."""
    m, x = int(s[at.ES_MODE]), at.ES_INPUT
    i, w, W, d = (
        abs(s[layout.S_CURRENT]),
        abs(s[layout.S_SPEED]),
        abs(s[at.ES_LOAD_SPEED]),
        abs(s[at.ES_TWIST]),
    )
    gi, gw, gv, gd = abs(s[g + at.G_I]), abs(s[g + at.G_W]), abs(s[g + at.G_V]), abs(s[g + at.G_D])
    di = abs(p[m + at.A_II]) * i + abs(p[m + at.A_IW]) * w + p[m + at.B_I] * abs(s[x + at.IN_U])
    dw = abs(p[m + at.A_WI]) * i + abs(p[m + at.A_WW]) * w + abs(p[m + at.A_WV]) * W
    dw += abs(p[m + at.A_WD]) * d + p[m + at.B_W] * abs(s[x + at.IN_MOTOR])
    dW = abs(p[m + at.A_VW]) * w + abs(p[m + at.A_VV]) * W + abs(p[m + at.A_VD]) * d
    dW += p[m + at.B_V] * abs(s[x + at.IN_LOAD])
    dd = abs(p[m + at.A_DW]) * w + abs(p[m + at.A_DV]) * W
    now = abs(offset) + gi * i + gw * w + gv * W + gd * d
    return ROUNDING * (now + h * (gi * di + gw * dw + gv * dW + gd * dd))


def value_at(s, n, t):
    """The guard's polynomial of degree n."""
    value = s[at.ES_POLYNOMIAL + n]
    for j in range(n):
        value = value * t + s[at.ES_POLYNOMIAL + n - 1 - j]
    return value


def slope_at(s, n, t):
    """Its derivative."""
    value = n * s[at.ES_POLYNOMIAL + n]
    for j in range(n - 1):
        value = value * t + (n - 1 - j) * s[at.ES_POLYNOMIAL + n - 1 - j]
    return value


def curvature_bound(s, n, h):
    """Bound of the second derivative over [0, h]."""
    total = 0.0
    for j in range(n - 1):
        k = n - j
        total = total * h + k * (k - 1) * abs(s[at.ES_POLYNOMIAL + k])
    return total


def shift(s, n, x):
    """Move the origin of the polynomial to x."""
    for i in range(n):
        for j in range(n - i):
            k = at.ES_POLYNOMIAL + n - 1 - j
            s[k] += x * s[k + 1]


def first_fall(s, n, h, tolerance):
    """First time in [0, h] at which the polynomial comes down to zero; it is used up."""
    # a start at or below zero, if it does not become positive first: `AT_ONCE` if it goes further down than
    # its rounding, `NEVER` if it stays there; the origin moves along, so that the bound is a local one
    a, step = 0.0, h
    armed = s[at.ES_POLYNOMIAL] > 0.0
    while a < h:
        length = min(step, h - a)
        bend = curvature_bound(s, n, length) * length
        value, end = s[at.ES_POLYNOMIAL], value_at(s, n, length)
        clear = armed and min(value, end) > 0.125 * bend * length
        steep = abs(s[at.ES_POLYNOMIAL + 1]) >= bend
        if not (clear or steep or length <= 1e-16 * h):
            step = 0.5 * length
            continue
        if armed and end <= 0.0:
            return a + refine_fall(s, n, length)
        if not armed and end < -tolerance:
            return AT_ONCE
        armed = armed or end > 0.0
        if step >= h - a:
            return NEVER
        shift(s, n, length)
        a += length
        step = 2.0 * length
    return NEVER


def refine_fall(s, n, end):
    """Root in [0, end], where the polynomial falls through zero once: Newton inside bisection."""
    low, high = 0.0, end
    t = 0.5 * end
    for _ in range(200):
        value = value_at(s, n, t)
        if value > 0.0:
            low = t
        else:
            high = t
        slope = slope_at(s, n, t)
        following = t - value / slope if slope != 0.0 else low
        if value == 0.0 or high - low <= 2.3e-16 * end:
            return t
        if not (low < following < high):
            following = 0.5 * (low + high)
        if abs(following - t) <= 2.3e-16 * end:
            return following
        t = following
    return t
