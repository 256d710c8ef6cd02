"""Where the electrical energy goes: integrals over slip, and closed forms over stick.

Gauss-Legendre of ten points on the closed-form state, in pieces short against every eigenvalue, is exact to
rounding.
"""

import math

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.slipping import slip_at

KERNELS = True

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
NODES, WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
BALANCE = layout.S_ENERGY


def pieces_of(p, at, t):
    """Into how many pieces a time is cut so that each is short against every eigenvalue."""
    coupling = math.sqrt(abs(p[at + layout.M12] * p[at + layout.M21]))
    rate = abs(p[at + layout.M11]) + abs(p[at + layout.M22]) + coupling
    return int(min(1.0 + rate * t, 1e4))


def add_slip(p, s, reverse, u, T, Tb, angle, sum_i, sum_ii, sum_iw, sum_ww):
    """Add to the balance what the integrals of i, i^2, i w and w^2 over a slip of ``angle`` mean."""
    Cv = p[layout.VISCOUS_REVERSE] if reverse > 0 else p[layout.VISCOUS]
    if p[layout.SOURCE] > 0.0:
        s[BALANCE + layout.ENERGY_INPUT] += p[layout.SOURCE_GAIN] * u * angle
    else:
        s[BALANCE + layout.ENERGY_INPUT] += u * sum_i
        s[BALANCE + layout.ENERGY_COPPER] += p[layout.RESISTANCE] * sum_ii
        s[BALANCE + layout.ENERGY_CONVERSION] += (p[layout.BACK_EMF] - p[layout.TORQUE_CONSTANT]) * sum_iw
    s[BALANCE + layout.ENERGY_DRY] += (Tb - T) * angle
    s[BALANCE + layout.ENERGY_VISCOUS] += Cv * sum_ww
    s[BALANCE + layout.ENERGY_OFFSET] += p[layout.OFFSET] * angle
    s[BALANCE + layout.ENERGY_LOAD] -= (Tb + p[layout.OFFSET]) * angle


def energy_slip(p, s, at, reverse, t, i, w, u, T, Tb):
    """Add the energies of slipping for t from (i, w)."""
    pieces = pieces_of(p, at, t)
    h = t / pieces
    sum_i, sum_ii, sum_iw, sum_ww = 0.0, 0.0, 0.0, 0.0
    start_i, start_w, angle = i, w, 0.0
    for _ in range(pieces):
        for j in range(10):
            i_t, w_t, _th = slip_at(p, s, at, reverse, h * NODES[j], start_i, start_w, 0.0, u, T)
            weight = h * WEIGHTS[j]
            sum_i += weight * i_t
            sum_ii += weight * i_t * i_t
            sum_iw += weight * i_t * w_t
            sum_ww += weight * w_t * w_t
        start_i, start_w, turned = slip_at(p, s, at, reverse, h, start_i, start_w, 0.0, u, T)
        angle += turned
    add_slip(p, s, reverse, u, T, Tb, angle, sum_i, sum_ii, sum_iw, sum_ww)


def prepare_forms(p, s):
    """Write the integrals over each whole segment as forms of (i, w, u, T), by the same quadrature."""
    for which in range(4):
        side = 1 if which > 1 else 0
        part = which - 2 * side
        at, form = layout.MODES + side * layout.MODAL, layout.FORMS + which * layout.FORM
        for j in range(layout.FORM):
            p[form + j] = 0.0
        t = p[layout.LENGTH + part]
        pieces = pieces_of(p, at, t)
        h = t / pieces
        for piece in range(pieces):
            for j in range(10):
                add_node(p, s, at, side, (piece + NODES[j]) * h, h * WEIGHTS[j], form)


def add_node(p, s, at, side, t, weight, form):
    """Add one node of the quadrature to the forms: responses of i and w at t to each of (i, w, u, T)."""
    work = int(p[layout.AT_WORK]) + layout.WORK_MORE
    for n in range(4):
        i = 1.0 if n == 0 else 0.0
        w = 1.0 if n == 1 else 0.0
        u = 1.0 if n == 2 else 0.0
        T = 1.0 if n == 3 else 0.0
        i_t, w_t, _th = slip_at(p, s, at, side, t, i, w, 0.0, u, T)
        s[work + 2 * n], s[work + 2 * n + 1] = i_t, w_t
    place = form + 4
    for n in range(4):
        i_n, w_n = s[work + 2 * n], s[work + 2 * n + 1]
        p[form + n] += weight * i_n
        for m in range(n, 4):
            i_m, w_m = s[work + 2 * m], s[work + 2 * m + 1]
            twice = weight if m == n else 2.0 * weight
            p[place] += twice * i_n * i_m
            p[place + 10] += 0.5 * twice * (i_n * w_m + w_n * i_m)
            p[place + 20] += twice * w_n * w_m
            place += 1


def quadratic(p, at, a, b, c, d):
    """A quadratic form of four numbers from its ten coefficients."""
    return (
        a * (p[at] * a + p[at + 1] * b + p[at + 2] * c + p[at + 3] * d)
        + b * (p[at + 4] * b + p[at + 5] * c + p[at + 6] * d)
        + c * (p[at + 7] * c + p[at + 8] * d)
        + d * d * p[at + 9]
    )


def energy_whole(p, s, which, i, w, u, T, Tb):
    """Add the energies of slipping over a whole segment; ``which`` is 2 for the reverse direction + part."""
    form, at = layout.FORMS + which * layout.FORM, layout.SLIP + which * layout.TRANSITION
    angle = p[at + layout.A31] * i + p[at + layout.A32] * w + p[at + layout.B3] * u + p[at + layout.C3] * T
    sum_i = p[form] * i + p[form + 1] * w + p[form + 2] * u + p[form + 3] * T
    sum_ii, sum_iw = quadratic(p, form + 4, i, w, u, T), quadratic(p, form + 14, i, w, u, T)
    sum_ww = quadratic(p, form + 24, i, w, u, T)
    reverse = 1 if which > 1 else 0
    add_slip(p, s, reverse, u, T, Tb, angle, sum_i, sum_ii, sum_iw, sum_ww)


def energy_stick(p, s, t, i, u):
    """Add the energies of a locked rotor over t: i = i1 + (i0 - i1) exp(-R t/L)."""
    if p[layout.SOURCE] > 0.0 or t <= 0.0:
        return
    R = p[layout.RESISTANCE]
    rate = R / p[layout.INDUCTANCE]
    final = u / R
    d = i - final
    one = -math.expm1(-rate * t) / rate
    two = -math.expm1(-2.0 * rate * t) / (2.0 * rate)
    s[BALANCE + layout.ENERGY_INPUT] += u * (final * t + d * one)
    s[BALANCE + layout.ENERGY_COPPER] += R * (final * final * t + 2.0 * final * d * one + d * d * two)
