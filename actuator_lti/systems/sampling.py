"""Exact sampling of a held and delayed input, without approximation of the delay (model.md section 2, 3).

Matrices may be stacked: shape (..., n, n), with a period and a delay for each, all with as many whole ticks
of delay and all or none with a fraction (see `split_delay`).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm, matrix_balance

from actuator_lti.errors import InputError

_EDGE = 1e-9  # of a tick: a delay closer than this to a whole number of ticks is that number
_MILD = 64.0  # norm up to which an exponential is squared seven times at most


def split_delay(delay_s: Any, period_s: Any) -> tuple[Any, Any]:
    """Whole ticks q and fraction f in [0, 1) of a delay d = (q + f) Ts; arrays for arrays.

    >>> split_delay(3e-4, 1e-4), split_delay(1.5e-4, 1e-4)
    ((3, 0.0), (1, 0.5))
    """
    if not (np.all(np.asarray(delay_s) >= 0) and np.all(np.asarray(period_s) > 0)):
        raise InputError(f"delay {delay_s} s, period {period_s} s: a delay >= 0 and a period > 0")
    ticks = np.asarray(delay_s / period_s)
    whole = np.floor(ticks + _EDGE)
    rest = ticks - whole
    fraction = np.where(rest > _EDGE, np.round(rest, 14), 0.0)
    if ticks.ndim == 0:
        return int(whole), float(fraction)
    return whole.astype(int), fraction


def held_step(A: np.ndarray, B: np.ndarray, duration_s: Any) -> tuple[np.ndarray, np.ndarray]:
    """``x(t + h) = Phi x(t) + Gamma u`` for u held over h: both from one exponential, balanced first.

    A has the shape (..., n, n), B (..., n, m), h >= 0 (...); an h of zero gives the unit matrix and zero.
    """
    n, m = B.shape[-2:]
    h = np.asarray(duration_s)[..., None, None]
    stack = np.broadcast_shapes(A.shape[:-2], B.shape[:-2], h.shape[:-2])
    M = np.zeros((*stack, n + m, n + m))
    M[..., :n, :n], M[..., :n, n:] = A * h, B * h
    E = _exponential(M)
    return E[..., :n, :n], E[..., :n, n:]


def _exponential(M: np.ndarray) -> np.ndarray:
    """expm of each matrix, its states scaled by powers of two first; no matrix depends on its neighbours."""
    if M.ndim == 2:
        balanced, scale = matrix_balance(M, permute=False)
        d = np.diag(scale)
        return np.asarray(d[:, None] * expm(balanced) / d[None, :])
    d = _scales(M)
    balanced = M * d[..., None, :] / d[..., :, None]
    norm = np.abs(balanced).sum(-1).max(-1)
    stiff = norm > _MILD
    E = _mild_exponential(np.where(stiff[..., None, None], 0.0, balanced), np.where(stiff, 0.0, norm))
    if stiff.any():
        E[stiff] = expm(balanced[stiff])
    return np.asarray(d[..., :, None] * E / d[..., None, :])


def _mild_exponential(M: np.ndarray, norm: np.ndarray) -> np.ndarray:
    """Taylor's series of order 14 after halving to norm 1/2, then squaring: scipy has no batched routine.

    scipy's expm takes one matrix after the other, 13 us each; this takes 2. Every squaring doubles the
    rounding, so that it is left to scipy where there are many.
    """
    halvings = np.maximum(np.ceil(np.log2(np.maximum(norm, 0.5) / 0.5)), 0.0)
    X = M * (0.5**halvings)[..., None, None]
    one = np.eye(M.shape[-1])
    E = one + X / 14
    for order in range(13, 0, -1):
        E = one + (X @ E) / order
    for k in range(int(halvings.max(initial=0.0))):
        E = np.where((halvings > k)[..., None, None], E @ E, E)
    return E


def _scales(M: np.ndarray, rounds: int = 8) -> np.ndarray:
    """Powers of two d with rows and columns of D^-1 M D of like size (Parlett and Reinsch 1969), stacked."""
    off = np.abs(M) * (1 - np.eye(M.shape[-1]))
    d, still = np.ones(M.shape[:-1]), 0
    tied = (off.sum(-1) > 0) & (off.sum(-2) > 0)  # to others both ways; nothing else is out of balance
    places = np.flatnonzero(tied.reshape(-1, M.shape[-1]).any(0))
    for k in np.tile(places, rounds):
        row = np.add.reduce(off[..., k, :] * d, -1) / d[..., k]
        column = np.add.reduce(off[..., :, k] / d, -1) * d[..., k]
        ratio = np.divide(row, column, out=np.ones(row.shape), where=tied[..., k])
        power = np.rint(0.5 * np.log2(ratio))
        still += 1
        if np.count_nonzero(power):
            d[..., k] *= 2.0**power
            still = 0
        if still == places.size:
            break
    return d


@dataclass(frozen=True)
class DelayedHold:
    """One tick of a plant behind a zero-order hold that lags by d = (q + f) Ts.

    ``x+ = Phi x + sum_j gains[j] u_{k-j} + Gamma_T T``: u_{k-q-1} still acts for f Ts, then u_{k-q}.
    """

    Phi: np.ndarray  # shape (..., n, n)
    # by ticks j: effect (..., n) of the input computed j ticks ago; one entry (q), or two (and q + 1)
    gains: dict[int, np.ndarray]
    Gamma_T: np.ndarray  # effect of the second input, held over the tick without delay

    @property
    def memory(self) -> int:
        """How many past inputs the tick needs."""
        return max(self.gains)


def delayed_hold(A: np.ndarray, B: np.ndarray, B_T: np.ndarray, period_s: Any, delay_s: Any) -> DelayedHold:
    """Sample a plant exactly, its first input behind a hold with a delay, its second merely held.

    An integrator with 1.25 ticks of delay: u two ticks ago acts for a quarter of the tick.

    >>> import numpy as np
    >>> tick = delayed_hold(np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)), 1.0, 1.25)
    >>> {j: round(float(g[0]), 12) for j, g in tick.gains.items()}
    {1: 0.75, 2: 0.25}
    """
    q, f = split_delay(delay_s, period_s)
    whole = int(np.max(q))
    if np.any(q != whole) or np.any((f == 0.0) != (np.max(f) == 0.0)):
        raise InputError("computing_delay: stacked designs need as many whole ticks each, and all a fraction")
    stack = np.broadcast_shapes(A.shape[:-2], B.shape[:-2], B_T.shape[:-2])
    both = np.concatenate([np.broadcast_to(each, (*stack, *each.shape[-2:])) for each in (B, B_T)], axis=-1)
    Phi, Gamma = held_step(A, both, period_s)
    Gamma_u, Gamma_T = Gamma[..., 0], Gamma[..., 1:]
    if np.max(f) == 0.0:
        return DelayedHold(Phi, {whole: Gamma_u}, Gamma_T)
    Phi_new, Gamma_new = held_step(A, B, (1 - f) * period_s)
    _, Gamma_old = held_step(A, B, f * period_s)
    return DelayedHold(Phi, {whole: Gamma_new[..., 0], whole + 1: (Phi_new @ Gamma_old)[..., 0]}, Gamma_T)
