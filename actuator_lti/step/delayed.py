"""Step response of a system with inner delays: walked along the first of them, then by its poles."""

from dataclasses import replace
from typing import Any

import numpy as np
from flint import acb_mat

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.delays.form import DelayForm, delay_form
from actuator_lti.margins.loop import balanced
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.step.motion import LOST, NO_FINAL, UNSTABLE, Motion
from actuator_lti.step.search import Pieces
from actuator_lti.systems.delay_response import DelayResponse
from actuator_lti.systems.delay_stepper import MOST_PIECES, DelayStepper
from actuator_lti.systems.plain_system import response
from actuator_lti.types import Complex, Real

_FIRST = 10.0  # longest delays to walk at first
_MEET = 1e-7
_POINTS = 32
_ZERO = 1e-12  # of the largest response about the poles
_OFTEN = "the step response is too long beside its delays: what it settles to is known, when is not"
_FORGOTTEN = 25.0  # time constants
_RADIUS = 0.25  # of the circle about a pole, of the way to what lies next
_TURN = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)


def delayed_response(system: Any) -> tuple[Motion, float, Pieces]:
    """How the unit step response of a system with inner delays ends, its final value, and how it begins.

    The first delays are walked along; after them the response is the free motion of the exact poles, which
    the collocation of the delays starts and integrals of T about them sharpen. The two have to agree
    where they meet, to 1e-7 of the final value; otherwise the walk goes on.
    """
    form = delay_form(system)
    form = replace(form, whole=balanced(form.whole))
    poles, at_rest = sorted_poles(collocated(form, _POINTS), False), DelayResponse.of(form)
    if at_rest.order > 0 or poles.unstable or poles.at_limit > 1:
        raise InputError(UNSTABLE)
    if at_rest.order:
        raise InputError(NO_FINAL)
    final, around = at_rest.lead, 1j * np.abs(poles.values[np.abs(poles.values) > 0.0])
    if abs(final) <= _ZERO * float(np.abs(response(system, around)).max(initial=0.0)):
        raise NumericalError(LOST)
    head, u = _FIRST * float(form.delays_s.max()), np.ones(1)
    walk = DelayStepper(system, 0.0, np.zeros(form.states), u)
    while head <= MOST_PIECES * float(form.delays_s.min()):
        try:
            walk.at(head, u)
        except InputError:  # more pieces than it takes
            break
        begins, lengths, series = walk.pieces()
        series = series[..., 0] / final
        series[:, -1] -= 1.0
        exact, weights = _modes(system, poles.values, head)
        late = begins > 0.75 * head
        modes = (np.exp(np.outer(begins[late], exact)) @ weights).real / final
        if np.abs(modes - series[late, -1]).max() <= _MEET:
            n, state = exact.size, weights * np.exp(exact * head) / final
            A = acb_mat(n, n, [complex(p) for p in np.diag(exact).ravel()])
            return Motion(A, np.ones(n), state, False, head), final, (begins, lengths, series)
        head *= 2.0
    raise NumericalError(_OFTEN)


def collocated(form: DelayForm, points: int) -> Real:
    """State matrix of a system with its inner delays collocated (a delay in series has no poles).

    A delay tau is the line dq/dt = -(1/tau) dq/dx, 0 <= x <= 1, with the input at x = 0 and the output at
    x = 1. Eigenvalues with |s| tau well below the number of points are those of the exact delay to near
    machine precision (Breda, Maset, Vermiglio 2005).
    """
    n, q = form.states, form.delays_s.size
    inner = form.whole[:-1, :-1]
    x = 0.5 * (1.0 - np.cos(np.pi * np.arange(points + 1) / points))
    weight = np.array([0.5, *(-1.0) ** np.arange(1, points), 0.5 * (-1.0) ** points])
    D = weight / weight[:, None] / (x[:, None] - x + np.eye(points + 1))
    D = (D - np.diag(D.sum(axis=1)))[1:]  # Berrut and Trefethen, SIAM Review 46, 2004, section 9.3
    ends = np.kron(np.eye(q), np.eye(points)[-1:])
    rates = np.diag(-1.0 / form.delays_s)
    begins = np.kron(rates, D[:, :1])
    lines = np.kron(rates, D[:, 1:]) + begins @ inner[n:, n:] @ ends
    return np.block([[inner[:n, :n], inner[:n, n:] @ ends], [begins @ inner[n:, :n], lines]])


def _modes(system: Any, poles: Complex, start: float) -> tuple[Complex, Complex]:
    """Poles still alive after ``start`` (s), of the upper half plane, and the weights of each or its pair.

    Both from the exact T on a circle about each estimate that holds no other: the mean of T z is the residue,
    that of T z^2 over it how far the pole lies off. The weight is the residue of T/s.
    """
    near = poles[(poles.real > -_FORGOTTEN / start) & (poles.imag >= 0.0) & (poles.real < 0.0)]
    apart = np.abs(near[:, None] - np.append(poles, 0.0))
    apart[apart == 0.0] = np.inf
    z = _RADIUS * apart.min(axis=1)[:, None] * _TURN
    weighted = response(system, (near[:, None] + z).ravel())[0, 0].reshape(z.shape) * z
    residue = weighted.mean(axis=1)
    shown = np.abs(residue) > _ZERO * np.abs(weighted).max(axis=1)  # T has a pole there
    near, residue, off = near[shown], residue[shown], (weighted * z)[shown].mean(axis=1) / residue[shown]
    real = near.imag == 0.0
    exact = near + np.where(real, off.real, off)
    return exact, np.where(real, residue.real, 2.0 * residue) / exact
