"""What a step response still lacks of its final value, as the free motion of a cascade of all-pass sections.

Every stable motion is a sum of orthonormal functions of its poles (Takenaka, Malmquist), which are the free
motions of such a cascade: x' = A x, e = c x, A upper triangular with A + A* + c* c = 0 (sampled:
A* A + c* c = 1). exp(A t) is a contraction, so poles that lie together, repeat or stand at z = 0 cost no
digit. Over spans of time that are halved, bounds of e and of its second derivative say where it may pass a
level; what remains is one sample, or a few terms of a power series.

Of a rational system the transfer function follows exactly from its doubles, its roots are isolated in
certified balls, and the coordinates of the motion are computed in as many digits as they need.

Heuberger, Van den Hof, Wahlberg, Modelling and Identification with Rational Orthogonal Basis Functions, 2005.
"""

from collections.abc import Callable
from typing import Any

import flint
import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.exact.roots import at_enough_bits
from actuator_lti.margins.given import ULP
from actuator_lti.margins.loop import RationalLoop
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
from actuator_lti.types import Complex, Mask, Real

OVER = 1e-9  # an excess below this part of the final value is no overshoot
_TIE = 1e-12  # a sample this near to a level has reached it, and this near to the band is inside
_FINE = 512.0  # parts of the shortest time constant: a span that its power series covers
_TERMS = 8
_LEVELS = 60
_BITS = 160  # of the transitions
_VANISHED = 1e-100  # what is smaller would only slow the processor down
_MOST = 200_000  # spans of one length
_EPS = float(np.finfo(float).eps)
_FIRST_BITS = 192
_SURE_BITS = 60
UNSTABLE = "the system is not stable: it has no step figures"
NO_FINAL = "the final value of the step response is zero: it has no rise, overshoot or settling"
_INTEGRATES = "the system integrates: its step response has no final value"
_Poles = list[flint.acb]  # each as often as it is repeated
Undecided = Callable[[Real, Real, Real, Real, Real], Mask]
Spans = list[tuple[float, float, Real]]  # begin, length, power series of the part of it
_LONG = "the step response rings for too long: what it settles to is known, when is not"


class Motion:
    """Deviation e(t) from the final value, relative to it; t in s, or in samples.

    The real part of ``output`` times the free motion of ``A``, upper triangular with stable poles and, but
    for diagonal ones, a contraction, from the ``state`` at the time ``start`` on.
    """

    def __init__(self, A: flint.acb_mat, output: Any, state: Any, sampled: bool, start: float = 0.0) -> None:
        self.sampled, self.start, self.tie = sampled, start, _TIE if sampled else 0.0
        self._x, self._c = (np.array([complex(each) for each in part]) for part in (state, output))
        self._A, n = _doubles(A), len(self._x)
        size = float(np.linalg.norm(self._A, 2)) if n and not sampled else 0.0
        self.shortest = 2.0 ** -np.ceil(np.log2(_FINE * size)) if size else 1.0
        turned = self._A - np.eye(n) if sampled else self._A
        # rows that bound abs(e) over a span, and how far e leaves its chord there, from abs(x) at its start
        rows = np.abs([self._c, 0.125 * self.shortest**2 * (self._c @ turned @ turned)])
        after = np.abs(self._A) if sampled else np.eye(n) + 2.0 * self.shortest * np.abs(np.triu(self._A, 1))
        self._bounds = [np.maximum(rows, rows @ after)]
        self._moves = self._levels(A)
        for move in self._moves[:-1]:
            rows = self._bounds[-1]
            self._bounds.append(np.maximum(rows, rows @ np.abs(move)) * [[1.0], [4.0]])

    def _levels(self, exact: flint.acb_mat) -> list[Complex]:
        """Transitions over 1, 2, 4 ... shortest spans, until nothing is left that counts."""
        with flint.ctx.workprec(_BITS):  # a rounding of the first is doubled each time
            move = exact if self.sampled or not self._x.size else (exact * flint.arb(self.shortest)).exp()
            moves = [_doubles(move)]
            while np.linalg.norm(self._c) * np.linalg.norm(moves[-1] @ self._x) > OVER:
                if len(moves) == _LEVELS:
                    raise NumericalError(_LONG)
                move = move * move
                moves.append(_doubles(move))
        return moves

    @property
    def slowest(self) -> float:
        """Smallest decay rate; infinity where there is no motion."""
        poles = np.diagonal(self._A)
        return float((1.0 - np.abs(poles) if self.sampled else -poles.real).min(initial=np.inf))

    def curve(self, end: float, count: int) -> tuple[Real, Real]:
        """Times from the start on to ``end``, at most twice ``count`` and evenly apart, and e there."""
        spans = (end - self.start) / self.shortest
        level = int(np.clip(np.floor(np.log2(max(spans / count, 1.0))), 0, len(self._moves) - 1))
        step, move, x = self.shortest * 2.0**level, self._moves[level], self._x[None]
        points = int(np.ceil(spans / 2.0**level)) + 1
        while len(x) < points:
            x, move = np.concatenate((x, x @ move.T)), _flushed(move @ move)
        return self.start + step * np.arange(points), (x[:points] @ self._c).real

    def spans(self, undecided: Undecided, of: Callable[[Real], Real]) -> Spans:
        """Halve all of time; a span stays where ``undecided(a, b, of(e(a)), of(e(b)), most of of(e))``.

        Returns the shortest spans that stay, and e over them.
        """
        a, x = np.zeros(1), self._x[None]
        for level in reversed(range(len(self._moves))):
            span, move = self.shortest * 2.0**level, self._moves[level]
            if level + 1 < len(self._moves):
                a, x = np.concatenate((a, a + span)), np.concatenate((x, x @ move.T))
            left, right = of((x @ self._c).real), of((x @ (self._c @ move)).real)
            size, bend = (np.abs(x) @ row for row in self._bounds[level])
            most = np.minimum(size, np.maximum(left, right) + bend)
            keep = undecided(self.start + a, self.start + a + span, left, right, most)
            a, x = a[keep], x[keep]
            if not a.size:
                return []
            if a.size > _MOST:
                raise NumericalError(_LONG)
        if self.sampled:
            return []
        return [(t, self.shortest, series) for t, series in zip(self.start + a, self._series(x), strict=True)]

    def _series(self, x: Complex) -> Real:
        """Coefficients of e over one shortest span, highest power first; shape (m, terms)."""
        rows, factor = [], self._c
        for k in range(_TERMS):
            rows.append((x @ factor).real)
            factor = factor @ self._A * (self.shortest / (k + 1.0))
        return np.array(rows[::-1]).T


def _doubles(exact: flint.acb_mat) -> Complex:
    n = exact.nrows()
    out = np.zeros((n, n), dtype=complex)
    for i in range(n):
        for j in range(i, n):
            out[i, j] = complex(exact[i, j])
    return _flushed(out)


def _flushed(move: Complex) -> Complex:
    return np.where(np.abs(move) < _VANISHED, 0.0, move)


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
        return _free_motion(balls(rest / f.den[f.den.degree()]), poles, loop.in_z)

    return at_enough_bits(motion, _FIRST_BITS, "a pole of the step response"), double(f.num(dc) / f.den(dc))


def _free_motion(rest: flint.acb_poly, poles: _Poles, sampled: bool) -> Motion | None:
    """The motion with the transform rest/(product of x - pole); ``None``: more digits are needed.

    Sampled: e_0 + e_1/z + ... is z times that. The fastest pole first, which alone its function has.
    """
    poles = sorted(poles, key=lambda p: -abs(complex(p)) if sampled else -complex(p).real)
    mirrored = [flint.acb_poly([1])]
    for p in poles:
        q = p.conjugate()
        mirrored.append(mirrored[-1] * flint.acb_poly([1, -q] if sampled else [q, 1]))
    state: _Poles = [flint.acb(0)] * len(poles)
    for j in reversed(range(len(poles))):
        gain = _gain_of(poles[j], sampled)
        state[j] = rest(poles[j]) / (gain * mirrored[j](poles[j]))
        rest = divided(rest - state[j] * gain * mirrored[j], poles[j])
        if not _sharp(state[j] * gain, 1.0) or not _sharp(poles[j], abs(complex(poles[j]))):
            return None
    return _cascade(poles, state, sampled)


def _cascade(poles: _Poles, state: _Poles, sampled: bool) -> Motion:
    """The motion of all-pass sections, each driven by the output of those after it."""
    n = len(poles)
    A, output = flint.acb_mat(n, n), [flint.acb(0)] * n
    for i in reversed(range(n)):
        p, gain = poles[i], _gain_of(poles[i], sampled)
        for k in range(i + 1, n):
            A[i, k] = gain * output[k] if sampled else -gain * output[k]
        A[i, i] = p
        if sampled:
            output = [-p.conjugate() * y for y in output]
        output[i] = gain
    return Motion(A, output, state, sampled)


def _gain_of(p: flint.acb, sampled: bool) -> flint.acb:
    """The output gain of one section: what makes its free motion of energy 1."""
    return flint.acb((1 - abs(p) ** 2).sqrt() if sampled else (-2 * p.real).sqrt())


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
