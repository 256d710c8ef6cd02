"""A system with delays, walked through a given input: the method of steps.

Jumps and kinks of the input return in the delayed signals after every sum of delays, and their derivatives
jump by amounts that follow from those before. Between such instants the solution is smooth: there it is
walked in pieces, each no longer than the shortest delay, so that the delayed signals are known, and short
enough for a polynomial; the state by the Radau IIA collocation of 7 stages (order 13 at the end of a piece).
Instants are kept while their jumps matter, for ever where a loop of delays lets a jump through.

Bellen, Zennaro, Numerical Methods for Delay Differential Equations, 2003.
"""

from heapq import heappop, heappush
from itertools import count
from math import factorial
from typing import Any

import numpy as np
from numpy.polynomial.legendre import Legendre, legvander

from actuator_lti.errors import InputError
from actuator_lti.systems.resolvent import balanced
from actuator_lti.types import Floats, Mask

_STAGES = 7
_RADAU = (Legendre.basis(_STAGES) - Legendre.basis(_STAGES - 1)).roots()
NODES = np.concatenate(([-1.0], _RADAU[:-1], [1.0]))  # of a piece, from -1 to 1
_POWERS = np.arange(NODES.size)
_SERIES = np.linalg.inv(NODES[:, None] ** _POWERS)  # power series from values at the nodes
_OF_PART = np.linalg.inv(np.vander(0.5 * (NODES + 1.0))) @ NODES[:, None] ** _POWERS  # of 0 to 1, from that
_LAST = np.linalg.inv(legvander(NODES, _STAGES))[-2:]  # Legendre coefficients of the highest degrees
_HIGHEST = np.array([[0.05], [1.0]])  # weights of these
_SLOPES = (_POWERS * NODES[1:, None] ** np.maximum(_POWERS - 1, 0)) @ _SERIES
_RATES, _TURN = np.linalg.eig(_SLOPES[:, 1:])
_BACK = np.linalg.inv(_TURN)
_ORDERS = 9  # value and derivatives whose jumps are followed
_SIZES = np.array([0.25**p / factorial(p) for p in range(_ORDERS)])  # what polynomials cannot follow of them
_SMALL = 1e-10  # of the largest value so far: a jump that is left out
_SMOOTH = 1e-9  # of the largest value so far: the highest coefficients of a piece
_SAME = 1e-9  # of the shortest delay: instants closer are one
MOST_PIECES = 400_000


class DelayStepper:
    """Walks a system with delays forward in time from a state and an input; nothing moved before the start.

    A step through 1/s behind a delay of 1 s: nothing, then a ramp.

    >>> from actuator_lti.systems.delay_system import DelaySystem
    >>> import control, numpy as np
    >>> late = DelaySystem.from_system(control.tf([1], [1, 0])) * DelaySystem.delay(1.0)
    >>> walk = DelayStepper(late, 0.0, np.zeros(1), np.ones(1))
    >>> [round(float(walk.at(t, np.ones(1))[1][0]), 9) for t in (0.5, 1.0, 1.5, 3.0)]
    [0.0, 0.0, 0.5, 2.0]
    """

    def __init__(self, system: Any, start_s: float, state: Floats, u: Floats) -> None:
        if not len(system.delays_s):
            raise InputError("a system without delays: take to_state_space()")
        self.start_s, self._delays = start_s, system.delays_s
        self._A, self._B = system.A, np.hstack([system.B2, system.B1])
        self._C = np.vstack([system.C2, system.C1])  # of v, then y
        self._D = np.block([[system.D22, system.D21], [system.D12, system.D11]])
        self._shortest = float(self._delays.min())
        norm = float(np.linalg.norm(balanced(self._A)[0], 2)) if len(self._A) else 0.0
        self._unit = self._shortest / max(1.0, self._shortest * norm)
        self._jumps = self._passed_on()
        self._t, self._state, self._h = 0.0, state.copy(), self._shortest  # times from the start on
        self._last, self._u, self._slope = 0.0, u.copy(), np.zeros_like(u)
        self._due: list[tuple[float, int, int, Floats]] = []  # (time, number, delay, its jumps)
        self._number = count()
        self._next: tuple[float, Floats] | None = None
        self._same = _SAME * self._shortest
        self._near = 1.5 * self._same
        self._driven = np.zeros(self._jumps.shape[1])  # what jumps at the start: state and input
        self._driven[: len(state)] = state
        self._driven[len(state) :].reshape(_ORDERS, -1)[0, len(self._delays) :] = u
        # Pieces: when each begins, its length, and the power series of v and y; first what was before.
        self._count = 1
        self._begins, self._lengths = np.full(1024, -np.inf), np.ones(1024)
        self._series = np.zeros((1024, NODES.size, len(self._C)))
        self._largest = np.zeros(len(self._C))

    def at(self, t: float, u: Floats) -> tuple[Floats, Floats]:
        """State and output at an instant not before the last one, the input straight since then."""
        t -= self.start_s
        if t > self._last:
            self._turned((u - self._u) / (t - self._last))
            while t - self._t > self._same:
                self._advance(self._smooth_until(min(t, self._t + self._shortest)))
                if self._next is not None and self._next[0] - self._t <= self._same:
                    self._pass_on(*self._next)
                    self._next = None
            self._last, self._u = t, u.copy()
        z = self._delayed(np.array([t]), np.array([t + self._near]))[0]
        return self._state, (self._C @ self._state + self._D @ np.concatenate([z, u]))[len(self._delays) :]

    def pieces(self) -> tuple[Floats, Floats, Floats]:
        """When the pieces so far begin, their lengths, and the outputs as power series of the part of each.

        Highest power first, shape (pieces, 8, p).
        """
        some = slice(1, self._count)
        return self._begins[some], self._lengths[some], _OF_PART @ self._series[some, :, len(self._delays) :]

    def _turned(self, slope: Floats) -> None:
        """The jumps that begin where the input's slope changes, at the start those of both too."""
        m, driven = len(slope), self._driven.copy()
        driven[len(self._state) :].reshape(_ORDERS, -1)[1, -m:] = (slope - self._slope) * self._unit
        self._pass_on(self._last, (self._jumps @ driven).reshape(_ORDERS, -1))
        self._slope, self._driven = slope, np.zeros_like(driven)

    def _smooth_until(self, limit: float) -> float:
        """The next instant at which something that matters jumps, or the limit."""
        while self._next is None and self._due and self._due[0][0] <= limit:
            t, driven = self._due[0][0], np.zeros_like(self._driven)
            by_order = driven[len(self._state) :].reshape(_ORDERS, -1)
            while self._due and self._due[0][0] <= t + self._same:
                _, _, k, jumps = heappop(self._due)
                by_order[:, k] += jumps
            jumps = (self._jumps @ driven).reshape(_ORDERS, -1)
            if not self._matters(jumps).any():
                continue
            if t - self._t <= self._same:
                self._pass_on(t, jumps)
            else:
                self._next = t, jumps
        return limit if self._next is None else min(limit, self._next[0])

    def _matters(self, jumps: Floats) -> Mask:
        return _SIZES @ np.abs(jumps) > _SMALL * self._largest

    def _pass_on(self, t: float, jumps: Floats) -> None:
        for k in np.flatnonzero(self._matters(jumps)[: len(self._delays)]):
            heappush(self._due, (t + self._delays[k], next(self._number), int(k), jumps[:, k]))

    def _advance(self, until: float) -> None:
        """One piece, as long as its polynomials follow."""
        whole = until - self._t
        h = whole if self._h >= whole else min(self._h, 0.5 * whole)
        while True:
            states, values = self._collocated(h)
            largest = np.maximum(self._largest, np.abs(values).max(axis=0))
            rough = np.abs(_LAST @ values) * _HIGHEST
            if h <= 0.25 * self._unit or not (rough > _SMOOTH * largest).any():  # or not numbers
                break
            h *= 0.5
        self._keep(h, _SERIES @ values)
        longer = 1.0 if (rough > 0.01 * _SMOOTH * largest).any() else 2.0
        self._h = max(longer * h, self._h if h == whole else 0.0)
        self._t, self._state, self._largest = self._t + h if h < whole else until, states[-1], largest

    def _collocated(self, h: float) -> tuple[Floats, Floats]:
        """States, and v and y, at the nodes of a piece of length h."""
        times = self._t + 0.5 * h * (NODES + 1.0)
        near = min(self._near, 0.5 * h)
        z = self._delayed(times, np.clip(times, self._t + near, self._t + h - near))
        driven = np.hstack([z, self._u + (times - self._last)[:, None] * self._slope])
        right = 0.5 * h * driven[1:] @ self._B.T - _SLOPES[:, :1] * self._state
        matrices = _RATES[:, None, None] * np.eye(len(self._A)) - 0.5 * h * self._A
        inner = _TURN @ np.linalg.solve(matrices, (_BACK @ right)[..., None])[..., 0]
        states = np.vstack([self._state, inner.real])
        return states, states @ self._C.T + driven @ self._D.T

    def _delayed(self, times: Floats, inside: Floats) -> Floats:
        """What the delays give at some times, each continued from the piece of a time inside of its own."""
        begins = self._begins[: self._count]
        piece = np.searchsorted(begins, inside[:, None] - self._delays, side="right") - 1
        part = 2.0 * (times[:, None] - self._delays - begins[piece]) / self._lengths[piece] - 1.0
        series = self._series[piece, :, np.arange(len(self._delays))]
        return (series * np.clip(part, -1.0, 1.0)[..., None] ** _POWERS).sum(axis=-1)

    def _keep(self, h: float, series: Floats) -> None:
        k = self._count
        if k > MOST_PIECES:
            raise InputError(
                f"{self._t:g} s take {k - 1} pieces between the instants at which jumps "
                f"return (sums of the delays, the shortest {self._shortest:g} s): ask for fewer seconds"
            )
        if k == len(self._begins):
            for name in ("_begins", "_lengths", "_series"):
                kept = getattr(self, name)
                setattr(self, name, np.concatenate([kept, np.zeros_like(kept)]))
        self._begins[k], self._lengths[k], self._series[k], self._count = self._t, h, series, k + 1

    def _passed_on(self) -> Floats:
        """The jumps of v and y, all orders, from those of x and, all orders, of z and u.

        Those of order p in units of p!/unit^p.
        """
        n, m = len(self._A), self._D.shape[1]
        inputs = np.eye(n + _ORDERS * m)
        x, jumps = inputs[:n], []
        for order in range(_ORDERS):
            driven = inputs[n + order * m : n + (order + 1) * m]
            jumps.append(self._C @ x + self._D @ driven)
            x = self._unit / (order + 1.0) * (self._A @ x + self._B @ driven)
        return np.concatenate(jumps)
