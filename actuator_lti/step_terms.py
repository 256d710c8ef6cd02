"""Sums of decaying exponentials times polynomials: their values, and bounds between any two times."""

from __future__ import annotations

import math
from dataclasses import dataclass

import flint
import numpy as np

from actuator_lti.margins.loop import Complex, Real

_EPS = float(np.finfo(float).eps)
_ACCURACY = 3e-13  # of the final value, or of the response where that is larger
_SURE_BITS = 60
_UNRESOLVED = 1.0  # poles nearer than this many decay rates are bounded together


@dataclass(frozen=True)
class Term:
    """Sum over j of coefficients[j] t^j/j! exp(pole t), in certified balls.

    Attributes
    ----------
    pole : acb
        In the s-plane, or the logarithm of a pole in the z-plane (t then counts samples).
    coefficients : tuple of acb
        One for each of its multiplicity.
    """

    pole: flint.acb
    coefficients: tuple[flint.acb, ...]

    @classmethod
    def of(cls, pole: flint.acb, coefficients: list[flint.acb]) -> Term:
        """From lists."""
        return cls(pole, tuple(coefficients))

    @property
    def uncertain(self) -> bool:
        """Whether the balls are too wide for double precision."""
        largest = max(_log2(c) for c in self.coefficients)
        radius = max(_log2_radius(c) for c in self.coefficients)
        return radius > largest - _SURE_BITS or _log2_radius(self.pole) > _log2(self.pole) - _SURE_BITS

    def derivative(self) -> Term:
        """Its derivative by time."""
        c = (*self.coefficients, flint.acb(0))
        return Term(self.pole, tuple(self.pole * c[j] + c[j + 1] for j in range(len(self.coefficients))))

    def bits_above(self, level: float, start: float) -> int:
        """How many bits of it lie above a level at the start, or later."""
        decay = -complex(self.pole).real
        bits = []
        for j, value in enumerate(self.coefficients):
            t = max(start, j / decay)
            grown = (j * math.log(t) if j else 0.0) - math.lgamma(j + 1) - decay * t
            bits.append(_log2(value) + grown / math.log(2.0))
        return int(max(max(bits) - math.log2(level), 0.0)) + 1


def _log2(value: flint.acb) -> float:
    size = abs(value).abs_upper()
    return _log2_of(size)


def _log2_radius(value: flint.acb) -> float:
    return max(_log2_of(value.real.rad()), _log2_of(value.imag.rad()))


def _log2_of(size: flint.arb) -> float:
    mantissa, exponent = size.mid().man_exp()
    return -1e9 if mantissa == 0 else math.log2(int(abs(mantissa))) + int(exponent)


@dataclass(frozen=True)
class _Bounds:
    """Rows of |a_j| |f_j|, f_j the divided difference of exp(pole t) over the first j nodes of a cluster.

    |f_j(t)| <= t^(j-1)/(j-1)! exp(-decay t) (Hermite, Genocchi), and f_j' = node_j f_j + f_(j-1).
    """

    log_size: Real
    power: Real
    decay: Real
    node: Real  # |node_j|
    pair: Real  # |node_j + node_(j-1)|, 0 for j = 1

    def over(self, a: Real, b: Real) -> tuple[Real, Real]:
        """Upper bounds of the sum and of its second derivative over intervals [a, b], shape (m,)."""
        log_b = np.log(np.maximum(b, 1e-300))
        bare = self.log_size[:, None] - self.decay[:, None] * a
        F = [np.exp(np.minimum(bare + self._grown(log_b, k), 700.0)) for k in range(3)]
        value = F[0].sum(axis=0)
        second = (self.node[:, None] ** 2 * F[0] + self.pair[:, None] * F[1] + F[2]).sum(axis=0)
        return value, second

    def _grown(self, log_b: Real, lower: int) -> Real:
        """log of t^q/q! with q = power - lower; minus infinity for q < 0."""
        q = self.power - lower
        log_factorial = np.array([math.lgamma(max(k, 0.0) + 1.0) for k in q])
        return np.where((q >= 0.0)[:, None], q[:, None] * log_b - log_factorial[:, None], -np.inf)


class Exponentials:
    """Relative response 1 + sum(terms)/final, in double precision where that holds, in balls elsewhere.

    Parameters
    ----------
    terms : tuple of Term
    final : float
        Not zero.
    bits : int
        Working precision of the balls.
    """

    def __init__(self, terms: tuple[Term, ...], final: float, bits: int) -> None:
        self._terms, self._final, self._bits = terms, final, bits
        rows = [(t.pole, j, c) for t in terms for j, c in enumerate(t.coefficients)]
        self._pole = np.array([complex(p) for p, _, _ in rows])
        self._power = np.array([j for _, j, _ in rows], dtype=float)
        self._log_weight = np.array([_log2(c) * math.log(2.0) for _, _, c in rows]) - math.log(abs(final))
        self._turn = np.array([_angle(c) for _, _, c in rows]) + (0.0 if final > 0.0 else math.pi)
        self._log_factorial = np.array([math.lgamma(j + 1.0) for j in self._power])
        with flint.ctx.workprec(bits):
            self._bounds = [
                _bounds([[t] for t in terms], final), _bounds(_clusters(terms), final)
            ]  # fmt: skip

    @property
    def empty(self) -> bool:
        """Whether the response is its final value from the start."""
        return not self._terms

    @property
    def slowest(self) -> float:
        """Smallest decay rate."""
        return float((-self._pole.real).min())

    @property
    def fastest(self) -> float:
        """Largest pole."""
        return float(np.abs(self._pole).max())

    @property
    def most_repeated(self) -> int:
        """Length of the longest cluster."""
        return int(max(bounds.power.max() for bounds in self._bounds)) + 1

    def values(self, t: Real) -> Real:
        """Response over the final value at the times given, shape (m,)."""
        log_t = np.log(np.maximum(t, 1e-300))
        grown = np.where(self._power > 0, self._power * log_t[:, None], 0.0) - self._log_factorial
        exponent = self._log_weight + grown + self._pole.real * t[:, None]
        size = np.exp(np.minimum(exponent, 700.0))
        parts = size * np.cos(self._turn + self._pole.imag * t[:, None])
        y = 1.0 + parts.sum(axis=1)
        error = _EPS * (size * (4.0 + np.abs(self._pole) * t[:, None])).sum(axis=1)
        bad = np.flatnonzero(~(error <= _ACCURACY * np.maximum(np.abs(y), 1.0)))
        if bad.size:
            with flint.ctx.workprec(self._bits):
                for k in bad.tolist():
                    y[k] = self._ball(float(t[k]))
        return y

    def _ball(self, t: float) -> float:
        at = flint.arb(t)
        total = sum((_term_ball(term, at) for term in self._terms), flint.acb(self._final))
        return float((total.real / flint.arb(self._final)).mid())

    def top(self, t: float) -> float:
        """The stationary point next to t, by Newton on the derivative; t itself where there is none near."""
        start = t
        for _ in range(4):
            with flint.ctx.workprec(self._bits):
                slope, bend = self._derivatives(t)
            if bend >= 0.0 or abs(slope / bend) > 1e-3 * start:
                return start
            t -= slope / bend
        return t

    def _derivatives(self, t: float) -> tuple[float, float]:
        """First and second derivative over the final value."""
        out = []
        terms = self._terms
        for _ in range(2):
            terms = tuple(term.derivative() for term in terms)
            total = sum((_term_ball(term, flint.arb(t)) for term in terms), flint.acb(0))
            out.append(float((total.real / flint.arb(self._final)).mid()))
        return out[0], out[1]

    def bounds(self, a: Real, b: Real) -> tuple[Real, Real]:
        """Upper bounds of |y - 1| and of |y''| over intervals."""
        one, other = (bounds.over(a, b) for bounds in self._bounds)
        return np.minimum(one[0], other[0]), np.minimum(one[1], other[1])

    def horizon(self, level: float, start: float) -> float:
        """A time after which |y - 1| stays below a level."""
        low = max(start, (self.most_repeated - 1) / self.slowest)
        high = max(2.0 * low, start + 1.0 / self.slowest)
        while self._beyond(high) > level:
            high *= 2.0
        if self._beyond(low) <= level:
            return low
        while high > low * 1.001:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._beyond(middle) > level else (low, middle)
        return high

    def _beyond(self, t: float) -> float:
        at = np.array([t])
        return float(self.bounds(at, at)[0][0])


def _term_ball(term: Term, t: flint.arb) -> flint.acb:
    poly, power = flint.acb(0), flint.arb(1)
    for j, value in enumerate(term.coefficients):
        power = power * t / j if j else power
        poly += value * power
    return poly * (term.pole * t).exp()


def _angle(c: flint.acb) -> float:
    return float(c.arg().mid())


def _clusters(terms: tuple[Term, ...]) -> list[list[Term]]:
    """Terms whose poles lie nearer than their decay rate, linked one by one."""
    poles = np.array([complex(t.pole) for t in terms], dtype=complex)
    label = np.arange(poles.size)
    for i in range(poles.size):
        near = np.abs(poles - poles[i]) <= _UNRESOLVED * np.maximum(-poles.real, -poles[i].real)
        label[np.isin(label, label[near])] = label[i]
    return [[terms[k] for k in np.flatnonzero(label == each)] for each in np.unique(label)]


def _bounds(clusters: list[list[Term]], final: float) -> _Bounds:
    rows: list[tuple[float, float, float, float, float]] = []
    for cluster in clusters:
        nodes, sizes = _newton_form(cluster)
        q = np.array([complex(node) for node in nodes])
        pair: Complex = np.concatenate(([0.0], q[1:] + q[:-1]))
        decay = float((-q.real).min())
        for j, size in enumerate(sizes):
            log_size = _log2(size) * math.log(2.0) - math.log(abs(final))
            rows.append((log_size, float(j), decay, float(abs(q[j])), float(abs(pair[j]))))
    table = np.array(rows, dtype=float).reshape(-1, 5).T
    return _Bounds(*table)


def _newton_form(cluster: list[Term]) -> tuple[list[flint.acb], list[flint.acb]]:
    """Nodes q and a with sum_j a_j / ((s - q_1) ... (s - q_j)) equal to the cluster's partial fractions."""
    nodes = [t.pole for t in cluster for _ in t.coefficients]
    if len(cluster) == 1:
        return nodes, list(cluster[0].coefficients)
    total = flint.acb_poly([0])
    for k, term in enumerate(cluster):
        others = flint.acb_poly([1])
        for i, other in enumerate(cluster):
            if i != k:
                others *= flint.acb_poly([-other.pole, 1]) ** len(other.coefficients)
        own, factor = flint.acb_poly([0]), flint.acb_poly([1])
        for value in reversed(term.coefficients):  # b_m + b_(m-1) (s - p) + ...
            own += factor * value
            factor *= flint.acb_poly([-term.pole, 1])
        total += own * others
    rest = total.coeffs() + [flint.acb(0)] * (len(nodes) - len(total.coeffs()))
    sizes: list[flint.acb] = []
    for node in reversed(nodes):
        quotient = [rest[-1]]
        for value in reversed(rest[:-1]):  # synthetic division by s - node
            quotient.append(value + node * quotient[-1])
        sizes.append(quotient.pop())
        rest = quotient[::-1]
    return nodes, sizes[::-1]
