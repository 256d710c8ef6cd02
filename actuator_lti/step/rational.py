"""Step response of a rational system as the free motion of its poles, from its doubles as they are.

The transfer function follows exactly, its roots are isolated in certified balls, and the coordinates of the
motion are computed in as many digits as they need.
"""

from __future__ import annotations

from typing import Any

import flint
import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.exact_fraction import Fraction, dc_noise, double, exact_fraction, exact_sum, roots
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.step.motion import Motion, gain_of

_EPS = float(np.finfo(float).eps)
_NEAR_DC = 1e-7  # a pole this near to zero frequency may be one that the response does not show
_UNSEEN = 1e-9  # what it may move, of the final value, before the rest has settled
_FIRST_BITS = 192
_MOST_BITS = 16384
_SURE_BITS = 60
UNSTABLE = "the system is not stable: it has no step figures"
NO_FINAL = "the final value of the step response is zero: it has no rise, overshoot or settling"
_INTEGRATES = "the system integrates: its step response has no final value"

_Poles = list[flint.acb]  # each as often as it is repeated


def rational_motion(system: Any, loop: RationalLoop) -> tuple[Motion, float]:
    """Find the motion and the final value of the unit step response of a stable rational system.

    Parameters
    ----------
    system : StateSpace or TransferFunction
        One input, one output.
    loop : RationalLoop
        The same, balanced (which is exact); coefficients are taken from the system itself.

    Raises
    ------
    InputError
        Not stable, integrating, or a final value of zero.
    NumericalError
        The final value is lost in the rounding of the entries.
    """
    fraction = exact_fraction(system)
    bits = _FIRST_BITS
    while bits <= _MOST_BITS:
        with flint.ctx.workprec(bits):
            poles, unseen = _poles(loop, fraction)
            final, rest = _deviation(loop, fraction, poles, unseen)
            motion = free_motion(rest, poles, loop.in_z)
        if motion is not None:
            return motion, final
        bits *= 2
    raise NumericalError("the poles of the step response lie too close together to be told apart")


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
        rest = _divided(rest - state[j] * gain * mirrored[j], poles[j])
        if not _sharp(state[j] * gain, 1.0) or not _sharp(poles[j], abs(complex(poles[j]))):
            return None
    return Motion(poles, state, sampled, start)


def _sharp(value: flint.acb, unit: float) -> bool:
    radius = max(float(value.real.rad()), float(value.imag.rad()))
    return radius <= max(unit, 1e-300) * 2.0**-_SURE_BITS


def product(poles: _Poles) -> flint.acb_poly:
    """The polynomial with these roots."""
    total = flint.acb_poly([1])
    for p in poles:
        total *= flint.acb_poly([-p, 1])
    return total


def _divided(p: flint.acb_poly, at: flint.acb) -> flint.acb_poly:
    """p over x - at, the remainder left out."""
    quotient, carried = [], flint.acb(0)
    for value in reversed(p.coeffs()):
        carried = value + at * carried
        quotient.append(carried)
    return flint.acb_poly(quotient[-2::-1])


def _poles(loop: RationalLoop, f: Fraction) -> tuple[_Poles, _Poles]:
    """The poles that the response shows, and those at zero frequency but for rounding that it does not."""
    dc = flint.acb(1 if loop.in_z else 0)
    every = [(p, times) for p, times in roots(f.den)]
    hidden = [p for p, _ in roots(f.whole_den / f.den)]
    slack = 0.0 if loop.numerator is not None else _NEAR_DC
    _refuse_unstable([p for p in hidden if not _is(p, dc) and _from_dc(p, loop) > slack], loop.in_z)
    unseen = [] if loop.numerator is not None else _unseen(loop, f, every)
    seen = [(p, times) for p, times in every if not any(p is other for other in unseen)]
    _refuse_unstable([p for p, _ in seen if not _is(p, dc)], loop.in_z)
    for p, times in seen:
        if _is(p, dc):
            raise InputError(_INTEGRATES if times == 1 else UNSTABLE)
    return [p for p, times in seen for _ in range(times)], unseen


def _is(p: flint.acb, value: flint.acb) -> bool:
    return bool((p - value).contains(flint.acb(0)))


def _from_dc(p: flint.acb, loop: RationalLoop) -> float:
    """Distance to zero frequency, in a sampling period or over the entries of A."""
    return abs(complex(p) - 1.0) if loop.in_z else abs(complex(p)) / max(float(np.abs(loop.A).max()), 1e-300)


def _refuse_unstable(poles: _Poles, in_z: bool) -> None:
    for p in poles:
        inside = abs(p) < 1 if in_z else p.real < 0  # true only where certain
        if not inside:
            raise InputError(UNSTABLE)


def _unseen(loop: RationalLoop, f: Fraction, every: list[tuple[flint.acb, int]]) -> _Poles:
    """Poles of a state space at zero frequency but for rounding, which the response does not show.

    In exact numbers such a mode is rarely cancelled: its residue is a rounding error.
    """
    near = [p for p, times in every if times == 1 and _from_dc(p, loop) < _NEAR_DC]
    others = [p for p, times in every if not any(p is each for each in near) for _ in range(times)]
    if not near or not others:
        return []
    rates = [-np.log(max(abs(complex(p)), 1e-9)) if loop.in_z else -complex(p).real for p in others]
    slowest = min((rate for rate in rates if rate > 0.0), default=np.inf)
    rest, residues = _without(f, others, near)
    at = flint.acb(1 if loop.in_z else 0)
    size = abs(complex(rest(at) / product(others)(at)))
    return near if all(abs(complex(r)) <= _UNSEEN * slowest * size for r in residues) else []


def _without(f: Fraction, seen: _Poles, unseen: _Poles) -> tuple[flint.acb_poly, list[flint.acb]]:
    """The numerator over the poles that are seen alone, and the residues of the others, which are simple."""
    above, residues = _balls(f.num / f.den[f.den.degree()]), []
    for k, p in enumerate(unseen):
        beside = product([*seen, *unseen[k + 1 :]])
        residues.append(above(p) / beside(p))
        above = _divided(above - residues[-1] * beside, p)
    return above, residues


def _deviation(
    loop: RationalLoop, f: Fraction, poles: _Poles, unseen: _Poles
) -> tuple[float, flint.acb_poly]:
    """H at zero frequency, and (H over that - 1)/(x - dc) times the product of its poles."""
    dc = 1 if loop.in_z else 0
    if unseen:
        above, _ = _without(f, poles, unseen)
        value = above(flint.acb(dc)) / product(poles)(flint.acb(dc))
        final = _checked(float(value.real.mid()), loop)
        return final, _divided(above * (1 / value) - product(poles), flint.acb(dc))
    exact = f.num(dc) / f.den(dc)
    final = _checked(double(exact), loop)
    rest = (f.num / exact - f.den) / flint.fmpq_poly([-dc, 1])
    return final, _balls(rest / f.den[f.den.degree()])


def _balls(p: flint.fmpq_poly) -> flint.acb_poly:
    return flint.acb_poly(flint.arb_poly(p))


def _checked(final: float, loop: RationalLoop) -> float:
    if final == 0.0 or not np.isfinite(final):
        raise InputError(NO_FINAL)
    if abs(final) <= dc_noise(loop):
        raise NumericalError(NO_FINAL.replace("is zero:", "is zero within the rounding of the entries:"))
    return final


def notes(loop: RationalLoop) -> tuple[str, ...]:
    """Say where the last digits of the coefficients decide about the final value."""
    if not loop.in_z or loop.numerator is None or loop.denominator is None:
        return ()
    sums = [(abs(exact_sum(p)), float(np.abs(p).sum())) for p in (loop.numerator, loop.denominator)]
    moved = ULP * _EPS * sum(whole / total for total, whole in sums)
    if moved < 0.01:
        return ()
    return (
        f"{ULP} units in the last place of the coefficients move the final value by {100 * moved:.2g} %: "
        "the figures are those of the coefficients as given; a state space would hold the system better",
    )
