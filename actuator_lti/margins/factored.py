"""A rational loop as its factors, and the polish of what they tell by the loop itself."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.margins.axis_search import Factored, half_turn
from actuator_lti.margins.given import unwarped
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.poles import SortedPoles, eigenvalues, polynomial_roots
from actuator_lti.margins.trust import Doubtful

LEAST_SLACK = 1e-8
SAME = 1e-4  # relative: the loop and the product of its factors
_NEARLY_REAL = 1e-12
_SEEN = math.log(1e10)  # of L, to either side of one
_NEWTON_STEPS = 6
_NEWTON_STEP = 1e-9
_ROUNDED = 1e-13  # of gain and phase: no step says more
_FAR, _FAR_ROUNDED = math.log(10.0**1.5), 1e-7  # 30 dB from one, where a steep gain leaves fewer digits
_FAR_OFF = 1e-4  # relative: a crossing of the factors and one of the loop


@dataclass(frozen=True)
class Response:
    """A rational loop behind a delay, on w of the s-plane."""

    loop: RationalLoop  # without the delay
    delay: float = 0.0  # s, or samples

    def x(self, w: Real) -> Real:
        """The argument of the loop."""
        return 2.0 * np.arctan(w) if self.loop.in_z else w

    def frequency(self, w: float) -> float:
        """Angular frequency in rad/s."""
        return unwarped(w, self.loop.period_s)

    def at(self, w: Real) -> Complex:
        """L at w."""
        x = self.x(w)
        return self._late(x, self.loop.response(x))

    def _late(self, x: Real, L: Complex) -> Complex:
        return L * np.exp(-1j * self.delay * self._angle(x)) if self.delay else L

    def _angle(self, x: Real) -> Real:
        return x if self.loop.period_s is None or self.loop.in_z else 2.0 * np.arctan(x)

    def real_point(self, w: float) -> float:
        """L at a real s next to zero."""
        point = np.array([math.exp(2.0 * math.atan(w)) if self.loop.in_z else w], dtype=complex)
        return float(self.loop.at(point)[0].real)

    def at_rest(self) -> complex:
        """L at zero frequency."""
        loop = self.loop
        if loop.coefficients is None or loop.in_z:
            return complex(loop.response(np.zeros(1))[0].real)
        above, below = loop.coefficients[:, -1:].astype(complex)
        return complex((above / below)[0].real)

    def at_end(self) -> complex:
        """L at the end of the axis: at infinity, or at Nyquist with the whole delay."""
        loop = self.loop
        if loop.period_s is None:
            return complex(loop.d)
        end = complex(loop.response(np.array([math.pi]))[0].real) if loop.in_z else complex(loop.d)
        return end * complex(np.exp(-1j * math.pi * self.delay)) if self.delay else end

    def onto_axis(self, end: complex) -> complex:
        """Where L lies on the real axis at the Nyquist frequency; 0 where it does not come to it there.

        Behind part of a sample L jumps there to its conjugate, over the real axis at the mean of both. Where
        L moves away from the axis before that, the crossing that goes with it lies below and is listed.
        """
        if not self.delay:
            return end
        rate = self.rate_at_end()
        return complex(end.real) if end.imag * (end * rate).imag < 0.0 else 0j

    def rate_at_end(self) -> complex:
        """d log L/d angle at the Nyquist frequency."""
        loop = self.loop
        if loop.in_z:
            L, slope = loop.response_and_slope(np.array([math.pi]))
            return complex(slope[0] / L[0]) - 1j * self.delay
        assert loop.coefficients is not None
        above, below = loop.coefficients  # in u = 1/w: x = pi - 2 u, s = j/u
        rate = (above[1] / above[0] - below[1] / below[0]) / 1j if above[0] else math.inf
        return -0.5 * complex(rate) - 1j * self.delay

    def polished(self, w: Real, gain: bool) -> tuple[Real, Complex]:
        """Newton from crossings of the factors to those of the loop; their x, and L there.

        `Doubtful`: the loop has none there, or one where the factors have two, or at the end of the axis.
        """
        if not w.size:
            return w, np.empty(0, dtype=complex)
        loop, start = self.loop, self.x(w)
        x = start
        for _ in range(_NEWTON_STEPS):
            L, slope = loop.response_and_slope(x)
            rate = self._rate(x, slope / L)
            L = self._late(x, L)
            step = _newton_step(L, rate, gain)
            x = x - step
            rounded = np.where(np.abs(np.log(np.abs(L))) > _FAR, _FAR_ROUNDED, _ROUNDED)
            if ((np.abs(step) <= _NEWTON_STEP * x) | (np.abs(step * rate) <= rounded)).all():
                break
        else:
            raise Doubtful("a crossing did not settle")
        L = L * (1.0 - rate * step)
        if loop.in_z:  # near z = 1 the last digits of z are all there is: one more step with them
            L = self._late(x, loop.sharp_response(x))
            step = _newton_step(L, rate, gain)
            x, L = x - step, L * (1.0 - rate * step)
        in_order = (x[1:] > x[:-1]).all() and x[-1] < loop.end
        if not (in_order and (np.abs(x - start) <= _FAR_OFF * start).all()):
            raise Doubtful("a crossing of the factors is none of the loop, or two are one")
        return x, L

    def _rate(self, x: Real, rate: Complex) -> Complex:
        if not self.delay:
            return rate
        turning = 1.0 if self.loop.period_s is None or self.loop.in_z else 2.0 / (1.0 + x * x)
        return rate - 1j * self.delay * turning


def _newton_step(L: Complex, rate: Complex, gain: bool) -> Real:
    if gain:
        return np.asarray(np.log(np.abs(L)) / rate.real)
    return np.asarray(np.arctan2(-L.imag, -L.real) / rate.imag)


def factored(response: Response, poles: SortedPoles) -> Factored:
    """The factors of a loop in the s-plane; `Doubtful` where they do not make it up next to its poles."""
    loop = response.loop
    below = _in_s(loop, _exact_zero(poles, loop.in_z))
    above = _zeros(loop, below)
    roots = np.concatenate((above, below))
    weights = np.concatenate((np.ones(above.size), -np.ones(below.size)))
    with np.errstate(all="ignore"):
        return _fitted(with_delay(roots, weights, response), response, below)


def with_delay(roots: Complex, weights: Real, response: Response) -> Factored:
    """The factors of a response from those of its loop; the constants of gain and phase are left out."""
    delay = response.delay
    if delay and response.loop.period_s is not None:
        roots, weights, delay = np.append(roots, (1.0, -1.0)), np.append(weights, (delay, -delay)), 0.0
    return Factored(roots, weights, delay, slack=LEAST_SLACK)


def _fitted(factors: Factored, response: Response, poles: Complex) -> Factored:
    size = np.abs(poles[poles.imag >= 0.0])
    size = size[size > 0.0]
    w = np.array([0.5, 2.0])
    if size.size:
        w = np.concatenate((size * 1.01, (0.3 * size.min(), 3.0 * size.max())))
    L = response.at(w)
    gain, phase = factors.log_value(w)
    off, level = L * np.exp(-gain - 1j * phase), np.abs(np.log(np.abs(L)))
    k = int(level.argmin())
    off, turned = off[level < _SEEN] / off[k], cmath.phase(off[k])
    turn = half_turn(turned)
    apart = max(float(np.abs(off - 1.0).max(initial=0.0)), abs(turn - turned))
    log_gain = float(np.log(np.abs(L[k]))) - float(gain[k])
    if not off.size or not apart <= SAME or not math.isfinite(log_gain):
        raise Doubtful("poles and zeros in double precision do not make up the loop")
    return Factored(
        factors.roots, factors.weights, factors.delay, log_gain, turn, max(LEAST_SLACK, 10.0 * apart)
    )


def _exact_zero(poles: SortedPoles, in_z: bool) -> Complex:
    """The poles with those at zero frequency put there."""
    values = poles.values.copy()
    centre = 1.0 if in_z else 0.0
    values[np.abs(values - centre).argsort()[: poles.at_dc]] = centre
    return values


def _in_s(loop: RationalLoop, points: Complex) -> Complex:
    if not loop.in_z:
        return points
    points = points[points != -1.0]
    return (points - 1.0) / (points + 1.0)


def _zeros(loop: RationalLoop, poles: Complex) -> Complex:
    """Zeros in the s-plane; those of a state space that lie at infinity come out far away."""
    if loop.coefficients is not None:
        return _in_s(loop, polynomial_roots(loop.coefficients[0]))
    size = np.abs(poles[poles != 0.0])
    shift = 1.083 * math.exp(float(np.log(size).mean())) if size.size else 1.083
    eye = np.eye(loop.order)
    # sigma = 1/(s - shift): L = l - c inverse (sigma - W)^-1 inverse b, whose zeros are plain eigenvalues
    scale = 1.0 - shift if loop.in_z else 1.0
    inverse = np.linalg.inv(scale * loop.A - ((1.0 + shift) if loop.in_z else shift) * eye)
    W, size = (inverse + loop.A @ inverse, 2.0) if loop.in_z else (inverse, 1.0)
    b, c = inverse @ loop.b, loop.c @ inverse
    sigma = eigenvalues(W + np.outer((size / (loop.d - scale * float(loop.c @ b))) * b, c))
    zeros = shift + 1.0 / sigma[sigma != 0.0]
    if loop.in_z or loop.d or zeros.size < loop.order:
        return zeros
    # without feed-through one is at infinity, with its mirror image where two
    farthest = np.abs(zeros).argmax()
    real = abs(zeros[farthest].imag) <= _NEARLY_REAL * abs(zeros[farthest])
    return np.delete(zeros, np.abs(zeros).argsort()[-1 if real else -2 :])
