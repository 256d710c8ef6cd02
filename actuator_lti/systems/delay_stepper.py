"""A system with delays, stepped through a given input: the method of steps.

Between two nodes the delayed signals are known from before (a node is never further from the last than the
shortest delay), so the state moves by the matrix exponential of what a straight input and straight delayed
signals do. The only error is that of straight lines between the nodes: second order in their distance. Jumps
travel through the delays unharmed, as each node has a value before it and one after it, and the nodes fall on
every sum of delays where these have a common measure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from actuator_lti.errors import InputError

if TYPE_CHECKING:
    from actuator_lti.systems.delay_system import DelaySystem

Real = NDArray[np.float64]
_FEWEST = 12  # nodes to the shortest delay
_MOST = 48
_NODES = 4_000_000
_SAME = 1e-9  # of a step: closer is on the node


class DelayStepper:
    """Walks a `DelaySystem` forward in time from a state and an input; nothing moved before the start.

    Examples
    --------
    A step through 1/s behind a delay of 1 s: nothing, then a ramp.

    >>> from actuator_lti.systems.delay_system import DelaySystem
    >>> import control, numpy as np
    >>> late = DelaySystem.from_system(control.tf([1], [1, 0])) * DelaySystem.delay(1.0)
    >>> walk = DelayStepper(late, 0.0, np.zeros(1), np.ones(1))
    >>> [round(float(walk.at(t, np.ones(1))[1][0]), 9) for t in (0.5, 1.0, 1.5, 3.0)]
    [0.0, 0.0, 0.5, 2.0]
    """

    def __init__(self, system: DelaySystem, start_s: float, state: Real, u: Real) -> None:
        self.system, self.start_s = system, start_s
        self.step_s, self._block = step_of(system.delays_s)
        self._inputs = np.hstack([system.B1, system.B2])
        self._moves = {count: _many(system.A, self._inputs, self.step_s, count) for count in (1, self._block)}
        self._node, self._state, self._u = 0, state.copy(), u.copy()
        self._last = (start_s, u.copy())
        # Delayed signals v just before and just after each node, behind rows of zeros from before the start.
        self._pad = int(np.ceil(system.delays_s.max() / self.step_s)) + 2
        self._columns = np.arange(len(system.delays_s))
        self._before, self._after = (np.zeros((self._pad + 1024, len(self._columns))) for _ in range(2))
        self._after[self._pad] = system.C2 @ state + system.D21 @ u

    def at(self, t: float, u: Real) -> tuple[Real, Real]:
        """State and output at an instant not before the last one, the input straight since then."""
        self._walk(t, u)
        system, place = self.system, (t - self.start_s) / self.step_s
        after = self._delayed(np.array([place]), self._after)[0]
        state, rest = self._state, place - self._node
        if rest > _SAME:
            first = np.concatenate([self._u, self._delayed(np.array([float(self._node)]), self._after)[0]])
            last = np.concatenate([u, self._delayed(np.array([place]), self._before)[0]])
            to_state, by_inputs = _many(system.A, self._inputs, rest * self.step_s, 1)
            state = to_state @ state + by_inputs @ np.concatenate([first, last])
        self._last = (t, u.copy())
        return state, system.C1 @ state + system.D11 @ u + system.D12 @ after

    def _walk(self, t: float, u: Real) -> None:
        """Go on to the last node that is not after ``t``, a whole shortest delay at once where it fits."""
        until = int(np.floor((t - self.start_s) / self.step_s + _SAME))
        if until > _NODES:
            raise InputError(
                f"{t - self.start_s:g} s: too long for steps of {self.step_s:g} s; ask for fewer seconds"
            )
        while self._node < until:
            self._advance(self._block if until - self._node >= self._block else 1, t, u)

    def _advance(self, count: int, t: float, u: Real) -> None:
        """Go on by some nodes, at most the shortest delay: what the delays give there is known already."""
        system, (last_s, last), n = self.system, self._last, self._node
        nodes = np.arange(n, n + count + 1)
        passed = t - last_s or 1.0
        part = np.clip((self.start_s + nodes * self.step_s - last_s) / passed, 0.0, 1.0)
        inputs = last + part[:, None] * (u - last)
        inputs[0] = self._u
        early, late = (self._delayed(nodes.astype(float), kept) for kept in (self._after, self._before))
        driven = np.hstack([inputs[:-1], early[:-1], inputs[1:], late[1:]]).ravel()
        to_state, by_inputs = self._moves[count]
        states = (to_state @ self._state + by_inputs @ driven).reshape(count, -1)
        self._state, self._node, self._u = states[-1], n + count, inputs[-1]
        own = states @ system.C2.T + inputs[1:] @ system.D21.T
        self._keep(n + 1, own + late[1:] @ system.D22.T, own + early[1:] @ system.D22.T)

    def _keep(self, node: int, before: Real, after: Real) -> None:
        rows = slice(self._pad + node, self._pad + node + len(before))
        if rows.stop >= len(self._before):
            self._before, self._after = (
                np.vstack([k, np.zeros_like(k)]) for k in (self._before, self._after)
            )
        self._before[rows], self._after[rows] = before, after

    def _delayed(self, places: Real, kept: Real) -> Real:
        """What the delays give at some places (in steps from the start), from before or from after them."""
        at = places[:, None] - self.system.delays_s / self.step_s
        whole = np.floor(at + _SAME).astype(int)
        part = at - whole
        row = np.maximum(whole + self._pad, 0)
        between = (1.0 - part) * self._after[row, self._columns] + part * self._before[row + 1, self._columns]
        return np.where(np.abs(part) <= _SAME, kept[row, self._columns], between)


def step_of(delays_s: NDArray[np.floating[Any]]) -> tuple[float, int]:
    """Distance of the nodes, and how many of it are no longer than the shortest delay.

    The coarsest distance on which all delays fall, a part of the shortest in any case.
    """
    if not len(delays_s):
        raise InputError("a system without delays: take to_state_space()")
    shortest = float(delays_s.min())
    for parts in range(_FEWEST, _MOST + 1):
        places = delays_s * (parts / shortest)
        if np.all(np.abs(places - np.round(places)) < _SAME * places):
            return shortest / parts, parts
    return shortest / _MOST, _MOST


def _many(A: Real, B: Real, h: float, count: int) -> tuple[Real, Real]:
    """States after 1 .. count steps, from the state and from (first, last) of the straight inputs of each."""
    n, m = B.shape
    big = np.zeros((n + 2 * m, n + 2 * m))
    big[:n, :n], big[:n, n : n + m], big[n : n + m, n + m :] = A * h, B * h, np.eye(m)
    E = expm(big)
    move, ends = E[:n, :n], np.hstack([E[:n, n : n + m] - E[:n, n + m :], E[:n, n + m :]])
    to_state, by_inputs = np.zeros((count * n, n)), np.zeros((count * n, count * 2 * m))
    power = np.eye(n)
    for k in range(count):
        pushed = power @ ends
        for j in range(k, count):
            place = j - k
            by_inputs[j * n : (j + 1) * n, place * 2 * m : (place + 1) * 2 * m] = pushed
        power = move @ power
        to_state[k * n : (k + 1) * n] = power
    return to_state, by_inputs
