"""Step response of a rational system as a sum of exponentials with certified poles and weights.

The doubles of the system are taken as the rational numbers that they are: the transfer function follows
exactly, its roots are isolated with certified balls, and their residues are computed in as many digits as
the sum of the exponentials needs. Companion matrices, clusters of poles near z = 1 and resonances far above
the gain at zero frequency cost digits, which are then taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import flint
import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.exact_fraction import Fraction, dc_noise, double, exact_fraction, exact_sum, roots
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.step_terms import Term

_EPS = float(np.finfo(float).eps)
_NEAR_DC = 1e-7  # a pole this near to zero frequency may be one that the response does not show
_UNSEEN = 1e-9  # what it may move, of the final value, before the rest has settled
_FIRST_BITS = 128
_MOST_BITS = 16384
_SPARE_BITS = 80
_UNSTABLE = "the system is not stable: it has no step figures"
_INTEGRATES = "the system integrates: its step response has no final value"

_Pole = tuple[flint.acb, list[flint.acb]]  # a pole and the residues of H there


@dataclass(frozen=True)
class ExactResponse:
    """Unit step response, y(t) = final + sum of terms; time in s, or in samples.

    Attributes
    ----------
    terms : tuple of Term
        Exponentials times polynomials; all decay.
    final : float
        Limit of the response.
    first : array (m,)
        Sampled systems: the first samples, before the terms of poles at (or about) z = 0 have died out.
    bits : int
        Working precision in which the terms hold what double precision asks for.
    notes : tuple of str
        What the data leave open.
    """

    terms: tuple[Term, ...]
    final: float
    first: np.ndarray
    bits: int
    notes: tuple[str, ...] = ()


def exact_response(system: Any, loop: RationalLoop) -> ExactResponse:
    """Find the exact step response of a stable rational system.

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
    dc = flint.fmpq(1 if loop.in_z else 0)
    bits = _FIRST_BITS
    while bits <= _MOST_BITS:
        with flint.ctx.workprec(bits):
            result = _at_precision(loop, fraction, dc, bits)
        if isinstance(result, ExactResponse):
            return result
        bits = max(2 * bits, result)
    raise NumericalError("the poles of the step response lie too close together to be told apart")


def _at_precision(loop: RationalLoop, f: Fraction, dc: flint.fmpq, bits: int) -> ExactResponse | int:
    """The response, or the number of bits that it needs."""
    slack = 0.0 if loop.numerator is not None else _NEAR_DC
    hidden = [p for p, _ in roots(f.whole_den / f.den)]
    _refuse_unstable([p for p in hidden if not _is(p, dc) and _from_dc(p, loop) > slack], loop.in_z)
    poles = [(p, _residues(f, p, m)) for p, m in roots(f.den)]
    unseen = [] if loop.numerator is not None else _unseen(poles, loop)
    seen = [pole for k, pole in enumerate(poles) if k not in unseen]
    _refuse_unstable([p for p, _ in seen if not _is(p, dc)], loop.in_z)
    for p, residues in seen:
        if _is(p, dc):
            raise InputError(_INTEGRATES if len(residues) == 1 else _UNSTABLE)
    final = _final(loop, f, dc, seen, not unseen)
    make = _sampled_term if loop.in_z else _continuous_term
    lasting = [pole for pole in seen if not (loop.in_z and _is(pole[0], flint.fmpq(0)))]
    terms = tuple(make(p, residues) for p, residues in lasting)
    count = f.den.degree() + 2 if loop.in_z else 0
    needed = _SPARE_BITS + max((term.bits_above(abs(final), float(count)) for term in terms), default=0)
    if needed > bits or any(term.uncertain for term in terms):
        return needed
    first = _first_samples(f, count) if count else np.empty(0)
    return ExactResponse(terms, final, first, bits, _notes(loop))


def _is(p: flint.acb, value: flint.fmpq) -> bool:
    return bool((p - flint.acb(value)).contains(flint.acb(0)))


def _from_dc(p: flint.acb, loop: RationalLoop) -> float:
    """Distance to zero frequency, in a sampling period or over the entries of A."""
    return abs(complex(p) - 1.0) if loop.in_z else abs(complex(p)) / max(float(np.abs(loop.A).max()), 1e-300)


def _refuse_unstable(roots: list[flint.acb], in_z: bool) -> None:
    for p in roots:
        inside = abs(p) < 1 if in_z else p.real < 0  # true only where certain
        if not inside:
            raise InputError(_UNSTABLE)


def _residues(f: Fraction, p: flint.acb, m: int) -> list[flint.acb]:
    """H about the pole p of multiplicity m: coefficients of 1/(x - p), 1/(x - p)^2, ..."""
    if m == 1:
        return [_at(f.num, p) / _at(f.den.derivative(), p)]
    shift = flint.acb_poly([p, 1])
    above = flint.acb_poly(flint.arb_poly(f.num))(shift).coeffs()[:m]
    below = flint.acb_poly(flint.arb_poly(f.den))(shift).coeffs()[m : 2 * m]
    above += [flint.acb(0)] * (m - len(above))
    below += [flint.acb(0)] * (m - len(below))
    series: list[flint.acb] = []
    for k in range(m):
        rest = above[k] - sum((below[j] * series[k - j] for j in range(1, k + 1)), flint.acb(0))
        series.append(rest / below[0])
    return series[::-1]


def _at(p: flint.fmpq_poly, x: flint.acb) -> flint.acb:
    return flint.acb_poly(flint.arb_poly(p))(x)


def _unseen(poles: list[_Pole], loop: RationalLoop) -> list[int]:
    """Poles of a state space at zero frequency but for rounding, which the response does not show.

    In exact numbers such a mode is rarely cancelled: its residue is a rounding error.
    """
    near = [k for k, (p, r) in enumerate(poles) if len(r) == 1 and _from_dc(p, loop) < _NEAR_DC]
    others = [(complex(p), [complex(r) for r in rs]) for k, (p, rs) in enumerate(poles) if k not in near]
    if not near or not others:
        return []
    rates = [-np.log(max(abs(p), 1e-9)) if loop.in_z else -p.real for p, _ in others]
    slowest = min((rate for rate in rates if rate > 0.0), default=np.inf)
    x = 1.0 if loop.in_z else 0.0
    size = abs(loop.d + sum(r / (x - p) ** (j + 1) for p, rs in others for j, r in enumerate(rs)))
    return [k for k in near if abs(complex(poles[k][1][0])) <= _UNSEEN * slowest * size]


def _final(loop: RationalLoop, f: Fraction, dc: flint.fmpq, seen: list[_Pole], whole: bool) -> float:
    """H at zero frequency; where poles are left out, by the partial fractions of the others."""
    if whole:
        final = double(f.num(dc) / f.den(dc))
    else:
        n = f.den.degree()
        total = flint.acb(f.num[n] / f.den[n])
        for p, residues in seen:
            total += sum((r / (flint.acb(dc) - p) ** (j + 1) for j, r in enumerate(residues)), flint.acb(0))
        final = float(total.real.mid())
    if final == 0.0 or not np.isfinite(final):
        raise InputError(
            "the final value of the step response is zero: it has no rise, overshoot or settling"
        )
    if abs(final) <= dc_noise(loop):
        raise NumericalError(
            "the final value of the step response is zero within the rounding of the entries: "
            "it has no rise, overshoot or settling"
        )
    return final


def _continuous_term(p: flint.acb, residues: list[flint.acb]) -> Term:
    """Residues of H(s)/s at p: those of H times the series of 1/s about p."""
    out = []
    for j in range(len(residues)):
        total = flint.acb(0)
        for k in range(j, len(residues)):  # 1/s = sum (-1)^l (s - p)^l / p^(l+1)
            total += residues[k] * (-1) ** (k - j) / p ** (k - j + 1)
        out.append(total)
    return Term.of(p, out)


def _sampled_term(p: flint.acb, residues: list[flint.acb]) -> Term:
    """Samples of H(z) z/(z - 1) from p, as polynomial in k times exp(k log p)."""
    steps = []
    for j in range(len(residues)):  # residues of H/(z - 1), then times z: k-th sample of 1/(z - p)^l
        total = flint.acb(0)
        for k in range(j, len(residues)):
            total += residues[k] * (-1) ** (k - j) / (p - 1) ** (k - j + 1)
        steps.append(total)
    poly = flint.acb_poly([0])
    binomial = flint.acb_poly([1])
    for j, value in enumerate(steps):  # the k-th sample of z/(z - p)^(j + 1) is binomial(k, j) p^(k - j)
        if j:
            binomial = binomial * flint.acb_poly([1 - j, 1]) * (flint.acb(1) / j)
        poly += binomial * (value / p**j)
    coefficients = poly.coeffs() + [flint.acb(0)] * (len(residues) - len(poly.coeffs()))
    factorial, out = 1, []
    for j, value in enumerate(coefficients[: len(residues)]):
        factorial *= max(j, 1)
        out.append(value * factorial)
    return Term.of(_logarithm(p), out)


def _logarithm(p: flint.acb) -> flint.acb:
    """log p with its cut on the positive imaginary side of a negative axis that poles may straddle."""
    if float(p.real.mid()) < 0.0 and abs(float(p.imag.mid())) < -0.3 * float(p.real.mid()):
        return (-p).log() + flint.acb(0, flint.arb.pi())
    return p.log()


def _first_samples(f: Fraction, count: int) -> np.ndarray:
    n = f.den.degree()
    num = [f.num[n - k] for k in range(n + 1)]
    den = [f.den[n - k] for k in range(n + 1)]
    y: list[flint.fmpq] = []
    forced = flint.fmpq(0)
    for k in range(count):
        if k <= n:
            forced += num[k]
        past = sum((den[j] * y[k - j] for j in range(1, min(k, n) + 1)), flint.fmpq(0))
        y.append((forced - past) / den[0])
    return np.array([double(v) for v in y])


def _notes(loop: RationalLoop) -> tuple[str, ...]:
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
