"""Step response of a rational system as the free motion of its poles, from its doubles as they are.

The transfer function follows exactly, its roots are isolated in certified balls, and the coordinates of the
motion are computed in as many digits as they need.
"""

from __future__ import annotations

from typing import Any

import flint
import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.exact.roots import at_enough_bits
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.step.motion import Motion, gain_of
from actuator_lti.systems.exact_fraction import (
    Fraction,
    balls,
    dc_noise,
    divided,
    double,
    exact_fraction,
    exact_sum,
    near_dc,
    roots,
    shown,
)

_EPS = float(np.finfo(float).eps)
_FIRST_BITS = 192
_SURE_BITS = 60
UNSTABLE = "the system is not stable: it has no step figures"
NO_FINAL = "the final value of the step response is zero: it has no rise, overshoot or settling"
_INTEGRATES = "the system integrates: its step response has no final value"

_Poles = list[flint.acb]  # each as often as it is repeated


def rational_motion(system: Any, loop: RationalLoop) -> tuple[Motion, float]:
    """The motion and the final value of the unit step response of a stable rational system.

    ``loop`` is the same, balanced (which is exact); coefficients are taken from the system itself.
    """
    whole = exact_fraction(system)
    f, dc = shown(whole, loop), 1 if loop.in_z else 0

    def motion() -> Motion | None:
        poles = _poles(loop, f, whole.whole_den / whole.den)
        final = f.num(dc) / f.den(dc)
        if final == 0:
            raise InputError(NO_FINAL)
        if abs(double(final)) <= dc_noise(loop):
            raise NumericalError(NO_FINAL.replace("is zero:", "is zero within the rounding of the entries:"))
        rest = (f.num / final - f.den) / flint.fmpq_poly([-dc, 1])
        return free_motion(balls(rest / f.den[f.den.degree()]), poles, loop.in_z)

    return at_enough_bits(motion, _FIRST_BITS, "a pole of the step response"), double(f.num(dc) / f.den(dc))


def free_motion(rest: flint.acb_poly, poles: _Poles, sampled: bool, start: float = 0.0) -> Motion | None:
    """The motion with the transform rest/(product of x - pole); ``None``: more digits are needed.

    Sampled: e_0 + e_1/z + ... is z times that. The fastest pole first, which alone its function has.
    """
    poles = sorted(poles, key=lambda p: -abs(complex(p)) if sampled else -complex(p).real)
    mirrored = [flint.acb_poly([1])]
    for p in poles:
        q = p.conjugate()
        mirrored.append(mirrored[-1] * flint.acb_poly([1, -q] if sampled else [q, 1]))
    state: list[flint.acb] = [flint.acb(0)] * len(poles)
    for j in reversed(range(len(poles))):
        gain = gain_of(poles[j], sampled)
        state[j] = rest(poles[j]) / (gain * mirrored[j](poles[j]))
        rest = divided(rest - state[j] * gain * mirrored[j], poles[j])
        if not _sharp(state[j] * gain, 1.0) or not _sharp(poles[j], abs(complex(poles[j]))):
            return None
    return Motion(poles, state, sampled, start)


def _sharp(value: flint.acb, unit: float) -> bool:
    radius = max(float(value.real.rad()), float(value.imag.rad()))
    return radius <= max(unit, 1e-300) * 2.0**-_SURE_BITS


def _poles(loop: RationalLoop, f: Fraction, hidden: flint.fmpq_poly) -> _Poles:
    dc = flint.acb(1 if loop.in_z else 0)
    seen = roots(f.den)
    unseen = [p for p, _ in roots(hidden) if not near_dc(p, loop)]
    for p in [*unseen, *(p for p, _ in seen)]:
        inside = abs(p) < 1 if loop.in_z else p.real < 0  # true only where certain
        if not inside and not (p - dc).contains(flint.acb(0)):
            raise InputError(UNSTABLE)
    for p, times in seen:
        if (p - dc).contains(flint.acb(0)):
            raise InputError(_INTEGRATES if times == 1 else UNSTABLE)
    return [p for p, times in seen for _ in range(times)]


def notes(loop: RationalLoop) -> tuple[str, ...]:
    """Say where the last digits of the coefficients decide about the final value."""
    if not loop.in_z or loop.coefficients is None:
        return ()
    sums = [(abs(exact_sum(p)), float(np.abs(p).sum())) for p in loop.coefficients]
    moved = ULP * _EPS * sum(whole / total for total, whole in sums)
    if moved < 0.01:
        return ()
    return (
        f"{ULP} units in the last place of the coefficients move the final value by {100 * moved:.2g} %: "
        "the figures are those of the coefficients as given; a state space would hold the system better",
    )
