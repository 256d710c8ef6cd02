"""Proportional, integral, and what happens to the integral at a limit."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout

CONDITIONAL, CLAMPED, BACK_CALCULATION = range(3)


@kernel
def clamp(value, limit):
    """Value held within +-limit."""
    return min(max(value, -limit), limit)


@kernel
def pi(e, integral, gain, step, limit):
    """PI with conditional integration: output, new integral, and 1 where the limit acts.

    ``step`` is Kp T/Tn.  The new integral is kept if the output is not clamped or v and e have opposite
    signs; otherwise the old one is, and the output is formed with it.
    """
    updated = integral + step * e
    v = gain * e + updated
    out = clamp(v, limit)
    if out == v:
        return out, updated, 0.0
    if (v > 0.0 and e < 0.0) or (v < 0.0 and e > 0.0):
        return out, updated, 1.0
    return clamp(gain * e + integral, limit), integral, 1.0


@kernel
def regulator(e, integral, gain, step, extra, limit, law, tracking):
    """PI with a feed-forward ``extra`` and any anti-windup law; the same three numbers as `pi`.

    The limit acts where it clamps the output, and by law 1 where it clamps the integral.

    ``law`` 0: as there, with v = Kp e + I' + extra.  1: I' = clamp(I + Kp T/Tn e).  2, back-calculation:
    I' = I + Kp T/Tn e + (T/Tt)(out - v), ``tracking`` being T/Tt.
    """
    updated = integral + step * e
    kind, held = int(law), 0.0
    if kind == CLAMPED:
        within = clamp(updated, limit)
        held = 0.0 if within == updated else 1.0
        updated = within
    v = gain * e + updated + extra
    out = clamp(v, limit)
    if out == v:
        return out, updated, held
    if kind == CLAMPED:
        return out, updated, 1.0
    if kind == BACK_CALCULATION:
        return out, updated + tracking * (out - v), 1.0
    if (v > 0.0 and e < 0.0) or (v < 0.0 and e > 0.0):
        return out, updated, 1.0
    return clamp(gain * e + integral + extra, limit), integral, 1.0


@kernel
def velocity_regulator(p, s, e, limit):
    """The velocity controller's own law on its error."""
    return regulator(
        e, s[layout.S_VELOCITY_INTEGRATOR], p[layout.VELOCITY_GAIN], p[layout.VELOCITY_INTEGRAL],
        s[layout.S_TORQUE_FEEDFORWARD], limit, p[layout.VELOCITY_WINDUP], p[layout.VELOCITY_TRACKING],
    )  # fmt: skip
