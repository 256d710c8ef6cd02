"""Step response of a system with inner delays: walked along the first of them, then by its poles."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import flint
import numpy as np
from scipy.interpolate import BarycentricInterpolator

from actuator_lti.errors import InputError
from actuator_lti.margins.delays.form import DelayForm, delay_form
from actuator_lti.margins.loop import balanced
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.step.motion import NO_FINAL, UNSTABLE, Motion, Spans, Undecided
from actuator_lti.systems.delay_response import DelayResponse
from actuator_lti.systems.delay_stepper import MOST_PIECES, DelayStepper
from actuator_lti.systems.plain_system import response
from actuator_lti.types import Complex, Real

_FIRST = 10.0  # longest delays to walk at first
_MEET = 1e-7
_POINTS = 32
_ZERO = 1e-12  # of the largest response about the poles
_FORGOTTEN = 25.0  # time constants
_CIRCLE, _AROUND = 0.25, 32  # radius, of the way to what lies next, and points on it


class Stepped:
    """The first part of the response, over each piece a power series of the part of it."""

    sampled, tie = False, 0.0

    def __init__(self, begins: Real, lengths: Real, series: Real) -> None:
        self._begins, self._lengths, self._series = begins, lengths, series

    def spans(self, undecided: Undecided, of: Callable[[Real], Real]) -> Spans:
        """See `actuator_lti.step.motion.Motion.spans`."""
        a, h, series = self._begins, self._lengths, self._series
        left, right = of(series[:, -1]), of(series.sum(axis=1))
        most = left + np.abs(series[:, :-1]).sum(axis=1)
        keep = undecided(a, a + h, left, right, most)
        return list(zip(a[keep], h[keep], series[keep], strict=True))

    def curve(self, end: float, count: int) -> tuple[Real, Real]:
        """Times up to ``end``, and e there."""
        time = np.linspace(0.0, end, count)
        k = np.searchsorted(self._begins, time, side="right") - 1
        powers = np.vander((time - self._begins[k]) / self._lengths[k], self._series.shape[1])
        return time, (powers * self._series[k]).sum(axis=1)


def delayed_response(system: Any) -> tuple[Stepped, Motion, float]:
    """Unit step response of a system with inner delays over its final value, and that value.

    The first delays are walked along; after them the response is the free motion of the exact poles, which
    the collocation of the delays starts and integrals of T about them sharpen. The two have to agree
    where they meet, to 1e-7 of the final value; otherwise the walk goes on.
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
    if head > MOST_PIECES * float(form.delays_s.min()):
        raise InputError("the step response lasts too many delays to be stepped")
    walk, u = DelayStepper(system, 0.0, np.zeros(form.states), np.ones(1)), np.ones(1)
    while True:
        walk.at(head, u)
        begins, lengths, series = walk.pieces()
        series = series[..., 0] / final
        series[:, -1] -= 1.0
        exact, weights = _modes(system, poles.values, head)
        late = begins > 0.75 * head
        modes = (np.exp(np.outer(begins[late], exact)) @ weights).real / final
        if np.abs(modes - series[late, -1]).max() <= _MEET:
            n = exact.size
            A = flint.acb_mat(n, n, [complex(p) for p in np.diag(exact).ravel()])
            state = weights * np.exp(exact * head) / final
            return Stepped(begins, lengths, series), Motion(A, np.ones(n), state, False, head), final
        head *= 2.0


def collocated(form: DelayForm, points: int) -> Real:
    """State matrix of a system with its inner delays collocated (a delay in series has no poles).

    A delay tau is the line dq/dt = -(1/tau) dq/dx, 0 <= x <= 1, with the input at x = 0 and the output at
    x = 1. Eigenvalues with |s| tau well below the number of points are those of the exact delay to near
    machine precision (Breda, Maset, Vermiglio 2005).
    """
    n, q = form.states, form.delays_s.size
    inner = form.whole[:-1, :-1]
    x = 0.5 * (1.0 - np.cos(np.pi * np.arange(points + 1) / points))
    D = BarycentricInterpolator(x, np.eye(points + 1)).derivative(x)[1:]
    ends = np.kron(np.eye(q), np.eye(points)[-1:])
    rates = np.diag(-1.0 / form.delays_s)
    begins = np.kron(rates, D[:, :1])
    lines = np.kron(rates, D[:, 1:]) + begins @ inner[n:, n:] @ ends
    return np.block([[inner[:n, :n], inner[:n, n:] @ ends], [begins @ inner[n:, :n], lines]])


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
