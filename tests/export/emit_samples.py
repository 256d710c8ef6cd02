"""Small kernels that use every construct of the subset, and some outside it."""

import math

from actuator_lti.compiled.kernel import kernel, seldom

FIRST, SECOND, THIRD = range(3)
GAIN = 1.0 / 3.0
TABLE = (0.1, -2.5, 1e-300)


@kernel
def small(x, limit):
    """Clamp."""
    return min(max(x, -limit), limit)


@kernel
def pair(x, y):
    return x * y + GAIN, x > y


@kernel
def passed_on(x):
    return pair(x, x)


@kernel
def push(s, at, x):
    old = s[at]
    s[at] = x
    return old


@kernel
def everything(p, s, n):
    """Each construct once."""
    total, last = 0.0, -1
    a, b = p[FIRST], p[SECOND]
    a, b = b, a  # swapped at once
    s[0] = s[1] = a
    s[2], s[3] = b, s[0] + 1.0
    for j in range(n):
        if j == 2:
            continue
        total += p[j] * TABLE[j & 1]
        if total > 1e6 and not (last > 2 and last < 4):
            break
        last = j
    k = 0
    while k < n:
        k += 1
        x, larger = pair(a, float(k))
        if larger or 0.0 < x < 1.0:
            total = total - x
        elif x != x:
            total = -total
        else:
            total = total / (1.0 + abs(x))
    y, _flag = passed_on(total)
    old = push(s, THIRD, small(y, 10.0))
    floor = math.floor(p[0] * 10.0) / 10.0
    bits = ((n << 2) | 1) + int((n + 2) / 3)
    wave = math.sin(a) + math.exp(-abs(b)) + math.atan2(a, 1.0 + b * b) + math.sqrt(abs(a)) + math.pi
    return total + old + floor + float(bits) + wave if n > 1 else -total - old + min(n, 2) * wave


@seldom
@kernel
def dear(p, x):
    """Called where something happens."""
    return x * p[SECOND] + GAIN


@kernel
def gated(p, x):
    """Parts that a row may rule out."""
    wanted = p[FIRST] > 0.0 and p[SECOND] > 0.0
    y = p[THIRD] * x if p[FIRST] > 0.0 else x
    if wanted:
        y = math.sin(y)
    if not p[FIRST] > 0.0:
        y += dear(p, y)
    elif y > 1.0:
        y -= 1.0
    return y + p[FIRST]


@kernel
def through(p, x):
    return gated(p, x)


@kernel
def power(x):
    return x**2


@kernel
def two_types(x):
    y = 0
    y = x + 1.0
    return 2.0 * y


@kernel
def open_order(s):
    """A look into a row beside a call that writes it."""
    return s[0] + push(s, 0, 1.0)


@kernel
def twice(s):
    """Two writers in one expression."""
    return push(s, 0, 1.0) - push(s, 0, 2.0)


@kernel
def truth(x):
    if x:
        return 1.0
    return 2.0


@kernel
def sliced(s):
    s[0:2] = 1.0
