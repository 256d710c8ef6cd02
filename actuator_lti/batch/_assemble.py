"""The sampled open loops of one drive as small state spaces, compiled (model.md, sections 2 and 3).

The states of the fast system are the plant (current, speed, angle), the voltages still on their way
(computing delay) and the controllers' integrators.  Each loop closes the ones inside it; a slower loop
sees the inner one held for n ticks, ``A^n, (I + A + ... + A^(n-1)) B``.  No loop has a direct term.

A row of parameters holds, in this order, the constants ``R`` ... ``K_FF`` below; a row of structure the
constants ``ELECTRICAL`` ... ``FILTER``.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel
from ._linalg import exponential, multiply

R, L, K_M, K_E, J, SLOPE, STIFFNESS, PERIOD, DELAY, KP_C, TN_C, KP_V, TN_V, KP_P, T_F, K_FF = range(16)
PARAMETERS = 16
ELECTRICAL, CURRENT, VELOCITY, N_V, N_P, DIFFERENCE, FILTER = range(7)
NONE, PROPORTIONAL, PI = 0, 1, 2
TINY_DELAY = 1e-9  # fraction of a tick below which a delay counts as a whole number of ticks


@kernel
def plant(kind, p, a, b):
    """Write the slipping plant dx/dt = a x + b u; return its order (angle last, speed before it)."""
    a[:] = 0.0
    b[:] = 0.0
    if kind[ELECTRICAL]:
        a[0, 0] = -p[R] / p[L]
        a[0, 1] = -p[K_E] / p[L]
        b[0] = 1.0 / p[L]
        a[1, 0] = p[K_M] / p[J]
        a[1, 1] = -p[SLOPE] / p[J]
        a[2, 1] = 1.0
        return 3
    a[0, 0] = -p[SLOPE] / p[J]
    b[0] = p[K_M] / p[J]
    a[1, 0] = 1.0
    return 2


@kernel
def _hold(m, a, b, time_s, phi, gamma, work):
    """Transition matrix and held-input vector over time_s of an m-state plant."""
    s, e, t, w = work[0], work[1], work[2], work[3]
    for i in range(m + 1):
        for j in range(m + 1):
            s[i, j] = 0.0
    for i in range(m):
        for j in range(m):
            s[i, j] = a[i, j] * time_s
        s[i, m] = b[i] * time_s
    exponential(m + 1, s, e, t, w)
    for i in range(m):
        for j in range(m):
            phi[i, j] = e[i, j]
        gamma[i] = e[i, m]


@kernel
def sampled_plant(kind, p, space, a, b):
    """Write the fast system from u_k: plant, then voltages on their way; return (order, plant order)."""
    pa, phi0, phi1, work = space[0], space[1], space[2], space[3:]
    pb, gamma0, gamma1 = space[7, 0], space[7, 1], space[7, 2]
    m = plant(kind, p, pa, pb)
    period = p[PERIOD]
    ticks = int(np.floor(p[DELAY] / period + TINY_DELAY))
    fraction = p[DELAY] / period - ticks
    fractional = fraction > TINY_DELAY
    n = m + ticks + (1 if fractional else 0)
    a[:] = 0.0
    b[:] = 0.0
    _hold(m, pa, pb, (1.0 - fraction) * period if fractional else period, phi0, gamma0, work)
    if fractional:
        _hold(m, pa, pb, fraction * period, phi1, gamma1, work)
        for i in range(m):
            late = 0.0
            for j in range(m):
                total = 0.0
                for k in range(m):
                    total += phi0[i, k] * phi1[k, j]
                a[i, j] = total
                late += phi0[i, j] * gamma1[j]
            a[i, m + ticks] = late  # u_{k - ticks - 1}
    else:
        for i in range(m):
            for j in range(m):
                a[i, j] = phi0[i, j]
    for i in range(m):
        if ticks == 0:
            b[i] = gamma0[i]
        else:
            a[i, m + ticks - 1] += gamma0[i]  # u_{k - ticks}
    if n > m:
        b[m] = 1.0
        for i in range(m + 1, n):
            a[i, i - 1] = 1.0
    if p[STIFFNESS] != 0.0:  # a hinge moment that follows the angle, held over the tick
        pb[:] = 0.0
        pb[m - 2] = p[STIFFNESS] / p[J]
        _hold(m, pa, pb, period, phi1, gamma1, work)
        for i in range(m):
            a[i, m - 1] += gamma1[i]
    return n, m


@kernel
def close(n, a, b, c):
    """Close negative unit feedback in place: a - b c."""
    for i in range(n):
        for j in range(n):
            a[i, j] -= b[i] * c[j]


@kernel
def add_controller(n, a, b, c, gain, step_over_time):
    """Put a PI (P where step_over_time is 0) in front of the input; return the number of states.

    The new last state is the integrator; the input becomes the error: v = Kp e + I', I' = I + Kp T/Tn e.
    """
    integral = gain * step_over_time
    size = n
    if step_over_time != 0.0:
        for i in range(n):
            a[i, n] = b[i]
            a[n, i] = 0.0
        a[n, n] = 1.0
        size = n + 1
    for i in range(n):
        b[i] *= gain + integral
    if size > n:
        b[n] = integral
        c[n] = 0.0
    return size


@kernel
def held(n, times, a, b, power, work):
    """Hold the input for a number of ticks: a <- a^n, b <- (I + a + ... + a^(n-1)) b."""
    if times == 1:
        return
    step = np.empty(n)
    total = b[:n].copy()
    for i in range(n):
        for j in range(n):
            power[i, j] = a[i, j]
    for _ in range(times - 1):
        for i in range(n):
            step[i] = b[i]
            for j in range(n):
                step[i] += a[i, j] * total[j]
        total[:] = step
        multiply(n, a, power, work)
        for i in range(n):
            for j in range(n):
                power[i, j] = work[i, j]
    for i in range(n):
        b[i] = total[i]
        for j in range(n):
            a[i, j] = power[i, j]


@kernel
def add_speed_measurement(n, angle, kind, p, a, b, c):
    """Write the measured speed as c over the states, with the states that the measurement needs; return n.

    The difference over m samples is kept as angle increments, so that no pole at 1 has to cancel.
    """
    m = kind[DIFFERENCE]
    for i in range(n):
        c[i] = 0.0
    if m == 0:
        c[angle - 1] = 1.0
    else:
        for d in range(m):  # state n + d at time k holds th_k - th_{k-d-1}
            for j in range(n + m):
                a[n + d, j] = a[angle, j] if j < n else 0.0
                if j < n:
                    a[j, n + d] = 0.0
            a[n + d, angle] -= 1.0
            if d > 0:
                a[n + d, n + d - 1] = 1.0
            b[n + d] = b[angle]
            c[n + d] = 0.0
        n += m
        c[n - 1] = 1.0 / (m * kind[N_V] * p[PERIOD])
    if kind[FILTER]:
        period = kind[N_V] * p[PERIOD]
        share = period / (p[T_F] + period)
        for j in range(n):
            a[n, j] = share * c[j]
            a[j, n] = 0.0
            c[j] *= share
        a[n, n] = 1.0 - share
        b[n] = 0.0
        c[n] = 1.0 - share
        n += 1
    return n


@kernel
def without_state(n, skip, a, b, c, out_a, out_b, out_c):
    """Copy a system without one state that the output does not see (skip < 0 keeps all); return its order."""
    r = 0
    for i in range(n):
        if i == skip:
            continue
        s = 0
        for j in range(n):
            if j == skip:
                continue
            out_a[r, s] = a[i, j]
            s += 1
        out_b[r] = b[i]
        out_c[r] = c[i]
        r += 1
    return r


@kernel
def open_loops(kind, p, space, a, b, c, loops_a, loops_b, loops_c, orders):
    """Write the open current, velocity and position loops (order 0 where there is none)."""
    n, m = sampled_plant(kind, p, space, a, b)
    angle = m - 1
    hidden = -1 if p[STIFFNESS] != 0.0 else angle
    orders[0] = 0
    orders[1] = 0
    if kind[CURRENT] != NONE:
        for i in range(n):
            c[i] = 0.0
        c[0] = 1.0
        n = add_controller(n, a, b, c, p[KP_C], p[PERIOD] / p[TN_C] if kind[CURRENT] == PI else 0.0)
        orders[0] = without_state(n, hidden, a, b, c, loops_a[0], loops_b[0], loops_c[0])
        close(n, a, b, c)
    if kind[VELOCITY] != NONE:
        held(n, kind[N_V], a, b, space[0], space[1])
        n = add_speed_measurement(n, angle, kind, p, a, b, c)
        ratio = kind[N_V] * p[PERIOD] / p[TN_V] if kind[VELOCITY] == PI else 0.0
        n = add_controller(n, a, b, c, p[KP_V], ratio)
        orders[1] = without_state(n, hidden, a, b, c, loops_a[1], loops_b[1], loops_c[1])
        close(n, a, b, c)
        held(n, kind[N_P] // kind[N_V], a, b, space[0], space[1])
    else:
        held(n, kind[N_P], a, b, space[0], space[1])
    for i in range(n):
        c[i] = 0.0
    c[angle] = 1.0
    n = add_controller(n, a, b, c, p[KP_P], 0.0)
    # The difference measurement's increments do not drive the angle's own future except through feedback,
    # which keeps them; nothing is hidden from the position.
    orders[2] = without_state(n, -1, a, b, c, loops_a[2], loops_b[2], loops_c[2])
