"""Where the electrical energy goes: integrals over slip and stick.

Over slip: Gauss-Legendre of ten points on the closed-form state, in pieces short against every eigenvalue,
which is exact to rounding.  Over stick: closed forms.
"""

from __future__ import annotations

import math

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import scalar
from nonlinear._kernels.modal import M11, M12, M21, M22, slip_at

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
NODES, WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
E = layout.OUT_ENERGY


@scalar
def energy_slip(p, modal, at, reverse, t, s, i, w, u, T, Tb, out):  # type: ignore[no-untyped-def]
    """Add the energies of slipping for t in direction s from (i, w)."""
    rate = abs(modal[at + M11]) + abs(modal[at + M22]) + math.sqrt(abs(modal[at + M12] * modal[at + M21]))
    pieces = int(min(1.0 + rate * t, 1e4))
    h = t / pieces
    sum_i, sum_ii, sum_iw, sum_ww = 0.0, 0.0, 0.0, 0.0
    start_i, start_w, angle = i, w, 0.0
    for _ in range(pieces):
        for j in range(NODES.shape[0]):
            i_t, w_t, _ = slip_at(p, modal, at, reverse, h * NODES[j], start_i, start_w, 0.0, u, T)
            weight = h * WEIGHTS[j]
            sum_i += weight * i_t
            sum_ii += weight * i_t * i_t
            sum_iw += weight * i_t * w_t
            sum_ww += weight * w_t * w_t
        start_i, start_w, turned = slip_at(p, modal, at, reverse, h, start_i, start_w, 0.0, u, T)
        angle += turned
    Cv = p[layout.VISCOUS_REVERSE] if reverse else p[layout.VISCOUS]
    if p[layout.SOURCE] > 0.0:
        out[E + layout.ENERGY_INPUT] += p[layout.SOURCE_GAIN] * u * angle
    else:
        out[E + layout.ENERGY_INPUT] += u * sum_i
        out[E + layout.ENERGY_COPPER] += p[layout.RESISTANCE] * sum_ii
        out[E + layout.ENERGY_CONVERSION] += (p[layout.BACK_EMF] - p[layout.TORQUE_CONSTANT]) * sum_iw
    out[E + layout.ENERGY_DRY] += (Tb - T) * angle
    out[E + layout.ENERGY_VISCOUS] += Cv * sum_ww
    out[E + layout.ENERGY_OFFSET] += p[layout.OFFSET] * angle
    out[E + layout.ENERGY_LOAD] -= (Tb + p[layout.OFFSET]) * angle


@scalar
def energy_stick(p, t, i, u, out):  # type: ignore[no-untyped-def]
    """Add the energies of a locked rotor over t: i = i1 + (i0 - i1) exp(-R t/L)."""
    if p[layout.SOURCE] > 0.0 or t <= 0.0:
        return
    R = p[layout.RESISTANCE]
    rate = R / p[layout.INDUCTANCE]
    final = u / R
    d = i - final
    one = -math.expm1(-rate * t) / rate
    two = -math.expm1(-2.0 * rate * t) / (2.0 * rate)
    out[E + layout.ENERGY_INPUT] += u * (final * t + d * one)
    out[E + layout.ENERGY_COPPER] += R * (final * final * t + 2.0 * final * d * one + d * d * two)


@scalar
def energy_tanh(p, h, i0, w0, i1, w1, u, Tb, f0, f1, angle, out):  # type: ignore[no-untyped-def]
    """Add the energies of a short step by Simpson's rule with a cubic middle point (fourth order)."""
    kM, J, kE = p[layout.TORQUE_CONSTANT], p[layout.INERTIA], p[layout.BACK_EMF]
    R, Kg, Cv = p[layout.RESISTANCE], p[layout.SOURCE_GAIN], p[layout.VISCOUS]
    a0 = (kM * i0 + Kg * u + Tb + f0 - Cv * w0) / J
    a1 = (kM * i1 + Kg * u + Tb + f1 - Cv * w1) / J
    w_m = 0.5 * (w0 + w1) + 0.125 * h * (a0 - a1)
    x0, x1 = w0 / p[layout.SMOOTHING], w1 / p[layout.SMOOTHING]
    x_m = w_m / p[layout.SMOOTHING]
    top = f1 / math.tanh(x1) if x1 != 0.0 else (f0 / math.tanh(x0) if x0 != 0.0 else 0.0)
    f_m = top * math.tanh(x_m)
    sixth = h / 6.0
    out[E + layout.ENERGY_DRY] -= sixth * (f0 * w0 + 4.0 * f_m * w_m + f1 * w1)
    out[E + layout.ENERGY_VISCOUS] += Cv * sixth * (w0 * w0 + 4.0 * w_m * w_m + w1 * w1)
    out[E + layout.ENERGY_OFFSET] += p[layout.OFFSET] * angle
    out[E + layout.ENERGY_LOAD] -= (Tb + p[layout.OFFSET]) * angle
    if p[layout.SOURCE] > 0.0:
        out[E + layout.ENERGY_INPUT] += Kg * u * angle
        return
    L = p[layout.INDUCTANCE]
    d0, d1 = (u - R * i0 - kE * w0) / L, (u - R * i1 - kE * w1) / L
    i_m = 0.5 * (i0 + i1) + 0.125 * h * (d0 - d1)
    out[E + layout.ENERGY_INPUT] += u * sixth * (i0 + 4.0 * i_m + i1)
    out[E + layout.ENERGY_COPPER] += R * sixth * (i0 * i0 + 4.0 * i_m * i_m + i1 * i1)
    out[E + layout.ENERGY_CONVERSION] += (kE - kM) * sixth * (i0 * w0 + 4.0 * i_m * w_m + i1 * w1)
