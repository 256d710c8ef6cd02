"""A step response's deviation e(t) from its final value, as the free motion of all-pass sections.

Every stable motion is a sum of orthonormal functions of its poles (Takenaka, Malmquist), which are the free
motions of such a cascade: x' = A x, e = c x, A upper triangular with A + A* + c* c = 0. exp(A t) is a
contraction, so poles that lie together or repeat cost no digit. Those of a sampled system are in z, with
A* A + c* c = 1; e after k samples is c A^k x.

Heuberger, Van den Hof, Wahlberg, Modelling and Identification with Rational Orthogonal Basis Functions, 2005.
"""

import math
from typing import Any

import numpy as np
from flint import acb, acb_mat, acb_poly, arb, arb_poly, fmpq, fmpq_poly

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.exact.loop import ExactLoop, exact_loop
from actuator_lti.margins.exact.roots import at_enough_bits, warped
from actuator_lti.margins.given import given_of
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.step.search import OVER, Search
from actuator_lti.systems.exact_response import dc_noise, double, near_dc, of_s, shown
from actuator_lti.systems.precision import precision
from actuator_lti.types import Complex, Real

UNSTABLE = "the system is not stable: it has no step figures"
NO_FINAL = "the final value of the step response is zero: it has no rise, overshoot or settling"
LOST = NO_FINAL.replace("is zero:", "is zero within the rounding of the entries:")
_INTEGRATES = "the system integrates: its step response has no final value"
_LONG = "the step response rings for too long: what it settles to is known, when is not"
_FINE = 512.0  # parts of the shortest time constant: a span that its power series covers
_TERMS = 8
_LEVELS = 60
_MOST = 200_000  # spans of one length
_BITS = 160  # of the transitions: a rounding of the first is doubled each time
_FIRST_BITS, _SURE = 192, 2.0**-60  # of the poles, and how sharp what they show has to be
_VANISHED = 1e-100  # what is smaller would only slow the processor down


class Motion:
    """The real part of ``output`` times the free motion of ``A``, from the ``state`` at a start on.

    Upper triangular, its poles stable and, but for diagonal ones, a contraction; time in s, or in samples.
    """

    def __init__(self, A: acb_mat, output: Any, state: Any, sampled: bool, start: float = 0.0) -> None:
        self.sampled, self.start = sampled, start
        self._x, self._c = (np.array([complex(each) for each in part]) for part in (state, output))
        self._A, n = _doubles(A), len(self._x)
        size = float(np.linalg.norm(self._A, 2)) if n and not sampled else 0.0
        self.shortest = 2.0 ** -np.ceil(np.log2(_FINE * size)) if size else 1.0
        self._moves = self._transitions(A)
        self.whole = float(self.shortest * 2.0 ** (len(self._moves) - 1))  # how long it lasts
        turned = self._A - np.eye(n) if sampled else self._A
        # rows that bound abs(e) over a span, and how far e leaves its chord there, from abs(x) at its start
        rows = np.abs([self._c, 0.125 * self.shortest**2 * (self._c @ turned @ turned)])
        after = np.abs(self._A) if sampled else np.eye(n) + 2.0 * self.shortest * np.abs(np.triu(self._A, 1))
        self._bounds = [np.maximum(rows, rows @ after)]
        for move in self._moves[:-1]:
            rows = self._bounds[-1]
            self._bounds.append(np.maximum(rows, rows @ np.abs(move)) * [[1.0], [4.0]])

    def _transitions(self, A: acb_mat) -> list[Complex]:
        """Over 1, 2, 4 ... shortest spans, until nothing is left that counts."""
        moves: list[Complex] = []
        with precision(_BITS):
            move = A if self.sampled or not self._x.size else (A * arb(self.shortest)).exp()
            while len(moves) < _LEVELS:
                moves.append(_doubles(move))
                if np.linalg.norm(self._c) * np.linalg.norm(moves[-1] @ self._x) <= OVER:
                    return moves
                move = move * move
        raise NumericalError(_LONG)

    def curve(self, end: float, count: int) -> tuple[Real, Real]:
        """Times from the start on to ``end``, at most twice ``count`` and evenly apart, and e there."""
        spans = (end - self.start) / self.shortest
        level = int(np.clip(np.floor(np.log2(max(spans / count, 1.0))), 0, len(self._moves) - 1))
        move, x, points = self._moves[level], self._x[None], int(np.ceil(spans / 2.0**level)) + 1
        while len(x) < points:
            x, move = np.concatenate((x, x @ move.T)), move @ move
        return self.start + self.shortest * 2.0**level * np.arange(points), (x[:points] @ self._c).real

    def look(self, search: Search) -> None:
        """Halve all of time; what may hold an answer is halved again, then looked into as a power series."""
        a, x = np.zeros(1), self._x[None]
        for level in reversed(range(len(self._moves))):
            span, move = self.shortest * 2.0**level, self._moves[level]
            if level + 1 < len(self._moves):
                a, x = np.concatenate((a, a + span)), np.concatenate((x, x @ move.T))
            begins, ends = self.start + a, self.start + a + span
            left, right = (x @ self._c).real, (x @ (self._c @ move)).real
            size, bend = (np.abs(x) @ row for row in self._bounds[level])
            low = np.maximum(-size, np.minimum(left, right) - bend)
            high = np.minimum(size, np.maximum(left, right) + bend)
            search.see(np.concatenate((begins, ends)), np.concatenate((left, right)))
            keep = search.worth(begins, ends, low, high)
            a, x = a[keep], x[keep]
            if not a.size:
                return
            if a.size > _MOST:
                raise NumericalError(_LONG)
        if not self.sampled:
            terms, factor = [], self._c
            for k in range(_TERMS):
                terms.append((x @ factor).real)
                factor = factor @ self._A * (self.shortest / (k + 1.0))
            search.inside((self.start + a, np.full(a.size, self.shortest), np.array(terms[::-1]).T))


def _doubles(exact: acb_mat) -> Complex:
    n = exact.nrows()
    out = np.triu(np.array([complex(each) for each in exact.entries()]).reshape(n, n))
    return np.where(np.abs(out) < _VANISHED, 0.0, out)


def rational_motion(system: Any, loop: RationalLoop) -> tuple[Motion, float, int]:
    """The motion and the final value of the unit step response of a stable rational system.

    And how many modes on the stability boundary it does not show, those at zero frequency left out.

    ``loop`` is the same, balanced (which is exact). Of the system itself the transfer function follows
    exactly from its doubles, its roots are isolated in certified balls, and the coordinates of the motion are
    computed in as many digits as they need.
    """
    exact = shown(exact_loop(given_of(system)), loop)
    N, D = exact.N, exact.D
    final = double(fmpq(N[0], D[0])) if D[0] != 0 else math.inf

    def motion() -> Motion | None:
        poles = _poles(exact, loop)
        if N[0] == 0:
            raise InputError(NO_FINAL)
        if abs(final) <= dc_noise(loop):
            raise NumericalError(LOST)
        rest = (fmpq_poly(N) * D[0] / N[0] - D) / fmpq_poly([0, D[D.degree()]])
        if exact.sampled:
            rest = _in_z(rest, len(poles) - 1) / _in_z(fmpq_poly(D) / D[D.degree()], len(poles))[len(poles)]
            poles = [(1 + p) / (1 - p) for p in poles]
        return _free_motion(acb_poly(arb_poly(rest)), poles, exact.sampled)

    hidden = exact.hidden_modes.at_limit - exact.hidden_modes.at_zero + exact.hidden_at_end
    return at_enough_bits(motion, _FIRST_BITS, "a pole of the step response"), final, hidden


def _in_z(p: fmpq_poly, degree: int) -> fmpq_poly:
    """(z + 1)^degree p((z - 1)/(z + 1))."""
    turn = fmpq_poly([0, -1])
    return warped(p(turn), degree)(turn)


def _poles(exact: ExactLoop, loop: RationalLoop) -> list[acb]:
    """All that the response shows, each as often as it is repeated, the slowest first; in s."""
    poles = exact.poles
    hidden = (p for p in exact.hidden_modes.roots if not p.contains(0) and not near_dc(p, loop))
    at_end = exact.degree > exact.D.degree()
    if poles.right or poles.at_limit > poles.at_zero or at_end or any(p.real > 0 for p in hidden):
        raise InputError(UNSTABLE)
    if poles.at_zero:
        raise InputError(_INTEGRATES if poles.at_zero == 1 else UNSTABLE)
    placed = [(of_s(p, loop), p) for p in poles.find()]
    return [p for z, p in sorted(placed, key=lambda each: -abs(each[0]) if loop.in_z else -each[0].real)]


def _free_motion(rest: acb_poly, poles: list[acb], sampled: bool) -> Motion | None:
    """The motion with the transform rest/(product of variable - pole); ``None``: more digits are needed.

    The variable is s, or z of a sampled system: there no pole is large, those near -1 would be in s.
    """
    n = len(poles)
    turned = [-p.conjugate() for p in poles]
    gains = [(1 + p * q if sampled else q - p).sqrt() for p, q in zip(poles, turned, strict=True)]  # energy 1
    mirrored = [acb_poly([1])]
    for q in turned:
        mirrored.append(mirrored[-1] * acb_poly([1, q] if sampled else [-q, 1]))
    A, state, output = acb_mat(n, n), [acb(0)] * n, [acb(0)] * n
    for j in reversed(range(n)):
        p, passed = poles[j], gains[j] * mirrored[j]
        state[j] = rest(p) / passed(p)
        rest = (rest - state[j] * passed) // acb_poly([-p, 1])
        if not float(abs(state[j] * gains[j]).rad()) <= _SURE:
            return None
        through = acb(1)  # what the sections between let pass at once
        for k in reversed(range(j)):
            A[k, j] = gains[k] * gains[j] * through if sampled else -gains[k] * gains[j]
            through *= turned[k] if sampled else 1
        A[j, j], output[j] = p, gains[j] * through
    return Motion(A, output, state, sampled)
