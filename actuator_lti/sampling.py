"""Exact sampling of a held and delayed input, without approximation of the delay (model.md section 2, 3)."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np
from scipy.linalg import expm, matrix_balance

from actuator_lti.errors import InputError

_EDGE = 1e-9  # of a tick: a delay closer than this to a whole number of ticks is that number


def split_delay(delay_s: float, period_s: float) -> tuple[int, float]:
    """Whole ticks q and fraction f in [0, 1) of a delay d = (q + f) Ts.

    Examples
    --------
    >>> split_delay(3e-4, 1e-4), split_delay(1.5e-4, 1e-4)
    ((3, 0.0), (1, 0.5))
    """
    if not (delay_s >= 0 and period_s > 0):
        raise InputError(f"delay {delay_s} s, period {period_s} s: a delay >= 0 and a period > 0")
    ticks = delay_s / period_s
    whole = floor(ticks + _EDGE)
    fraction = ticks - whole
    return whole, round(fraction, 14) if fraction > _EDGE else 0.0


def held_step(A: np.ndarray, B: np.ndarray, duration_s: float) -> tuple[np.ndarray, np.ndarray]:
    """``x(t + h) = Phi x(t) + Gamma u`` for u held over h: both from one exponential, balanced first.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    B : ndarray, shape (n, m)
    duration_s : float
        h >= 0; zero gives the unit matrix and zero.
    """
    n, m = B.shape
    M = np.zeros((n + m, n + m))
    M[:n, :n], M[:n, n:] = A * duration_s, B * duration_s
    balanced, scale = matrix_balance(M, permute=False)
    d = np.diag(scale)
    E = d[:, None] * expm(balanced) / d[None, :]
    return E[:n, :n], E[:n, n:]


@dataclass(frozen=True)
class DelayedHold:
    """One tick of a plant behind a zero-order hold that lags by d = (q + f) Ts.

    ``x+ = Phi x + sum_j gains[j] u_{k-j} + Gamma_T T``: u_{k-q-1} still acts for f Ts, then u_{k-q}.

    Attributes
    ----------
    Phi : ndarray, shape (n, n)
    gains : dict of int to ndarray, shape (n,)
        Effect of the input computed j ticks ago; one entry (q), or two (q and q + 1) for a fractional delay.
    Gamma_T : ndarray, shape (n, m)
        Effect of the second input, held over the tick without delay.
    """

    Phi: np.ndarray
    gains: dict[int, np.ndarray]
    Gamma_T: np.ndarray

    @property
    def memory(self) -> int:
        """How many past inputs the tick needs."""
        return max(self.gains)


def delayed_hold(
    A: np.ndarray, B: np.ndarray, B_T: np.ndarray, period_s: float, delay_s: float
) -> DelayedHold:
    """Sample a plant exactly, its first input behind a hold with a delay, its second merely held.

    Examples
    --------
    An integrator with 1.25 ticks of delay: u two ticks ago acts for a quarter of the tick.

    >>> import numpy as np
    >>> tick = delayed_hold(np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)), 1.0, 1.25)
    >>> {j: round(float(g[0]), 12) for j, g in tick.gains.items()}
    {1: 0.75, 2: 0.25}
    """
    q, f = split_delay(delay_s, period_s)
    Phi, Gamma_T = held_step(A, B_T, period_s)
    if f == 0.0:
        return DelayedHold(Phi, {q: held_step(A, B, period_s)[1][:, 0]}, Gamma_T)
    Phi_new, Gamma_new = held_step(A, B, (1 - f) * period_s)
    _, Gamma_old = held_step(A, B, f * period_s)
    return DelayedHold(Phi, {q: Gamma_new[:, 0], q + 1: (Phi_new @ Gamma_old)[:, 0]}, Gamma_T)
