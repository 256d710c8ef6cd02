"""A rational loop as its factors, and the polish of what they tell by the loop itself."""

import cmath
import math
from dataclasses import replace

import numpy as np

from actuator_lti.margins.axis_search import Factored, half_turn
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.margins.poles import SortedPoles, eigenvalues, polynomial_roots, sorted_poles
from actuator_lti.margins.trust import Doubtful
from actuator_lti.types import Complex, Real

_LEAST_SLACK = 1e-8
SAME = 1e-4  # relative: the loop and the product of its factors
_SEEN = math.log(1e10)  # of L, to either side of one
_NEWTON_STEPS = 6
_NEWTON_STEP, _NEWTON_STEP_ON_L = 1e-9, 1e-6  # relative
_LAST = 4e-16  # of x
_ROUNDED = 1e-13  # of gain and phase: no step says more
_FAR, _FAR_ROUNDED = math.log(10.0**1.5), 1e-7  # 30 dB from one, where a steep gain leaves fewer digits
_FAR_OFF = 1e-4  # relative: a crossing of the factors and one of the loop


def polished(loop: RationalLoop, w: Real, gain: bool) -> tuple[Real, Complex]:
    """Newton from crossings of the factors to those of the loop: their w, and L there.

    `Doubtful`: the loop has none there, or one where the factors have two, or at the end of the axis.
    """
    if not w.size:
        return w, np.empty(0, dtype=complex)
    start = x = loop.x(w)
    for _ in range(_NEWTON_STEPS):
        L, slope = loop.response_and_slope(x)
        rate = loop.late_rate(x, slope / L)
        L = loop.late(x, L)
        step = np.log(np.abs(L)) / rate.real if gain else np.arctan2(-L.imag, -L.real) / rate.imag
        x = x - step
        far = np.where(np.abs(np.log(np.abs(L))) > _FAR, _FAR_ROUNDED, _ROUNDED)
        on_L, on_x = np.abs(step * rate), np.abs(step / x)
        if ((on_x <= _NEWTON_STEP) & (on_L <= _NEWTON_STEP_ON_L) | (on_L <= far) | (on_x <= _LAST)).all():
            break
    else:
        raise Doubtful("a crossing did not settle")
    L = L * (1.0 - rate * step)
    in_order = (x[1:] > x[:-1]).all() and (not loop.in_z or x[-1] < math.pi)
    if not (in_order and (np.abs(x - start) <= _FAR_OFF * start).all()):
        raise Doubtful("a crossing of the factors is none of the loop, or two are one")
    return (np.tan(0.5 * x) if loop.in_z else x), L


def factored(loop: RationalLoop, poles: SortedPoles | None = None) -> Factored:
    """The factors of a loop in the s-plane; `Doubtful` where they do not make it up next to its poles."""
    known = sorted_poles(loop.A, loop.in_z) if poles is None else poles
    values, centre = known.values.copy(), 1.0 if loop.in_z else 0.0
    values[np.abs(values - centre).argsort()[: known.at_dc]] = centre  # exactly
    below = _in_s(loop, values)
    above = _zeros(loop, below)
    roots = np.concatenate((above, below))
    weights = np.concatenate((np.ones(above.size), -np.ones(below.size)))
    with np.errstate(all="ignore"):
        return _fitted(with_delay(roots, weights, loop), loop, roots)


def with_delay(roots: Complex, weights: Real, loop: RationalLoop) -> Factored:
    """The factors of a loop from those without its delay; the constants of gain and phase are left out."""
    delay = loop.delay
    if delay and loop.period_s is not None:
        roots, weights, delay = np.append(roots, (1.0, -1.0)), np.append(weights, (delay, -delay)), 0.0
    return Factored(roots, weights, delay, slack=_LEAST_SLACK)


def _fitted(factors: Factored, loop: RationalLoop, places: Complex) -> Factored:
    """With gain and phase of the loop, which they have to follow beside each pole and zero and beyond."""
    size = np.abs(places[places.imag >= 0.0])
    size = size[size > 0.0]
    w = np.array([0.5, 2.0])
    if size.size:
        w = np.concatenate((size * 1.01, (0.3 * size.min(), 3.0 * size.max())))
    L = loop.at(w)
    gain, phase = factors.log_value(w)
    off, level = L * np.exp(-gain - 1j * phase), np.abs(np.log(np.abs(L)))
    k = int(level.argmin())
    off, turned = off[level < _SEEN] / off[k], cmath.phase(off[k])
    turn = half_turn(turned)
    apart = max(float(np.abs(off - 1.0).max(initial=0.0)), abs(turn - turned))
    log_gain = float(np.log(np.abs(L[k]))) - float(gain[k])
    if not off.size or not apart <= SAME or not math.isfinite(log_gain):
        raise Doubtful("poles and zeros in double precision do not make up the loop")
    return replace(factors, log_gain=log_gain, phase=turn, slack=max(_LEAST_SLACK, 10.0 * apart))


def _in_s(loop: RationalLoop, points: Complex) -> Complex:
    if not loop.in_z:
        return points
    points = points[points != -1.0]
    return (points - 1.0) / (points + 1.0)


def _zeros(loop: RationalLoop, poles: Complex) -> Complex:
    """Zeros in the s-plane; of a state space in z those at infinity too, at s = 1."""
    if loop.coefficients is not None:
        return _in_s(loop, polynomial_roots(loop.coefficients[0]))
    A, b, c, d, at_infinity = _without_infinite_zeros(loop)
    size = np.abs(poles[poles != 0.0])
    shift = 1.083 * math.exp(float(np.log(size).mean())) if size.size else 1.083
    # sigma = 1/(s - shift): L = l - c inverse (sigma - W)^-1 inverse b, whose zeros are plain eigenvalues
    scale = 1.0 - shift if loop.in_z else 1.0
    inverse = np.linalg.inv(scale * A - ((1.0 + shift) if loop.in_z else shift) * np.eye(b.size))
    W, size = (inverse + A @ inverse, 2.0) if loop.in_z else (inverse, 1.0)
    there, b, c = d - scale * float(c @ inverse @ b), inverse @ b, c @ inverse
    if not there:
        raise Doubtful("the loop is zero where its zeros are looked for from")
    sigma = eigenvalues(W + np.outer((size / there) * b, c))
    zeros = shift + 1.0 / sigma[sigma != 0.0]
    return np.append(zeros, np.ones(at_infinity)) if loop.in_z else zeros


def _without_infinite_zeros(loop: RationalLoop) -> tuple[Real, Real, Real, float, int]:
    """A, b, c, d with the finite zeros of a state space and a feed-through d; how many are at infinity.

    Without d the output is zero only while c x = 0. A reflection of the states that c holds (the others stay,
    so a zero entry stays one) makes c x one state; it goes, and its rate is the output in place of it
    (Emami-Naeini, Van Dooren, Computation of zeros of linear multivariable systems, Automatica 18, 1982).
    """
    A, b, c, d, count = loop.A, loop.b, loop.c, loop.d, 0
    while not d:
        if not (held := c.nonzero()[0]).size:
            raise Doubtful("nothing passes through the loop")
        k = int(np.abs(c[held]).argmax())
        v, size = c[held], float(np.copysign(np.linalg.norm(c), c[held[k]]))
        v[k] += size
        v *= math.sqrt(2.0) / np.linalg.norm(v)
        A, b = A.copy(), b.copy()
        A[held] -= np.outer(v, v @ A[held])
        A[:, held] -= np.outer(A[:, held] @ v, v)
        b[held] -= v * float(v @ b[held])
        gone, rest = held[k], np.arange(b.size) != held[k]
        c, d = -size * A[gone, rest], -size * float(b[gone])
        A, b, count = A[np.ix_(rest, rest)], b[rest], count + 1
    return A, b, c, d, count
