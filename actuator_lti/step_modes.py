"""Step response of a system with delays as the sum over its exact poles, once a few delays have passed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.margins.delay_form import DelayForm, characteristic
from actuator_lti.margins.loop import Complex, Real

_FORGOTTEN = 25.0  # time constants
_NEWTON = 8


@dataclass(frozen=True)
class ModalTail:
    """Deviation of a unit step response from its final value: the real part of sum(weight exp(pole t)).

    Attributes
    ----------
    poles, weights : arrays (m,), complex
        Poles of the upper half plane (real ones included); a pair counts in one weight.
    """

    poles: Complex
    weights: Complex

    def response(self, time: Real) -> Real:
        """The deviation at the times given, s."""
        return (np.exp(time[:, None] * self.poles) @ self.weights).real


def modal_tail(form: DelayForm, poles: Complex, start: float) -> ModalTail:
    """Sharpen the poles that are still alive after ``start`` (s), and weigh them by their residues in T/s.

    Parameters
    ----------
    form : DelayForm
        The closed loop T, no delay in series.
    poles : array, complex
        Estimates from the collocation.
    """
    alive = (poles.real > -_FORGOTTEN / start) & (poles.imag >= 0.0) & (poles.real < 0.0)
    result: list[complex] = []
    weights: list[complex] = []
    for estimate in poles[alive]:
        pole, residue = _sharpened(form, complex(estimate))
        if pole is None or any(abs(pole - p) <= 1e-9 * abs(p) for p in result):
            continue
        result.append(pole)
        weights.append(residue / pole * (1.0 if abs(pole.imag) <= 1e-12 * abs(pole) else 2.0))
    return ModalTail(np.array(result, dtype=complex), np.array(weights, dtype=complex))


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
    if abs(start.imag) <= 1e-9 * abs(start):
        pole = complex(pole.real)
    if abs(pole - start) > 0.1 * abs(start):
        return None, 0j
    return pole, complex(row @ w) * complex(u.conj() @ column) / below
