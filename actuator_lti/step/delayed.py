"""Step response of a system with inner delays, stepped along its delays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import flint
import numpy as np
from scipy.interpolate import BarycentricInterpolator
from scipy.linalg import expm

from actuator_lti.errors import InputError
from actuator_lti.margins.delays.form import DelayForm, delay_form
from actuator_lti.margins.loop import Complex, Real, balanced
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.step.motion import NO_FINAL, UNSTABLE, Motion, Spans, Undecided
from actuator_lti.systems.delay_response import DelayResponse
from actuator_lti.systems.delay_stepper import step_of
from actuator_lti.systems.plain_system import response

_FIRST = 10.0  # longest delays to step at first
_MEET = 1e-5
_POINTS = 32
_PARTS = np.linspace(0.0, 1.0, 5)  # of a step, at which the response is kept
_SERIES = np.linalg.inv(np.vander(_PARTS))  # from its values there to the quartic through them
_ZERO = 1e-12  # of the largest response about the poles
_MOST = 400_000
_FORGOTTEN = 25.0  # time constants
_CIRCLE, _AROUND = 0.25, 32  # radius, of the way to what lies next, and points on it


class Stepped:
    """The first part of the response, over each step a polynomial of the part of it.

    From the values at the start, at each quarter and at the end of each step, shape (steps, 5).
    """

    sampled, tie = False, 0.0

    def __init__(self, values: Real, h: float) -> None:
        self.shortest, self.end = h, h * len(values)
        self._series = values @ _SERIES.T

    def spans(self, undecided: Undecided, of: Callable[[Real], Real]) -> Spans:
        """See `actuator_lti.step.motion.Motion.spans`."""
        a, series = self.shortest * np.arange(len(self._series)), self._series
        left, right = of(series[:, -1]), of(series.sum(axis=1))
        most = left + np.abs(series[:, :-1]).sum(axis=1)
        keep = undecided(a, a + self.shortest, left, right, most)
        return list(zip(a[keep], series[keep], strict=True))

    def curve(self, end: float, count: int) -> tuple[Real, Real]:
        """Times up to ``end``, and e there."""
        time = np.linspace(0.0, end, count)
        step = np.minimum((time / self.shortest).astype(int), len(self._series) - 1)
        return time, (np.vander(time / self.shortest - step, _PARTS.size) * self._series[step]).sum(axis=1)


def delayed_response(system: Any) -> tuple[Stepped, Motion, float]:
    """Unit step response of a system with inner delays over its final value, and that value.

    The first delays are stepped; after them the response is the free motion of the exact poles, which the
    collocation of the delays starts and integrals of T about them sharpen. The two have to agree
    where they meet, to 1e-5 of the final value; otherwise stepping goes on.
    """
    form = delay_form(system)
    form = replace(form, whole=balanced(form.whole))
    poles, at_rest = sorted_poles(collocated(form, _POINTS), False), DelayResponse.of(form)
    if at_rest.order > 0 or poles.unstable or poles.border > 1:
        raise InputError(UNSTABLE)
    final = 0.0 if at_rest.order else at_rest.lead
    around = 1j * np.abs(poles.values[np.abs(poles.values) > 0.0])
    if abs(final) <= _ZERO * float(np.abs(response(system, around)).max(initial=0.0)):
        raise InputError(NO_FINAL)
    head = _FIRST * float(form.delays_s.max())
    while True:
        h = _grid_step(form.delays_s, head)
        values = _stepped(form, h, int(np.ceil(head / h))) / final - 1.0
        exact, weights = _modes(system, poles.values, head)
        late = np.arange(len(values) * 3 // 4, len(values))
        modes = (np.exp(h * np.outer(late, exact)) @ weights).real / final
        if np.abs(modes - values[late, 0]).max() <= _MEET:
            early, n = Stepped(values, h), exact.size
            A = flint.acb_mat(n, n, [complex(p) for p in np.diag(exact).ravel()])
            state = weights * np.exp(exact * early.end) / final
            return early, Motion(A, np.ones(n), state, False, early.end), final
        head *= 2.0


def collocated(form: DelayForm, points: int) -> Real:
    """State matrix of a system with its inner delays collocated (a delay in series has no poles).

    A delay tau is the line dq/dt = -(1/tau) dq/dx, 0 <= x <= 1, with the input at x = 0 and the output at
    x = 1. Eigenvalues with |s| tau well below the number of points are those of the exact delay to near
    machine precision (Breda, Maset, Vermiglio 2005).
    """
    n, q, N, delays = form.states, form.delays_s.size, points, form.delays_s
    inner = form.whole[:-1, :-1]
    x = 0.5 * (1.0 - np.cos(np.pi * np.arange(N + 1) / N))
    D = BarycentricInterpolator(x, np.eye(N + 1)).derivative(x)
    M = np.zeros((n + q * N, n + q * N))
    M[:n, :n] = inner[:n, :n]
    ends = n + N * np.arange(1, q + 1) - 1
    M[:n, ends] = inner[:n, n:]
    for k in range(q):
        rows = slice(n + k * N, n + (k + 1) * N)
        M[rows, rows] = -D[1:, 1:] / delays[k]
        M[rows, :n] -= np.outer(D[1:, 0], inner[n + k, :n]) / delays[k]
        M[rows, ends] -= np.outer(D[1:, 0], inner[n + k, n:]) / delays[k]
    return M


def _modes(system: Any, poles: Complex, start: float) -> tuple[Complex, Complex]:
    """Poles still alive after ``start`` (s), and their weights: residues of T/s.

    Both from the exact T on a circle about each estimate that holds no other: the mean of T z is the residue,
    that of T z^2 over it how far the pole lies off. Only those of the upper half plane; where they are not
    real, a weight counts for the pair.
    """
    alive = (poles.real > -_FORGOTTEN / start) & (poles.imag >= 0.0) & (poles.real < 0.0)
    turn = np.exp(2j * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND)
    found: list[tuple[complex, complex]] = []
    for k in np.flatnonzero(alive):
        pole = complex(poles[k])
        z = _CIRCLE * min(abs(pole), float(np.abs(np.delete(poles, k) - pole).min(initial=np.inf))) * turn
        weighted = response(system, pole + z)[0, 0] * z
        residue = complex(weighted.mean())
        if abs(residue) <= _ZERO * float(np.abs(weighted).max()):
            continue  # T has no pole there
        off = complex((weighted * z).mean()) / residue
        if pole.imag == 0.0:
            off, residue = complex(off.real), complex(residue.real)
        found.append((pole + off, residue / (pole + off) * (1.0 if pole.imag == 0.0 else 2.0)))
    exact, weights = np.array(found, dtype=complex).reshape(-1, 2).T
    return exact, weights


def _grid_step(delays: Real, horizon: float) -> float:
    """A step of which every delay is a multiple, where there is one; longer where it would take too many."""
    shortest, (h, _) = float(delays.min()), step_of(delays)
    if horizon / h > _MOST:
        h = shortest / max(int(shortest * _MOST / horizon), 1)
        if horizon / h > 4 * _MOST:
            raise InputError("the step response lasts too many delays to be stepped")
    return h


def _stepped(form: DelayForm, h: float, steps: int) -> Real:
    """March: x exactly for delayed signals that are quartics over a step, zero before t = 0.

    Returns y at the start, at each quarter and at the end of each step (shape (steps + 1, 5)).
    """
    n, q, m = form.states, form.delays_s.size, _PARTS.size
    M = np.zeros((n + m * q + 1, n + m * q + 1))  # of x, the delayed signals with their derivatives, and u
    M[:n, : n + q], M[:n, -1] = h * form.whole[:n, :-1], h * form.whole[:n, -1]
    M[n : n + (m - 1) * q, n + q : -1] = np.eye((m - 1) * q)
    inside = np.stack([expm(M * part)[:n] for part in _PARTS])
    to_derivatives = np.cumprod([1.0, *range(1, m)])[:, None] * _SERIES[::-1]
    by_delayed = np.einsum("pnkq,kv->pnqv", inside[:, :, n:-1].reshape(m, n, m, q), to_derivatives)
    lag = form.delays_s / h
    whole = np.floor(lag + 1e-9).astype(int)
    rest = np.where(np.abs(lag - whole) < 1e-9 * lag, 0.0, lag - whole)[:, None]
    before = rest > _PARTS  # part of a step that looks back into the one before
    looks = np.stack([np.vander(at, m) @ _SERIES for at in _PARTS - rest + before])
    late = np.concatenate([looks * ~before[..., None], looks * before[..., None]], axis=2)
    first, delays = int(whole.max()) + 1, np.arange(q)
    past, x, y = np.zeros((first + steps + 1, q, m)), np.zeros(n), np.empty((steps + 1, m))
    for k in range(steps + 1):
        at = first + k - whole
        known = np.concatenate([past[at, delays], past[at - 1, delays]], axis=1)
        z = (late @ known[..., None])[..., 0]
        states = inside[:, :, :n] @ x + by_delayed.reshape(m, n, -1) @ z.ravel() + inside[:, :, -1]
        out = np.hstack((states, z.T)) @ form.whole[n:, :-1].T + form.whole[n:, -1]
        past[first + k], y[k], x = out[:, :-1].T, out[:, -1], states[-1]
    return y
