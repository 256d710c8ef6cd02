"""What a step response still lacks of its final value, as the free motion of a cascade of all-pass sections.

Every stable motion is a sum of orthonormal functions of its poles (Takenaka, Malmquist), which are the free
motions of such a cascade: x' = A x, e = c x, A upper triangular with A + A* + c* c = 0 (sampled:
A* A + c* c = 1). exp(A t) is a contraction, so poles that lie together, repeat or stand at z = 0 cost no
digit. Over spans of time that are halved, bounds of e and of its second derivative say where it may pass a
level; what remains is one sample, or a few terms of a power series.

Heuberger, Van den Hof, Wahlberg, Modelling and Identification with Rational Orthogonal Basis Functions, 2005.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import flint
import numpy as np

from actuator_lti.errors import NumericalError
from actuator_lti.margins.loop import Complex, Mask, Real

OVER = 1e-9  # an excess below this part of the final value is no overshoot
_TIE = 1e-12  # a sample this near to a level has reached it, and this near to the band is inside
_FINE = 512.0  # parts of the shortest time constant: a span that its power series covers
_TERMS = 8
_LEVELS = 60
_BITS = 160  # of the transitions
_VANISHED = 1e-100  # what is smaller would only slow the processor down
_MOST = 200_000  # spans of one length
Undecided = Callable[[Real, Real, Real, Real, Real], Mask]
Spans = list[tuple[float, Real]]
_LONG = "the step response rings for too long: what it settles to is known, when is not"


class Motion:
    """Deviation e(t) from the final value, relative to it; t in s, or in samples.

    Of stable poles, the slowest first, and the state at the time ``start``.
    """

    def __init__(
        self, poles: Sequence[flint.acb], state: Sequence[flint.acb], sampled: bool, start: float = 0.0
    ) -> None:
        self.sampled, self.start = sampled, start
        self._x = np.array([complex(each) for each in state], dtype=complex)
        exact, output = _cascade(poles, sampled)
        self._A, self._c = _doubles(exact), np.array([complex(each) for each in output], dtype=complex)
        rates = [1 - abs(each) if sampled else -each.real for each in poles]
        self._decay = np.array([float(rate.mid()) for rate in rates], dtype=float)
        self.tie = _TIE if sampled else 0.0
        size = float(np.linalg.norm(self._A, 2)) if poles and not sampled else 0.0
        self.shortest = 2.0 ** -np.ceil(np.log2(_FINE * size)) if size else 1.0
        turned = self._A - np.eye(len(poles)) if sampled else self._A
        self._second = np.abs(self._c @ turned @ turned)
        self._moves = self._levels(exact)

    def _levels(self, exact: flint.acb_mat) -> list[Complex]:
        """Transitions over 1, 2, 4 ... shortest spans, until nothing is left that counts."""
        with flint.ctx.workprec(_BITS):  # a rounding of the first is doubled each time
            move = exact if self.sampled or not self._x.size else (exact * flint.arb(self.shortest)).exp()
            moves = [_doubles(move)]
            everlasting = np.abs(self._c) @ self._largest(np.inf)
            while everlasting @ np.abs(moves[-1] @ self._x) > OVER:
                if len(moves) == _LEVELS:
                    raise NumericalError(_LONG)
                move = move * move
                moves.append(_doubles(move))
        return moves

    def _largest(self, span: float) -> Real:
        """M with |x(t)| <= M |x(0)| over a span, row by row: what flows into a state is integrated."""
        n = self._x.size
        inflow = np.abs(np.triu(self._A, 1))
        with np.errstate(divide="ignore"):  # a pole at z = 0
            rate = -np.log1p(-self._decay) if self.sampled else self._decay
        within = np.diag(-np.expm1(-rate * span) / self._decay)  # integral of a decay over the span
        return np.asarray(np.eye(n) + inflow @ np.linalg.solve(np.eye(n) - within @ inflow, within))

    @cached_property
    def _bounds(self) -> list[tuple[Real, Real]]:
        """For each level rows that bound |e|, and how far e leaves its chord, from |x| at the start."""
        spans = self.shortest * 2.0 ** np.arange(len(self._moves))
        return [
            (np.abs(self._c) @ M, 0.125 * h * h * (self._second @ M))
            for h, M in ((h, self._largest(h)) for h in spans)
        ]

    @property
    def slowest(self) -> float:
        """Smallest decay rate; infinity where there is no motion."""
        return float(self._decay.min(initial=np.inf))

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

        Returns the shortest spans that stay: when they begin, and e over them as a power series.
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
        return [] if self.sampled else list(zip(self.start + a, self._series(x), strict=True))

    def _series(self, x: Complex) -> Real:
        """Coefficients of e over one shortest span, highest power first; shape (m, terms)."""
        rows, factor = [], self._c
        for k in range(_TERMS):
            rows.append((x @ factor).real)
            factor = factor @ self._A * (self.shortest / (k + 1.0))
        return np.array(rows[::-1]).T


def gain_of(p: flint.acb, sampled: bool) -> flint.arb:
    """The output gain of one section: what makes its free motion of energy 1."""
    return (1 - abs(p) ** 2).sqrt() if sampled else (-2 * p.real).sqrt()


def _cascade(poles: Sequence[flint.acb], sampled: bool) -> tuple[flint.acb_mat, list[flint.acb]]:
    """A and c: each section is driven by the output of those after it."""
    n = len(poles)
    A, output = [[flint.acb(0)] * n for _ in poles], [flint.acb(0)] * n
    for i in reversed(range(n)):
        p, gain = poles[i], flint.acb(gain_of(poles[i], sampled))
        A[i] = [gain * y if sampled else -gain * y for y in output]
        A[i][i] = p
        if sampled:
            output = [-p.conjugate() * y for y in output]
        output[i] = gain
    return flint.acb_mat(n, n, [each for row in A for each in row]), output


def _doubles(exact: flint.acb_mat) -> Complex:
    n = exact.nrows()
    out = np.zeros((n, n), dtype=complex)
    for i in range(n):
        for j in range(i, n):
            out[i, j] = complex(exact[i, j])
    return _flushed(out)


def _flushed(move: Complex) -> Complex:
    return np.where(np.abs(move) < _VANISHED, 0.0, move)
