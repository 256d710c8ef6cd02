"""Linear systems as matrices and names only: a state space, and one with exact internal delays.

The equations of the latter are those of `actuator_lti.systems.delay_system`, whose python-control systems
are made of these; how two systems are joined and how one is evaluated stands here alone. The python-control
system of a plain one is made where somebody asks for it (`as_control.py`): importing python-control takes a
second, and margins, bandwidths and steps do not need it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag

from actuator_lti.errors import InputError
from actuator_lti.systems.resolvent import responses, solved_at

_ALGEBRAIC = 1e12  # condition of an algebraic loop beyond which it has no solution


@dataclass(frozen=True, eq=False)
class PlainSystem:
    """``x+ = A x + B u, y = C x + D u`` of one input and one output, every ``dt`` seconds; ``dx/dt`` for 0.

    Margins, bandwidths and step figures take it as they take a `control.StateSpace`.
    """

    ninputs: ClassVar[int] = 1
    noutputs: ClassVar[int] = 1

    A: np.ndarray  # shapes (n, n), (n, 1), (1, n), (1, 1)
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    dt: float  # sampling period in s; 0: continuous
    name: str = "loop"  # of the system, its input, its output
    source: str = "u"
    signal: str = "y"
    states: tuple[str, ...] = ()

    def __call__(self, points: npt.ArrayLike) -> Any:
        """The response at complex points (z; s where ``dt`` is 0), of their shape; inf + nan j at a pole."""
        asked = np.asarray(points, dtype=complex)
        return responses(self, asked.reshape(-1)).reshape(asked.shape)[()]

    def poles(self) -> np.ndarray:
        return np.asarray(np.linalg.eigvals(self.A).astype(complex) if self.A.size else np.empty(0, complex))


@dataclass(frozen=True, eq=False, kw_only=True)
class PlainDelaySystem:
    """``dx/dt = A x + B1 u + B2 z``, ``y = C1 x + D11 u + D12 z``, ``v = C2 x + D21 u + D22 z``.

    The delays: ``z_k(t) = v_k(t - delays_k)``. Margins, bandwidths and step figures take it as they take a
    `actuator_lti.systems.delay_system.DelaySystem`.
    """

    dt: ClassVar[float] = 0.0
    parts: ClassVar[tuple[str, ...]] = ("A", "B1", "B2", "C1", "C2", "D11", "D12", "D21", "D22")

    A: np.ndarray  # shapes (n,n), (n,m), (n,k), (p,n), (k,n), (p,m), (p,k), (k,m), (k,k)
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D11: np.ndarray
    D12: np.ndarray
    D21: np.ndarray
    D22: np.ndarray
    delays_s: np.ndarray  # each > 0
    states: tuple[str, ...] = ()  # empty where they have no names of their own
    name: str = "loop"  # of the system, its input, its output
    source: str = "u"
    signal: str = "y"

    def __post_init__(self) -> None:
        for part in self.parts:
            if not np.isfinite(getattr(self, part)).all():
                raise InputError(f"{part}: every entry must be finite")

    @property
    def ninputs(self) -> int:
        return int(self.D11.shape[1])

    @property
    def noutputs(self) -> int:
        return int(self.D11.shape[0])

    @property
    def delay_free(self) -> bool:
        return len(self.delays_s) == 0

    def to_state_space(self) -> PlainSystem:
        """The same as a `PlainSystem`; refused (`InputError`) where there are delays."""
        if not self.delay_free:
            raise InputError("a system with delays is no finite state space")
        parts = (self.A, self.B1, self.C1, self.D11, 0.0)
        return PlainSystem(*parts, self.name, self.source, self.signal, self.states)

    def __call__(self, points: npt.ArrayLike) -> Any:
        """The response of one input and one output at complex s, exactly; of the shape of ``points``."""
        asked = np.asarray(points, dtype=complex)
        return response(self, asked.reshape(-1))[0, 0].reshape(asked.shape)[()]

    def feedback(self, other: PlainDelaySystem | None = None, sign: int = -1) -> PlainDelaySystem:
        """Closed loop ``self / (1 - sign self other)``, ``other`` 1 where left out.

        Raises `InputError`: if the delay-free path round the loop is algebraic and without a solution.
        """
        back = static(np.eye(self.ninputs, self.noutputs)) if other is None else other
        m, p = self.ninputs, self.noutputs
        if (back.ninputs, back.noutputs) != (p, m):
            raise InputError(
                f"feedback: {p} outputs into {back.ninputs} inputs, {back.noutputs} back into {m}"
            )
        loop = np.eye(m + p, p + m, k=-m) + sign * np.eye(m + p, p + m, k=p)  # forth, and back
        return joined_by(self, back, np.eye(m + p, m), np.eye(p, p + m), loop)

    def named(self, name: str, source: str, signal: str) -> PlainDelaySystem:
        return replace(self, name=name, source=source, signal=signal)


def static(gain: np.ndarray) -> PlainDelaySystem:
    p, m = gain.shape
    none, inward, outward = np.zeros((0, 0)), np.zeros((0, m)), np.zeros((p, 0))
    return PlainDelaySystem(
        A=none, B1=inward, B2=none, C1=outward, C2=none, D11=gain, D12=outward, D21=inward, D22=none,
        delays_s=np.zeros(0),
    )  # fmt: skip


def in_series(first: PlainDelaySystem, second: PlainDelaySystem) -> PlainDelaySystem:
    if first.noutputs != second.ninputs:
        raise InputError(f"series: {first.noutputs} outputs into {second.ninputs} inputs")
    m, q, p = first.ninputs, first.noutputs, second.noutputs
    return joined_by(first, second, np.eye(m + q, m), np.eye(p, q + p, k=q), np.eye(m + q, q + p, k=-m))


def in_parallel(a: PlainDelaySystem, b: PlainDelaySystem) -> PlainDelaySystem:
    if (a.ninputs, a.noutputs) != (b.ninputs, b.noutputs):
        raise InputError("parallel connection: both systems need the same numbers of signals")
    source = np.vstack([np.eye(a.ninputs)] * 2)
    sink = np.hstack([np.eye(a.noutputs)] * 2)
    return joined_by(a, b, source, sink, np.zeros((2 * a.ninputs, 2 * a.noutputs)))


def joined_by(
    a: PlainDelaySystem, b: PlainDelaySystem, source: np.ndarray, sink: np.ndarray, loop: np.ndarray
) -> PlainDelaySystem:
    """Both systems side by side, their inputs ``e = source u + loop y``, the output ``sink y``."""
    both = (block_diag(getattr(a, part), getattr(b, part)) for part in a.parts)
    A, B1, B2, C1, C2, D11, D12, D21, D22 = both
    algebra = np.eye(D11.shape[0]) - D11 @ loop
    if np.linalg.cond(algebra) > _ALGEBRAIC:
        raise InputError("feedback: an algebraic loop without a solution (1 + L(infinity) = 0)")
    # y = (I - D11 loop)^-1 (C1 x + D11 source u + D12 z)
    Cy, Dy, Zy = (np.linalg.solve(algebra, M) for M in (C1, D11 @ source, D12))
    Ce, De, Ze = loop @ Cy, source + loop @ Dy, loop @ Zy
    labels = (*a.states, *b.states)
    return PlainDelaySystem(
        A=A + B1 @ Ce, B1=B1 @ De, B2=B2 + B1 @ Ze,
        C1=sink @ Cy, C2=C2 + D21 @ Ce,
        D11=sink @ Dy, D12=sink @ Zy, D21=D21 @ De, D22=D22 + D21 @ Ze,
        delays_s=np.concatenate([a.delays_s, b.delays_s]),
        states=labels if len(set(labels)) == len(A) else (),
    )  # fmt: skip


def descriptor(system: Any, s: np.ndarray) -> np.ndarray:
    """[[sI - A, -B2 E], [-C2, I - D22 E]] with E = diag(exp(-s delays)), stacked over s."""
    n, k = system.A.shape[0], len(system.delays_s)
    E = np.exp(-s[:, None] * system.delays_s)
    M = np.empty((len(s), n + k, n + k), dtype=complex)
    M[:, :n, :n] = s[:, None, None] * np.eye(n) - system.A
    M[:, :n, n:] = -system.B2 * E[:, None, :]
    M[:, n:, :n] = -system.C2
    M[:, n:, n:] = np.eye(k) - system.D22 * E[:, None, :]
    return M


def period_of(system: Any) -> float | None:
    """Sampling period, s; 1 where it is not stated (``True``), ``None`` where continuous."""
    return float(system.dt) if system.dt else None


def response(system: Any, points: np.ndarray) -> np.ndarray:
    """Response at complex s, shape (outputs, inputs, points); inf + nan j at a pole."""
    E = np.exp(-points[:, None] * system.delays_s)
    M = descriptor(system, points)
    right = np.broadcast_to(
        np.vstack([system.B1, system.D21]), (len(points), M.shape[1], system.D11.shape[1])
    )
    inner = solved_at(M, right)
    n = system.A.shape[0]
    y = system.D11 + system.C1 @ inner[:, :n] + (system.D12 * E[:, None, :]) @ inner[:, n:]
    y[~np.isfinite(inner).all(axis=(1, 2))] = complex(np.inf, np.nan)
    return np.asarray(np.moveaxis(y, 0, -1))
