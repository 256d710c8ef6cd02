"""Step response of a system with inner delays, stepped along its delays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from actuator_lti.errors import InputError
from actuator_lti.margins.collocation import open_loop_matrix
from actuator_lti.margins.delay_form import DelayForm, border_values, delay_form
from actuator_lti.margins.delay_setting import low_frequency
from actuator_lti.margins.loop import Real
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.step_modes import ModalTail, modal_tail

_FEWEST = 12  # steps to the shortest delay
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
        values = _stepped(form, h, int(np.ceil(head / h)))
        time, response = 0.5 * h * np.arange(2 * values.shape[0]), values[:, :2].ravel()
        if head >= horizon:
            return time, response, final, parabolas(h, values)
        tail = modal_tail(form, poles.values, head)
        late = time > 0.75 * head
        if np.abs(tail.response(time[late]) + final - response[late]).max() <= _MEET * abs(final):
            return _joined(time, response, final, tail, horizon, parabolas(h, values))
        head *= 2.0


def parabolas(h: float, values: Real) -> Between:
    """The response within its steps; two grid intervals make a step."""

    def between(k: int, t: float) -> float:
        a, m, b = values[k // 2]
        p = t / h - k // 2
        return float(a + p * (-3.0 * a + 4.0 * m - b) + p**2 * (2.0 * a - 4.0 * m + 2.0 * b))

    return between


def _joined(
    time: Real, response: Real, final: float, tail: ModalTail, horizon: float, early: Between
) -> tuple[Real, Real, float, Between]:
    last, late = time.size - 1, tail.grid(float(time[-1]), max(horizon, 1.01 * float(time[-1])))
    all_time = np.concatenate((time, late))
    all_response = np.concatenate((response, tail.response(late) + final))

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


@dataclass(frozen=True)
class _Lag:
    """A delay in steps: whole steps and, where it is no multiple of the step, the fraction left."""

    whole: NDArray[np.intp]
    part: Real

    @classmethod
    def of(cls, steps: Real) -> _Lag:
        whole = np.floor(steps + 1e-9).astype(int)
        return cls(whole, np.where(np.abs(steps - whole) < 1e-9 * steps, 0.0, steps - whole))


class _Past:
    """Delayed signals: in each step a parabola through its start, middle and end; zero before t = 0."""

    def __init__(self, steps: int, lag: _Lag) -> None:
        q = lag.part.size
        self.start, self.middle, self.end = (np.zeros((steps + 1, q)) for _ in range(3))
        self._lag, self._rows = lag, np.arange(q)

    def at(self, k: int, position: float) -> Real:
        """Signals delayed, at t = (k + position) h with position 0, 1/2 or (the end of a step) 1."""
        step, inside = k - self._lag.whole, position - self._lag.part
        step, inside = np.where(inside < 0.0, step - 1, step), np.where(inside < 0.0, inside + 1.0, inside)
        j = np.maximum(step, 0)
        a, m, b = (table[j, self._rows] for table in (self.start, self.middle, self.end))
        value = a + inside * (-3.0 * a + 4.0 * m - b) + inside**2 * (2.0 * a - 4.0 * m + 2.0 * b)
        return np.where(step >= 0, value, 0.0)


def _stepped(form: DelayForm, h: float, steps: int) -> Real:
    """March: x exactly for delayed signals that are parabolas over a step.

    Returns y at the start, in the middle and at the end of each step (shape (steps + 1, 3)).
    """
    n, q = form.B1.size, form.delays.size
    M = np.zeros((n + 3 * q + 1, n + 3 * q + 1))
    M[:n, :n], M[:n, n : n + q], M[:n, -1] = form.A, form.B2, form.B1
    M[n : n + q, n + q : n + 2 * q] = M[n + q : n + 2 * q, n + 2 * q : n + 3 * q] = np.eye(q)
    to_middle, to_end = expm(M * (0.5 * h))[:n], expm(M * h)[:n]
    past = _Past(steps, _Lag.of(form.delays / h))
    x, y = np.zeros(n), np.empty((steps + 1, 3))

    def v(x: Real, z: Real) -> Real:
        return form.C2 @ x + form.D21 + form.D22 @ z

    for k in range(steps + 1):
        a, m, b = past.at(k, 0.0), past.at(k, 0.5), past.at(k, 1.0)
        state = np.concatenate(
            (x, a, (-3.0 * a + 4.0 * m - b) / h, (4.0 * a - 8.0 * m + 4.0 * b) / h**2, [1.0])
        )
        x_middle, x_end = to_middle @ state, to_end @ state
        past.start[k], past.middle[k], past.end[k] = v(x, a), v(x_middle, m), v(x_end, b)
        y[k] = form.C1 @ x + form.D12 @ a, form.C1 @ x_middle + form.D12 @ m, form.C1 @ x_end + form.D12 @ b
        x = x_end
    return y + form.D11
