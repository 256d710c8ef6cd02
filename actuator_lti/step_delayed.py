"""Step response of a system with inner delays, stepped along its delays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import expm

from actuator_lti.errors import InputError
from actuator_lti.margins.collocation import open_loop_matrix
from actuator_lti.margins.delay_form import DelayForm, border_values, delay_form
from actuator_lti.margins.delayed import low_frequency
from actuator_lti.margins.loop import Real
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.step_modes import ModalTail, modal_tail

_FEWEST = 20  # points to the shortest delay
_ALIVE = 9.0  # time constants of the slowest mode to look at
_FIRST = 10.0  # longest delays to step at first
_MEET = 1e-5
_POINTS = 32
_MOST = 400_000


Between = Callable[[int, float], float]


def delayed_response(system: Any) -> tuple[Real, Real, float, Between]:
    """Unit step response of a system with inner delays.

    The first delays are stepped; after them the response is the sum over the exact poles, which the
    collocation of the delays starts and Newton on the characteristic matrix sharpens. The two have to agree
    where they meet, to 1e-5 of the final value; otherwise stepping goes on.

    Returns
    -------
    time_s, response : arrays
        The grid, and the response on it.
    final_value : float
        Its limit.
    between : callable
        Response at any time within the grid interval k: ``between(k, t)``.

    Raises
    ------
    InputError
        Not stable, or a response that would take too many points.
    """
    form = delay_form(system)
    low, order = low_frequency(form)
    poles = sorted_poles(open_loop_matrix(form, _POINTS), False)
    if order or poles.unstable or poles.border_count > 1:
        raise InputError("the system is not stable: it has no step figures")
    final = float(border_values(form, np.array([low if poles.border_count else 0.0]))[0].real)
    decay = -poles.values.real
    horizon = _ALIVE / float(decay[decay > 1e-9 * np.abs(poles.values).max()].min())
    head = _FIRST * float(form.delays.max())
    while True:
        h = _grid_step(form.delays, head)
        time = h * np.arange(int(np.ceil(head / h)) + 1)
        response = _stepped(form, h, time.size - 1)
        if head >= horizon:
            return time, response, final, straight(time, response)
        tail = modal_tail(form, poles.values, head)
        late = time > 0.75 * head
        if np.abs(tail.response(time[late]) + final - response[late]).max() <= _MEET * abs(final):
            return _joined(time, response, final, tail, horizon)
        head *= 2.0


def straight(time: Real, response: Real) -> Between:
    """The response straight between grid points."""

    def between(k: int, t: float) -> float:
        return float(np.interp(t, time[k : k + 2], response[k : k + 2]))

    return between


def _joined(
    time: Real, response: Real, final: float, tail: ModalTail, horizon: float
) -> tuple[Real, Real, float, Between]:
    last, late = time.size - 1, tail.grid(float(time[-1]), max(horizon, 1.01 * float(time[-1])))
    all_time = np.concatenate((time, late))
    all_response = np.concatenate((response, tail.response(late) + final))
    early = straight(time, response)

    def between(k: int, t: float) -> float:
        return early(k, t) if k < last else float(tail.response(np.array([t]))[0]) + final

    return all_time, all_response, final, between


def _grid_step(delays: Real, horizon: float) -> float:
    """A step of which every delay is a multiple, where there is one; else a fine one."""
    shortest = float(delays.min())
    for parts in range(1, 65):
        ratio = delays * parts / shortest
        if (np.abs(ratio - np.round(ratio)) < 1e-9 * ratio).all():
            break
    refine = max(int(np.ceil(_FEWEST / parts)), 1)
    h = shortest / (parts * refine)
    if horizon / h > _MOST:
        h = shortest / max(int(shortest * _MOST / horizon), 1)
        if horizon / h > 4 * _MOST:
            raise InputError("the step response lasts too many delays to be stepped")
    return h


def _stepped(form: DelayForm, h: float, steps: int) -> Real:
    """March: x exactly for delayed signals that are straight over a step; y at every grid point."""
    n, q = form.B1.size, form.delays.size
    M = np.zeros((n + 2 * q + 1, n + 2 * q + 1))
    M[:n, :n], M[:n, n : n + q], M[:n, -1] = form.A, form.B2, form.B1
    M[n : n + q, n + q : n + 2 * q] = np.eye(q) / h
    P = expm(M * h)[:n]
    lag = form.delays / h
    whole = np.floor(lag + 1e-9).astype(int)
    part = np.where(np.abs(lag - whole) < 1e-9 * lag, 0.0, lag - whole)
    right = np.zeros((steps + 2, q))  # v just after each point; just before it, below
    left = np.zeros((steps + 2, q))
    x, y = np.zeros(n), np.empty(steps + 1)
    rows = np.arange(q)

    def delayed(k: int, table: Real) -> Real:
        at = k - whole
        here = np.where(at >= 0, table[np.maximum(at, 0), rows], 0.0)
        before = np.where(at >= 1, right[np.maximum(at - 1, 0), rows], 0.0)
        return here if not part.any() else (1.0 - part) * here + part * before

    z = np.zeros(q)
    right[0] = form.D21
    y[0] = form.D11
    for k in range(steps):
        ahead = delayed(k + 1, left)
        x = P @ np.concatenate((x, z, ahead - z, [1.0]))
        left[k + 1] = form.C2 @ x + form.D21 + form.D22 @ ahead
        z = delayed(k + 1, right)
        right[k + 1] = form.C2 @ x + form.D21 + form.D22 @ z
        y[k + 1] = form.C1 @ x + form.D11 + form.D12 @ z
    return y
