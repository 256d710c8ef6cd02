"""A stretch of held voltage: slip, landing, stick and breakaway, as often as they come."""

from __future__ import annotations

import math

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import inlined, kernel, scalar
from nonlinear._kernels.energy import energy_slip, energy_stick
from nonlinear._kernels.expm import (
    A11,
    A12,
    A21,
    A22,
    A31,
    A32,
    B1,
    B2,
    B3,
    C1,
    C2,
    C3,
    TRANSITION,
    transition,
)
from nonlinear._kernels.landing import NEVER_LEFT, NONE_IN_SEGMENT, first_landing
from nonlinear._kernels.modal import COMPLEX, KIND, MODAL, ROOT, describe, slip_at

# constants of one run: transitions (direction, segment), modal numbers of both directions, then
# the decay of the locked current over each segment, the segments' lengths, and three flags
MODAL_AT = 4 * TRANSITION
DECAY = MODAL_AT + 2 * MODAL
LENGTH = DECAY + 2
SMOOTH = LENGTH + 2  # 1: no dry friction and one viscous slope, so nothing happens at w = 0
RINGING = SMOOTH + 1  # 1: w' may change sign twice in a segment: always look
RELAX = RINGING + 1  # R/L
CONSTANTS = RELAX + 1


@kernel
def prepare(p, constants):  # type: ignore[no-untyped-def]
    """Everything of a run that does not change with time."""
    Ts, f = p[layout.PERIOD], p[layout.DELAY_FRACTION]
    space = np.empty((4, 5, 5))
    constants[LENGTH], constants[LENGTH + 1] = f, Ts - f
    constants[RINGING] = 0.0
    for direction in range(2):
        describe(p, direction == 1, constants, MODAL_AT + direction * MODAL)
        at = MODAL_AT + direction * MODAL
        if int(constants[at + KIND]) == COMPLEX and constants[at + ROOT] * Ts >= 3.0:
            constants[RINGING] = 1.0
        for part in range(2):
            place = (2 * direction + part) * TRANSITION
            transition(p, direction == 1, constants[LENGTH + part], space, constants, place)
    constants[RELAX] = p[layout.RESISTANCE] / p[layout.INDUCTANCE]
    for part in range(2):
        constants[DECAY + part] = math.exp(-constants[RELAX] * constants[LENGTH + part])
    dry = p[layout.DRY] + p[layout.DRY_REVERSE] + p[layout.LOAD_COEFFICIENT]
    same = p[layout.VISCOUS] == p[layout.VISCOUS_REVERSE]
    constants[SMOOTH] = 1.0 if dry == 0.0 and same else 0.0


@inlined
def slip_step(m, o, i, w, th, u, T):  # type: ignore[no-untyped-def]
    """One precomputed transition."""
    return (
        m[o + A11] * i + m[o + A12] * w + m[o + B1] * u + m[o + C1] * T,
        m[o + A21] * i + m[o + A22] * w + m[o + B2] * u + m[o + C2] * T,
        th + (m[o + A31] * i + m[o + A32] * w + m[o + B3] * u + m[o + C3] * T),
    )


@scalar
def breakaway_time(p, i, level, u, Tb, dt):  # type: ignore[no-untyped-def]
    """Time at which the drive torque of the locked rotor reaches ``level``; also the current then."""
    R, L = p[layout.RESISTANCE], p[layout.INDUCTANCE]
    i_level = (level - Tb) / p[layout.TORQUE_CONSTANT]
    final = u / R
    ratio = (i - final) / (i_level - final)
    t = L / R * math.log(ratio) if ratio > 1.0 else 0.0
    return min(t, dt), i_level


@scalar
def stick(p, i, u, Tb, Tp, Tm, dt, decay):  # type: ignore[no-untyped-def]
    """Locked rotor: time spent, current after it, direction of the breakaway (0: none).

    ``decay`` is exp(-R dt/L).
    """
    kM, Kg = p[layout.TORQUE_CONSTANT], p[layout.SOURCE_GAIN]
    drive = kM * i + Kg * u + Tb
    if drive > Tp:
        return 0.0, i, 1.0
    if drive < -Tm:
        return 0.0, i, -1.0
    if p[layout.SOURCE] > 0.0:
        return dt, i, 0.0
    final = u * (1.0 / p[layout.RESISTANCE])
    i_end = final + (i - final) * decay
    drive = kM * i_end + Tb
    if drive > Tp:
        t, i_end = breakaway_time(p, i, Tp, u, Tb, dt)
        return t, i_end, 1.0
    if drive < -Tm:
        t, i_end = breakaway_time(p, i, -Tm, u, Tb, dt)
        return t, i_end, -1.0
    return dt, i_end, 0.0


@scalar
def direction_at_rest(p, i, u, Tb, Tp, Tm, s):  # type: ignore[no-untyped-def]
    """What follows a landing of motion s: 0 rest while |drive| <= Tc breakaway, -s motion the other way."""
    drive = p[layout.TORQUE_CONSTANT] * i + p[layout.SOURCE_GAIN] * u + Tb
    if (s > 0.0 and drive < -Tm) or (s < 0.0 and drive > Tp):
        return -s
    return 0.0


@scalar
def segment(p, c, part, u, Tb, Tcp, Tcm, i, w, th, s, result):  # type: ignore[no-untyped-def]
    """Advance over one segment with all its events.

    Tb is the torque beside motor and friction, Tcp and Tcm the dry friction of both directions, s the
    direction of slip (0: at rest).  Returns (i, w, th, s, events, status); energies are added to ``result``.
    """
    whole = c[LENGTH + part]
    left, events = whole, 0
    Tp, Tm = Tcp * p[layout.BREAKAWAY], Tcm * p[layout.BREAKAWAY]
    energy = p[layout.WITH_ENERGY] > 0.0
    smooth = c[SMOOTH] > 0.0
    while left > 0.0:
        if events > p[layout.MAX_EVENTS]:
            return i, w, th, s, events, layout.TOO_MANY_EVENTS
        if s == 0.0:
            decay = c[DECAY + part] if left == whole else math.exp(-c[RELAX] * left)
            t, i_end, s = stick(p, i, u, Tb, Tp, Tm, left, decay)
            if energy:
                energy_stick(p, t, i, u, result)
            i = i_end
            left -= t
            if s != 0.0:
                events += 1
            continue
        reverse = s < 0.0
        side = 1 if reverse else 0
        at = MODAL_AT + side * MODAL
        T = Tb - s * (Tcm if reverse else Tcp)
        t = NONE_IN_SEGMENT
        if not smooth:
            t = first_landing(p, c, at, reverse, s, i, w, th, u, T, left)
        span = left if t < 0.0 else t
        if energy:
            energy_slip(p, c, at, reverse, span, s, i, w, u, T, Tb, result)
        if t < 0.0 and left == whole:
            i, w, th = slip_step(c, (2 * side + part) * TRANSITION, i, w, th, u, T)
        else:
            i, w, th = slip_at(p, c, at, reverse, span, i, w, th, u, T)
        left -= span
        if t == NEVER_LEFT:
            w, s = 0.0, 0.0
        elif t >= 0.0:
            w = 0.0
            s = direction_at_rest(p, i, u, Tb, Tp, Tm, s)
            events += 1
    return i, w, th, s, events, layout.OK
