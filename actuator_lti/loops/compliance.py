"""The compliance of a drive at its output: the response to a load torque held over every tick.

Slower stages make the drive periodically time-varying, with a period of M ticks.  A moment ``z^k`` leaves the
states ``z^k p_k`` with p_k of period M, ``z p_(k+1) = A_k p_k + B_k``, and the fundamental of the output is
the mean of ``C_k p_k + D_k`` over a period.  That needs n states, where one time-invariant system of the same
response (`actuator_lti.loops.periodic.cyclic`) has M n.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.blocks import Block, seen, siso
from actuator_lti.loops.tick import TickProgram

if TYPE_CHECKING:
    from actuator_lti.design.model import Design


@dataclass(frozen=True)
class Compliance:
    """From M_ext at the output shaft to the output angle, all loops closed; one design or stacked ones.

    Attributes
    ----------
    blocks : sequence of Block
        One for each tick of a period, with the same states.
    period_s : float or ndarray
        Base period Ts.
    """

    blocks: Sequence[Block]
    period_s: Any

    @property
    def moves(self) -> bool:
        """Whether a moment moves the output at all."""
        return bool(self.blocks[0].states)

    def __call__(self, z: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Fundamental of the output at ``z = exp(j w Ts)``; of K stacked designs, shape (K, frequencies)."""
        points = np.atleast_1d(np.asarray(z, dtype=complex))[..., None, None]
        steps = [tuple(part[..., None, :, :] for part in _parts(block)) for block in self.blocks]
        p = _start(steps, points)
        total: Any = 0.0
        for A, B, C, D in steps:
            total = total + C @ p + D
            p = (A @ p + B) / points
        result = total[..., 0, 0] / len(steps)
        return np.asarray(result[..., 0] if np.ndim(z) == 0 else result)

    @property
    def slowest(self) -> Any:
        """Largest magnitude of a pole, per tick."""
        if not self.moves:
            return 0.0
        over = np.eye(len(self.blocks[0].states))
        for block in self.blocks:
            over = block.A @ over
        return np.abs(np.linalg.eigvals(over)).max(axis=-1) ** (1.0 / len(self.blocks))


def compliance(design: Design, at: Operating | None = None) -> Compliance:
    """The compliance of a design, or of stacked designs, at an operating point (default: sliding).

    Examples
    --------
    >>> import numpy as np
    >>> from actuator_lti.design import load_design
    >>> fin = compliance(load_design("fin"))
    >>> f"{1 / abs(fin(np.exp(2j * np.pi * 0.01 * fin.period_s))):.0f} N m/rad"
    '1324 N m/rad'
    """
    wired = wire(design, Operating() if at is None else at)
    program = TickProgram(wired, wired.outermost)
    ticks = [program.tick(k) for k in range(program.ticks)]
    blocks = [siso(program, [tick], "moment", "output_angle") for tick in ticks]
    return Compliance(_pruned(blocks), wired.tick_s)


def _parts(block: Block) -> tuple[np.ndarray, ...]:
    return block.A, block.B, block.C, block.D


def _start(steps: Sequence[tuple[np.ndarray, ...]], z: np.ndarray) -> np.ndarray:
    """p_0, from ``z^M p_0 = A_(M-1) ... A_0 p_0 + sum of A_(M-1) ... A_(k+1) B_k z^k``."""
    over, driven, power = np.eye(steps[0][0].shape[-1]), np.zeros(steps[0][1].shape[-2:]), np.ones_like(z)
    for A, B, _, _ in steps:
        over, driven, power = A @ over, A @ driven + B * power, power * z
    return np.linalg.solve(power * np.eye(over.shape[-1]) - over, driven)


def _pruned(blocks: Sequence[Block]) -> list[Block]:
    """Without the states that no tick lets the output see or the moment reach."""
    n = len(blocks[0].states)
    depends = np.any([np.any(b.A.reshape(-1, n, n) != 0, axis=0) for b in blocks], axis=0)
    used = seen(depends, np.any([np.any(b.C.reshape(-1, n) != 0, axis=0) for b in blocks], axis=0))
    used &= seen(depends.T, np.any([np.any(b.B.reshape(-1, n) != 0, axis=0) for b in blocks], axis=0))
    names = tuple(name for name, there in zip(blocks[0].states, used, strict=True) if there)
    return [
        Block(b.A[..., used, :][..., :, used], b.B[..., used, :], b.C[..., :, used], b.D, names)
        for b in blocks
    ]
