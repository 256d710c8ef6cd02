"""The smoothed friction law Tc tanh(w/w_s), by exponential Runge-Kutta steps of fourth order.

The linear plant and the held voltage are propagated exactly; only the tanh term is approximated (Cox and
Matthews 2002, ETD4RK), so a small inductance costs nothing.  A step h is chosen from the tolerance:
rate h <= STEP_FACTOR tolerance^(1/4), where ``rate`` is the relaxation rate Tc/(J w_s) plus the
rate |w'|/w_s at which the tanh is run through, so that the tolerance bounds the error of the speed
that a tick adds, in smoothing speeds; steps are a segment divided by a power of two.  Beyond
SATURATED smoothing speeds tanh is 1 to the last bit but one and a whole segment is exact.
"""

from __future__ import annotations

import math

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import kernel, scalar
from nonlinear._kernels.energy import energy_tanh
from nonlinear._kernels.expm import TRANSITION, exponential, plant, transition
from nonlinear._kernels.segment import LENGTH, slip_step

LEVELS = 16
SATURATED = 19.0
STEP_FACTOR = 4.0  # leaves about a factor of twenty to the error seen
# one level: transition over h/2 (12), over h (12), phi1 at h/2 (3), weights of N(u), N(a)+N(b), N(c) (9)
HALF, FULL = 0, TRANSITION
STAGE = 2 * TRANSITION
W1, W2, W3 = STAGE + 3, STAGE + 6, STAGE + 9
LEVEL = STAGE + 12


@scalar
def phi_columns(p, h, space):  # type: ignore[no-untyped-def]
    """exp of the plant over h; columns 4, 5, 6 are h phi1, h phi2, h phi3 applied to a unit torque."""
    a, e = space[0], space[1]
    plant(p, False, h, a)
    # the torque input is fed by a chain of integrators over the step: column 5 drives 4, column 6 drives 5
    a[4, 5] = 1.0
    a[5, 6] = 1.0
    exponential(a, 7, e, space[2], space[3])


@kernel
def prepare_tanh(p, constants, table):  # type: ignore[no-untyped-def]
    """Fill the coefficients of every level for both segments."""
    space = np.empty((4, 7, 7))
    for part in range(2):
        for level in range(LEVELS):
            h = constants[LENGTH + part] / 2.0**level
            if h > 0.0:
                prepare_level(p, h, space, table, (part * LEVELS + level) * LEVEL)


@scalar
def prepare_level(p, h, space, table, o):  # type: ignore[no-untyped-def]
    """Fill the coefficients of one step length at ``table[o]``."""
    transition(p, False, 0.5 * h, space, table, o + HALF)
    transition(p, False, h, space, table, o + FULL)
    phi_columns(p, 0.5 * h, space)
    e = space[1]
    for r in range(3):
        table[o + STAGE + r] = e[r, 4]
    phi_columns(p, h, space)
    for r in range(3):
        first, second, third = e[r, 4], e[r, 5], e[r, 6]
        table[o + W1 + r] = first - 3.0 * second + 4.0 * third
        table[o + W2 + r] = 2.0 * second - 4.0 * third
        table[o + W3 + r] = 4.0 * third - second


@scalar
def tanh_torque(p, w, Tcp, Tcm):  # type: ignore[no-untyped-def]
    """Torque of the friction beyond the forward viscous slope, with its sign in the equation of motion."""
    x = w / p[layout.SMOOTHING]
    if w >= 0.0:
        return -Tcp * math.tanh(x)
    return -Tcm * math.tanh(x) - (p[layout.VISCOUS_REVERSE] - p[layout.VISCOUS]) * w


@scalar
def level_for(p, i, w, u, Tb, Tcp, Tcm, h):  # type: ignore[no-untyped-def]
    """Number of halvings of h that the tolerance asks for at this state."""
    if p[layout.TANH_LEVEL] >= 0.0:
        return int(p[layout.TANH_LEVEL])
    J, ws = p[layout.INERTIA], p[layout.SMOOTHING]
    drive = p[layout.TORQUE_CONSTANT] * i + p[layout.SOURCE_GAIN] * u + Tb + tanh_torque(p, w, Tcp, Tcm)
    Tc = max(Tcp, Tcm)
    rate = (Tc / J + abs(drive) / J) / ws
    rate += abs(p[layout.VISCOUS_REVERSE] - p[layout.VISCOUS]) / J
    if p[layout.SOURCE] <= 0.0:
        # the drive changes within the step as fast as the current does
        jump = p[layout.TORQUE_CONSTANT] * abs(u / p[layout.RESISTANCE] - i)
        share = 1.0 - math.exp(-h * p[layout.RESISTANCE] / p[layout.INDUCTANCE])
        rate += jump * share / (J * ws)
    wanted = rate * h / (STEP_FACTOR * math.sqrt(math.sqrt(p[layout.TANH_TOLERANCE])))
    level = 0
    while wanted > 1.0 and level < LEVELS - 1:
        wanted *= 0.5
        level += 1
    return level


@scalar
def etd_step(p, table, o, i, w, th, u, Tb, Tcp, Tcm):  # type: ignore[no-untyped-def]
    """One ETD4RK step."""
    n0 = tanh_torque(p, w, Tcp, Tcm)
    ih, wh, thh = slip_step(table, o + HALF, i, w, th, u, Tb)
    ia, wa, tha = ih + table[o + STAGE] * n0, wh + table[o + STAGE + 1] * n0, thh + table[o + STAGE + 2] * n0
    na = tanh_torque(p, wa, Tcp, Tcm)
    nb = tanh_torque(p, wh + table[o + STAGE + 1] * na, Tcp, Tcm)
    _, wc, _ = slip_step(table, o + HALF, ia, wa, tha, u, Tb)
    nc = tanh_torque(p, wc + table[o + STAGE + 1] * (2.0 * nb - n0), Tcp, Tcm)
    i, w, th = slip_step(table, o + FULL, i, w, th, u, Tb)
    nab = na + nb
    return (
        i + table[o + W1] * n0 + table[o + W2] * nab + table[o + W3] * nc,
        w + table[o + W1 + 1] * n0 + table[o + W2 + 1] * nab + table[o + W3 + 1] * nc,
        th + table[o + W1 + 2] * n0 + table[o + W2 + 2] * nab + table[o + W3 + 2] * nc,
    )


@scalar
def tanh_segment(p, c, table, part, u, Tb, Tcp, Tcm, i, w, th, result):  # type: ignore[no-untyped-def]
    """Advance over one segment under the smoothed law; returns (i, w, th)."""
    whole = c[LENGTH + part]
    done, steps = 0, 1 << (LEVELS - 1)  # in units of the shortest step
    energy = p[layout.WITH_ENERGY] > 0.0
    ws, wanted = p[layout.SMOOTHING], p[layout.TANH_TOLERANCE] * p[layout.SMOOTHING]
    far = SATURATED * ws
    bend = abs(Tcp - Tcm) / ws + abs(p[layout.VISCOUS_REVERSE] - p[layout.VISCOUS])
    kink = bend / p[layout.INERTIA] * whole / steps / wanted if p[layout.TANH_LEVEL] < 0.0 else 0.0
    while done < steps:
        s = 1.0 if w > 0.0 else -1.0
        if done == 0 and abs(w) > far and p[layout.TANH_LEVEL] < 0.0 and not energy:
            side = 0 if w > 0.0 else 1
            T = Tb - s * (Tcm if side else Tcp)
            i1, w1, th1 = slip_step(c, (2 * side + part) * TRANSITION, i, w, th, u, T)
            if s * w1 > far and abs(w1 - w) < 0.5 * (abs(w) + far):
                return i1, w1, th1
        level = level_for(p, i, w, u, Tb, Tcp, Tcm, whole)
        unit = steps >> level
        while done % unit != 0:
            unit >>= 1
            level += 1
        i0, w0 = i, w
        i, w, th1 = etd_step(p, table, (part * LEVELS + level) * LEVEL, i0, w0, th, u, Tb, Tcp, Tcm)
        # unequal friction has a bend at w = 0: a step across it is halved until the bend does not matter
        while kink * abs(w - w0) * unit > 1.0 and w * w0 < 0.0 and unit > 1:
            unit >>= 1
            level += 1
            i, w, th1 = etd_step(p, table, (part * LEVELS + level) * LEVEL, i0, w0, th, u, Tb, Tcp, Tcm)
        if energy:
            f0, f1 = tanh_torque(p, w0, Tcp, Tcm), tanh_torque(p, w, Tcp, Tcm)
            energy_tanh(p, whole / 2.0**level, i0, w0, i, w, u, Tb, f0, f1, th1 - th, result)
        th = th1
        done += unit
    return i, w, th
