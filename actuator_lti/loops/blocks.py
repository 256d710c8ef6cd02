"""Several ticks as one: a slower loop sees A^n, (I + A + ... + A^(n-1)) B (model.md section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.loops.tick import Tick, TickProgram


@dataclass(frozen=True)
class Block:
    """A sampled SISO system ``x+ = A x + B v, y = C x + D v``; shapes (n,n), (n,1), (1,n), (1,1)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray

    def pruned(self) -> Block:
        """Without the states that nothing looks at (such as a hold written before it is read)."""
        A, B, C = self.A, self.B, self.C
        while A.shape[0]:
            used = np.any(A != 0, axis=0) | np.any(C != 0, axis=0)
            if used.all():
                break
            A, B, C = A[np.ix_(used, used)], B[used], C[:, used]
        return Block(A, B, C, self.D)

    def feedback(self) -> Block:
        """Closed with negative unit feedback, output kept: T = L/(1 + L). Needs D = 0."""
        return Block(self.A - self.B @ self.C, self.B, self.C, self.D)

    def sensitivity(self) -> Block:
        """S = 1/(1 + L). Needs D = 0."""
        return Block(self.A - self.B @ self.C, self.B, -self.C, np.ones((1, 1)))


def compose(ticks: Sequence[Tick]) -> tuple[np.ndarray, np.ndarray]:
    """State and input matrix over several ticks with all inputs held."""
    A, B = ticks[0].A, ticks[0].B
    for tick in ticks[1:]:
        A, B = tick.A @ A, tick.A @ B + tick.B
    return A, B


def siso(program: TickProgram, ticks: Sequence[Tick], source: str, signal: str, scale: float = 1.0) -> Block:
    """From an input held over the ticks to a signal at the start of the first of them."""
    n = len(program.states)
    column = program.inputs.index(source)
    A, B = compose(ticks)
    row = scale * ticks[0].signals[signal]
    return Block(A, B[:, [column]], row[None, :n], row[None, [n + column]])
