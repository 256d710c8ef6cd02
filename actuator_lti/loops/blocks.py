"""Several ticks as one: a slower loop sees A^n, (I + A + ... + A^(n-1)) B (model.md section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from actuator_lti.loops.tick import Tick, TickProgram
from actuator_lti.systems.rest_mode import without_rest_mode


def seen(depends: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Which states an output sees, through others as well.

    ``depends[r, c]``: state r is computed from state c; ``start``: what the output looks at itself.
    """
    result, new = start.copy(), start
    while new.any():
        new = depends[new].any(axis=0) & ~result
        result |= new
    return result


@dataclass(frozen=True)
class Block:
    """A sampled SISO system ``x+ = A x + B v, y = C x + D v``.

    Shapes (n,n), (n,1), (1,n), (1,1), or stacked over designs in front. ``states`` are their names.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]

    def pruned(self) -> Block:
        """Without the states that are not used, see `pruned`."""
        return pruned([self])[0]

    def shown(self) -> Block:
        """Without a mode at zero frequency that it does not show, see `rest_mode`; one design only."""
        A, B, C, kept = without_rest_mode(self.A, self.B, self.C, 1.0)
        names = tuple(name for name, there in zip(self.states, kept, strict=True) if there)
        return Block(A, B, C, self.D, names)

    def feedback(self) -> Block:
        """Closed with negative unit feedback, output kept: T = L/(1 + L). Needs D = 0."""
        return replace(self, A=self.A - self.B @ self.C)

    def sensitivity(self) -> Block:
        """S = 1/(1 + L). Needs D = 0."""
        return replace(self, A=self.A - self.B @ self.C, C=-self.C, D=np.ones_like(self.D))


def used(blocks: Sequence[Block]) -> np.ndarray:
    """Which of the common states of blocks their outputs see and their inputs reach, in any of the blocks.

    The motor angle inside an inner loop is not seen, the filter of the command not reached.
    """
    n = len(blocks[0].states)

    def there(name: str, *shape: int) -> np.ndarray:
        parts = (getattr(block, name).reshape(-1, *shape) for block in blocks)
        return np.any([np.any(part != 0, axis=0) for part in parts], axis=0)

    depends = there("A", n, n)
    return seen(depends, there("C", n)) & seen(depends.T, there("B", n))


def pruned(blocks: Sequence[Block]) -> list[Block]:
    """The blocks without the states that none of them uses."""
    kept = used(blocks)
    names = tuple(name for name, there in zip(blocks[0].states, kept, strict=True) if there)
    return [
        Block(b.A[..., kept, :][..., :, kept], b.B[..., kept, :], b.C[..., :, kept], b.D, names)
        for b in blocks
    ]


def compose(ticks: Sequence[Tick]) -> tuple[np.ndarray, np.ndarray]:
    """State and input matrix over several ticks with all inputs held."""
    A, B = ticks[0].A, ticks[0].B
    for tick in ticks[1:]:
        A, B = tick.A @ A, tick.A @ B + tick.B
    return A, B


def siso(program: TickProgram, ticks: Sequence[Tick], source: str, signal: str, scale: Any = 1.0) -> Block:
    """From an input held over the ticks to a signal at the start of the first of them."""
    n = len(program.states)
    column = program.inputs.index(source)
    A, B = compose(ticks)
    row = np.asarray(scale)[..., None, None] * ticks[0].signals[signal][..., None, :]
    return Block(A, B[..., :, [column]], row[..., :n], row[..., [n + column]], program.states)
