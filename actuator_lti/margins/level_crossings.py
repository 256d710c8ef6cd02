"""Frequencies at which L meets a circle or the real axis, as eigenvalues (no grid, no polynomial).

With L~(s) = L(-s) (sampled: L(1/z)) every circle about the real axis is the zero set on the border of
stability of q(s) = a L L~ + b (L + L~) + e: (a, b, e) = (1, 0, -1) is |L| = 1, (1, 1, 1 - m^2)
is |1 + L| = m; the real axis is L - L~ = 0. The zeros of q are the eigenvalues of a Hamiltonian matrix
(Boyd, Balakrishnan, Kabamba 1989; Bruinsma, Steinbuch 1990), or of a pencil where q vanishes at infinity,
and for a sampled loop of a symplectic pencil. All of these are brought to one plain eigenvalue problem by the
real Moebius map sigma = 1/(s - s0), s = (z - 1)/(z + 1) for a sampled loop: s0 is chosen so that q(s0)
is not zero, A may be singular (delays z^-q) and may have an eigenvalue at z = -1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgeev

from actuator_lti.errors import NumericalError
from actuator_lti.margins.loop import Complex, RationalLoop, Real

NEAR_AXIS = 0.1
_DEGENERATE = 1e-9


def warped(x: Real, in_z: bool) -> Real:
    """Frequency in the s-plane of the bilinear map: x itself, or tan(x/2) for a sampled loop."""
    return np.tan(0.5 * x) if in_z else x


def unwarped(w: Real, in_z: bool) -> Real:
    """Inverse of `warped`."""
    return 2.0 * np.arctan(w) if in_z else w


@dataclass(frozen=True)
class ShiftedLoop:
    """Both halves: L(s) = l_plus - c_plus (sigma - W_plus)^-1 b_plus, and
    L(-s) = l_minus + c_minus (sigma + W_minus)^-1 b_minus.
    """

    shift: float
    l_plus: float
    l_minus: float
    W_plus: Real
    W_minus: Real
    b_plus: Real
    b_minus: Real
    c_plus: Real
    c_minus: Real

    def circle(self, a: float, b: float, e: float) -> Complex | None:
        """All s with a L L~ + b (L + L~) + e = 0; ``None`` where the shift does not allow it."""
        product, total = self.l_plus * self.l_minus, self.l_plus + self.l_minus
        D = a * product + b * total + e
        if abs(D) <= _DEGENERATE * (
            abs(a * product) + abs(b) * (abs(self.l_plus) + abs(self.l_minus)) + abs(e)
        ):
            return None
        n = self.b_plus.size
        H = np.zeros((2 * n, 2 * n))
        B, C = np.empty(2 * n), np.empty(2 * n)
        B[:n], B[n:] = self.b_plus, self.b_minus * (a * self.l_plus + b)
        C[:n], C[n:] = self.c_plus * (-(a * self.l_minus + b)), self.c_minus
        H[:n, :n], H[n:, n:] = self.W_plus, -self.W_minus
        if a:
            H[n:, :n] = (-a * self.b_minus)[:, None] * self.c_plus
        return self._zeros(H, B, C, D)

    def real_axis(self) -> Complex | None:
        """All s with L(s) = L(-s), but for s = 0 and infinity."""
        D = self.l_plus - self.l_minus
        if abs(D) <= _DEGENERATE * (abs(self.l_plus) + abs(self.l_minus)):
            return None
        n = self.b_plus.size
        H = np.zeros((2 * n, 2 * n))
        H[:n, :n], H[n:, n:] = self.W_plus, -self.W_minus
        B = np.concatenate((self.b_plus, self.b_minus))
        C = np.concatenate((self.c_plus, self.c_minus))
        return self._zeros(H, B, -C, D)

    def _zeros(self, H: Real, B: Real, C: Real, D: float) -> Complex:
        H -= (B / D)[:, None] * C
        if not np.isfinite(H).all():
            raise NumericalError("the Hamiltonian matrix overflows: rescale the loop")
        re, im, _, _, info = dgeev(H, compute_vl=0, compute_vr=0, overwrite_a=1)
        if info:
            raise NumericalError(
                "the eigenvalues of the Hamiltonian matrix did not converge: rescale the loop"
            )
        sigma = re[im <= 0.0] + 1j * im[im <= 0.0]  # the upper half plane of s
        return self.shift + 1.0 / sigma[sigma != 0.0]


def shifted(loop: RationalLoop, shift: float) -> ShiftedLoop:
    """Apply sigma = 1/(s - shift) to L(s) and L(-s)."""
    A, b, c, d = loop.A, loop.b, loop.c, loop.d
    eye = np.eye(loop.order)
    if loop.in_z:
        plus = np.linalg.inv((1.0 - shift) * A - (1.0 + shift) * eye)
        minus = np.linalg.inv((1.0 + shift) * A - (1.0 - shift) * eye)
        gain, scale_plus, scale_minus = np.sqrt(2.0), 1.0 - shift, 1.0 + shift
        W_plus, W_minus = plus + A @ plus, minus + A @ minus
    else:
        W_plus = plus = np.linalg.inv(A - shift * eye)
        W_minus = minus = np.linalg.inv(A + shift * eye)
        gain = scale_plus = scale_minus = 1.0
    plus_b, minus_b = plus @ b, minus @ b
    return ShiftedLoop(
        shift=shift,
        l_plus=d - scale_plus * float(c @ plus_b),
        l_minus=d - scale_minus * float(c @ minus_b),
        W_plus=W_plus,
        W_minus=W_minus,
        b_plus=gain * plus_b,
        b_minus=gain * minus_b,
        c_plus=gain * (c @ plus),
        c_minus=gain * (c @ minus),
    )


class LevelCrossings:
    """Candidates for the crossings of one loop; changes the shift where the first one does not do.

    Parameters
    ----------
    loop : RationalLoop
        At least one state.
    poles : array (n,), complex
        Eigenvalues of A, to keep the shift away from them.
    """

    def __init__(self, loop: RationalLoop, poles: Complex) -> None:
        self._loop = loop
        self._shifts = _shifts(loop, poles)
        self._tried: dict[int, ShiftedLoop] = {}

    def _system(self, k: int) -> ShiftedLoop:
        if k not in self._tried:
            self._tried[k] = shifted(self._loop, float(self._shifts[k]))
        return self._tried[k]

    def circle(self, a: float, b: float, e: float) -> Complex | None:
        """All s on the circle (see module); ``None`` if every frequency is on it."""
        return self._zeros(lambda system: system.circle(a, b, e))

    def real_axis(self) -> Complex | None:
        """All s at which L is real, but for 0 and infinity; ``None`` if L is real at every frequency."""
        return self._zeros(lambda system: system.real_axis())

    def _zeros(self, equation: Callable[[ShiftedLoop], Complex | None]) -> Complex | None:
        for k in range(len(self._shifts)):
            zeros = equation(self._system(k))
            if zeros is not None:
                return zeros
        return None


def on_axis(zeros: Complex) -> Complex:
    """Those zeros near the border of stability, sorted by frequency; the caller verifies each."""
    w = zeros.imag
    near = zeros[(np.abs(zeros.real) <= NEAR_AXIS * w) & (w > 0.0) & (w < np.inf)]
    return near[near.imag.argsort()]


def _values(loop: RationalLoop, points: Real) -> Real:
    """L at real points; NaN where a pole stands exactly at one."""
    try:
        return np.asarray(loop.at(points))
    except np.linalg.LinAlgError:
        if points.size == 1:
            return np.full(1, np.nan)
        return np.concatenate([_values(loop, points[k : k + 1]) for k in range(points.size)])


def _shifts(loop: RationalLoop, poles: Complex) -> Real:
    r"""Shifts in order of merit: L(+-shift) not above one, far from the poles, near their mean frequency.

    Where |L(shift)| were large, the one of |L| = 1 would be lost beside it in rounding.
    """
    if loop.in_z:
        poles = (poles - 1.0) / np.where(poles == -1.0, 1e-300, poles + 1.0)
    size = np.abs(poles)
    usable = size[(size > 1e-9 * min(size.max(), 1e9)) & (size < 1e9)]
    logs = np.log(usable) if usable.size else np.zeros(1)
    centre = float(logs.mean())
    spread = float(logs.max()) - float(logs.min())
    position = np.linspace(-0.5 * spread - 7.0, 0.5 * spread + 7.0, 15) + 0.077
    shifts = np.exp(centre + position)
    points = np.concatenate((shifts, -shifts))
    if loop.in_z:
        points = (1.0 + points) / (1.0 - points)
    with np.errstate(all="ignore"):
        gain = np.log(np.maximum(np.abs(_values(loop, points)), 1.0)).reshape(2, -1).max(axis=0)
    distance = np.abs(np.abs(poles.real)[:, None] + 1j * poles.imag[:, None] - shifts).min(axis=0) / shifts
    cost = gain + 0.5 * np.abs(position) - 3.0 * np.log(np.minimum(distance, 0.2) + 1e-30)
    return shifts[np.argsort(np.nan_to_num(cost, nan=1e9, posinf=1e9), kind="stable")]
