"""Truth for step responses: recursions in exact numbers and partial fractions at high precision."""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import acb, acb_poly, arb, ctx, fmpq_poly
from margin_truth import rationals

_BITS = 700  # binary places of the recursion; what is cut off grows by no more than a few hundred of them
_PRECISION = 300  # bits, of partial fractions


@dataclass(frozen=True)
class Figures:
    """Rise and settling in samples, overshoot in percent."""

    rise: int
    settling: int
    overshoot_percent: float
    last: float  # of the recursion, over the final value


def recursion(num: np.ndarray, den: np.ndarray, count: int) -> tuple[np.ndarray, float]:
    """Step response over its final value by the difference equation, and the final value."""
    n = len(den) - 1
    b = [Fraction(0)] * (n + 1 - len(num)) + [Fraction(float(v)) for v in num]
    a = [Fraction(float(v)) for v in den]
    final = sum(b) / sum(a)
    scaled = [int(v / a[0] * 2**_BITS) for v in a]
    forced = [int(sum(b[: k + 1]) / a[0] / final * 2 ** (2 * _BITS)) for k in range(n + 1)]
    past, out = [0] * n, np.empty(count)
    for k in range(count):
        total = forced[min(k, n)] - sum(scaled[j] * past[j - 1] for j in range(1, n + 1))
        value = total >> _BITS
        past = [value, *past][:n]
        out[k] = value / 2**_BITS
    return out, float(final)


def sampled_figures(y: np.ndarray) -> Figures:
    """Figures of a relative response, by their definitions."""
    outside = np.flatnonzero((y < 0.98) | (y > 1.02))
    over = 100.0 * (float(y.max()) - 1.0)
    rise = int(np.argmax(y >= 0.9)) - int(np.argmax(y >= 0.1))
    return Figures(
        rise, int(outside[-1]) + 1 if outside.size else 0, over if over > 1e-7 else 0.0, float(y[-1])
    )


class Continuous:
    """Relative step response of num/den with simple poles, by partial fractions about certified roots."""

    def __init__(self, num: np.ndarray, den: np.ndarray) -> None:
        above, below = (fmpq_poly(rationals(part[::-1])) for part in (num, den))
        final = above[0] / below[0]
        with ctx.workprec(_PRECISION):
            self.poles = [acb(p) for p, _ in (below * below.denom()).numer().complex_roots()]
            rest, slope = acb_poly(above / final), acb_poly(below.derivative())
            self.weights = [rest(p) / (p * slope(p)) for p in self.poles]

    def __call__(self, t: float) -> float:
        with ctx.workprec(_PRECISION):
            terms = (w * (p * arb(t)).exp() for w, p in zip(self.weights, self.poles, strict=True))
            return float(sum(terms, acb(1)).real.mid())

    def many(self, t: np.ndarray) -> np.ndarray:
        """In double precision, for a look at many times (poles far enough apart)."""
        p, w = (np.array([complex(each) for each in part]) for part in (self.poles, self.weights))
        return 1.0 + (np.exp(np.outer(t, p)) @ w).real


def stable_poles(rng: np.random.Generator, most: int, sampled: bool) -> list[complex]:
    """Poles over decades: near z = 1 (s = 0), lightly damped, and in z negative, at zero, repeated."""
    n, poles = int(rng.integers(1, most + 1)), []
    while len(poles) < n:
        kind = rng.random()
        if kind < 0.4 and len(poles) + 2 <= n:
            w = 10.0 ** rng.uniform(-2, 0.45)
            zeta = min(10.0 ** rng.uniform(-2, 0) * max(1.0, 0.03 / w), 0.999)
            s = w * complex(-zeta, math.sqrt(1.0 - zeta**2))
            poles += [s, s.conjugate()]
        elif kind < 0.75 or not sampled:
            poles.append(complex(-(10.0 ** rng.uniform(-3, -0.3))))
        elif kind < 0.85:
            poles.append(complex(math.log(rng.uniform(0.01, 0.95)), math.pi))
        elif kind < 0.92:
            poles.append(complex(-math.inf))
        elif poles and poles[-1].imag == 0.0:
            poles.append(poles[-1])
    return [np.exp(s) if s.real > -math.inf else 0j for s in poles] if sampled else poles


def zeros(rng: np.random.Generator, most: int, sampled: bool) -> list[complex]:
    """Zeros over decades, some near z = 1 (a tiny gain at zero frequency), some outside."""
    n, result = int(rng.integers(0, most + 1)), []
    while len(result) < n:
        if rng.random() < 0.3 and len(result) + 2 <= n:
            w, zeta = 10.0 ** rng.uniform(-2, 0.45), 10.0 ** rng.uniform(-2, 0) * 0.999
            s = w * complex(-zeta, math.sqrt(1.0 - zeta**2))
            result += [s, s.conjugate()]
        else:
            result.append(complex(-(10.0 ** rng.uniform(-4, 0.3)) * rng.choice([1.0, 1.0, 1.0, -1.0])))
    return [np.exp(s) for s in result] if sampled else result
