"""Step response of a system with inner delays, stepped along its delays."""

from __future__ import annotations

from typing import Any

import flint
import numpy as np
from scipy.linalg import expm

from actuator_lti.errors import InputError
from actuator_lti.margins.delays.collocation import state_matrix
from actuator_lti.margins.delays.form import DelayForm, characteristic, delay_form
from actuator_lti.margins.delays.response import DelayResponse
from actuator_lti.margins.loop import Complex, Real
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.step.motion import Motion
from actuator_lti.step.rational import NO_FINAL, UNSTABLE, free_motion
from actuator_lti.step.stepped import Stepped
from actuator_lti.systems.delay_stepper import step_of
from actuator_lti.systems.exact_fraction import product
from actuator_lti.systems.plain_delays import response

_FIRST = 10.0  # longest delays to step at first
_MEET = 1e-5
_POINTS = 32
_PARTS = 4  # intervals of a step at whose ends the response is kept
_ZERO = 1e-12  # of the largest response about the poles
_MOST = 400_000
_FORGOTTEN = 25.0  # time constants
_NEWTON = 8
_BITS = 256


def delayed_response(system: Any) -> tuple[Stepped, Motion, float]:
    """Unit step response of a system with inner delays over its final value, and that value.

    The first delays are stepped; after them the response is the free motion of the exact poles, which the
    collocation of the delays starts and Newton on the characteristic matrix sharpens. The two have to agree
    where they meet, to 1e-5 of the final value; otherwise stepping goes on.

    Raises
    ------
    InputError
        Not stable, a final value of zero, or a response that would take too many points.
    """
    form = delay_form(system)
    poles, at_rest = sorted_poles(state_matrix(form, _POINTS), False), DelayResponse.of(form)
    if at_rest.order > 0 or poles.unstable or poles.border > 1:
        raise InputError(UNSTABLE)
    final = 0.0 if at_rest.order else at_rest.lead
    _refuse_no_final(system, final, poles.values)
    head = _FIRST * float(form.delays_s.max())
    while True:
        h = _grid_step(form.delays_s, head)
        values = _stepped(form, h, int(np.ceil(head / h))) / final - 1.0
        exact, weights = _modes(form, poles.values, head)
        late = np.arange(len(values) * 3 // 4, len(values))
        modes = (np.exp(h * np.outer(late, exact)) @ weights).real / final
        if np.abs(modes - values[late, 0]).max() <= _MEET:
            early = Stepped.through(values, h)
            return early, _motion(exact, weights * np.exp(exact * early.end) / final, early.end), final
        head *= 2.0


def _refuse_no_final(system: Any, final: float, poles: Complex) -> None:
    around = 1j * np.abs(poles[np.abs(poles) > 0.0])
    largest = float(np.abs(response(system, around)).max(initial=0.0))
    if abs(final) <= _ZERO * largest:
        raise InputError(NO_FINAL)


def _modes(form: DelayForm, poles: Complex, start: float) -> tuple[Complex, Complex]:
    """Poles still alive after ``start`` (s), and their weights: residues of T/s.

    Only those of the upper half plane; where they are not real, a weight counts for the pair.
    """
    alive = (poles.real > -_FORGOTTEN / start) & (poles.imag >= 0.0) & (poles.real < 0.0)
    exact: list[complex] = []
    weights: list[complex] = []
    for estimate in poles[alive]:
        pole, residue = _sharpened(form, complex(estimate))
        if pole is None or residue == 0.0 or any(abs(pole - p) <= 1e-9 * abs(p) for p in exact):
            continue
        exact.append(pole)
        weights.append(residue / pole * (1.0 if pole.imag == 0.0 else 2.0))
    return np.array(exact, dtype=complex), np.array(weights, dtype=complex)


def _sharpened(form: DelayForm, pole: complex) -> tuple[complex | None, complex]:
    """Newton with both null vectors, pole -= (u* F w)/(u* F' w); the residue of T there."""
    start = pole
    for _ in range(_NEWTON):
        F, slope, row, column = characteristic(form, pole)
        U, _, Vh = np.linalg.svd(F)
        u, w = U[:, -1], Vh[-1].conj()
        below = complex(u.conj() @ slope @ w)
        step = complex(u.conj() @ F @ w) / below
        pole -= step
        if abs(step) <= 1e-13 * abs(pole):
            break
    if abs(start.imag) <= 1e-9 * abs(start) or abs(pole.imag) <= 1e-12 * abs(pole):
        pole = complex(pole.real)
    if abs(pole - start) > 0.1 * abs(start):
        return None, 0j
    return pole, complex(row @ w) * complex(u.conj() @ column) / below


def _motion(poles: Complex, weights: Complex, start: float) -> Motion:
    """The motion that is the real part of the sum of weights times exponentials from the start on."""
    real = poles.imag == 0.0
    every = [flint.acb(complex(p)) for p in np.concatenate((poles, poles[~real].conj()))]
    parts = np.concatenate((np.where(real, weights, 0.5 * weights), 0.5 * weights[~real].conj()))
    bits = _BITS
    while True:
        with flint.ctx.workprec(bits):
            rest = flint.acb_poly([0])
            for k, weight in enumerate(parts):
                rest += product(every[:k] + every[k + 1 :]) * flint.acb(complex(weight))
            motion = free_motion(rest, every, False, start)
        if motion is not None:
            return motion
        bits *= 2


def _grid_step(delays: Real, horizon: float) -> float:
    """A step of which every delay is a multiple, where there is one; longer where it would take too many."""
    shortest, (h, _) = float(delays.min()), step_of(delays)
    if horizon / h > _MOST:
        h = shortest / max(int(shortest * _MOST / horizon), 1)
        if horizon / h > 4 * _MOST:
            raise InputError("the step response lasts too many delays to be stepped")
    return h


class _Past:
    """Delayed signals: in each step a parabola through its start, middle and end; zero before t = 0."""

    def __init__(self, steps: int, lag: Real) -> None:
        self.start, self.middle, self.end = (np.zeros((steps + 1, lag.size)) for _ in range(3))
        self._rows, self._whole = np.arange(lag.size), np.floor(lag + 1e-9).astype(int)
        rest = lag - self._whole
        self._part = np.where(np.abs(rest) < 1e-9 * lag, 0.0, rest)

    def at(self, k: int, position: float) -> Real:
        """Signals delayed, at t = (k + position) h with position 0, 1/2 or (the end of a step) 1."""
        step, inside = k - self._whole, position - self._part
        step, inside = np.where(inside < 0.0, step - 1, step), np.where(inside < 0.0, inside + 1.0, inside)
        j = np.maximum(step, 0)
        a, m, b = (table[j, self._rows] for table in (self.start, self.middle, self.end))
        value = a + inside * (-3.0 * a + 4.0 * m - b) + inside**2 * (2.0 * a - 4.0 * m + 2.0 * b)
        return np.where(step >= 0, value, 0.0)


def _stepped(form: DelayForm, h: float, steps: int) -> Real:
    """March: x exactly for delayed signals that are parabolas over a step.

    Returns y at the start, at each quarter and at the end of each step (shape (steps + 1, 5)).
    """
    n, q = form.B1.size, form.delays_s.size
    M = np.zeros((n + 3 * q + 1, n + 3 * q + 1))
    M[:n, :n], M[:n, n : n + q], M[:n, -1] = form.A, form.B2, form.B1
    M[n : n + q, n + q : n + 2 * q] = M[n + q : n + 2 * q, n + 2 * q : n + 3 * q] = np.eye(q)
    positions = np.arange(_PARTS + 1) / _PARTS
    inside = np.stack([expm(M * (h * part))[:n] for part in positions])
    past = _Past(steps, form.delays_s / h)
    x, y = np.zeros(n), np.empty((steps + 1, _PARTS + 1))
    for k in range(steps + 1):
        z = np.stack([past.at(k, part) for part in positions])
        a, m, b = z[0], z[_PARTS // 2], z[-1]
        state = np.concatenate(
            (x, a, (-3.0 * a + 4.0 * m - b) / h, (4.0 * a - 8.0 * m + 4.0 * b) / h**2, [1.0])
        )
        states = inside @ state
        v = states @ form.C2.T + form.D21 + z @ form.D22.T
        past.start[k], past.middle[k], past.end[k] = v[0], v[_PARTS // 2], v[-1]
        y[k] = states @ form.C1 + z @ form.D12
        x = states[-1]
    return y + form.D11
