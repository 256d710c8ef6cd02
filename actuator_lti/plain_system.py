"""A linear system as matrices and names only.

`assemble_loops` works with these, and with `actuator_lti.plain_delays.PlainDelaySystem` where there are exact
delays. The python-control system of one (`actuator_lti.as_control`) is made where somebody asks for it:
importing python-control takes longer than the margins of a drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, eq=False)
class PlainSystem:
    """``x+ = A x + B u, y = C x + D u`` of one input and one output, every ``dt`` seconds; ``dx/dt`` for 0.

    Margins, bandwidths and step figures take it as they take a `control.StateSpace`.

    Attributes
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, 1), (1, n), (1, 1)
    dt : float
        Sampling period in s; 0: continuous.
    name, source, signal : str
        Of the system, its input, its output.
    states : tuple of str
    """

    ninputs: ClassVar[int] = 1
    noutputs: ClassVar[int] = 1

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    dt: float
    name: str = "loop"
    source: str = "u"
    signal: str = "y"
    states: tuple[str, ...] = ()

    def __call__(self, points: npt.ArrayLike) -> Any:
        """The response at complex points (z; s where ``dt`` is 0), of their shape; inf + nan j at a pole."""
        asked = np.asarray(points, dtype=complex)
        flat = asked.reshape(-1)
        matrix = flat[:, None, None] * np.eye(len(self.A)) - self.A
        inside = solved_at(matrix, np.broadcast_to(self.B, (len(flat), *self.B.shape)))
        values = np.asarray((self.C @ inside)[:, 0, 0] + self.D[0, 0])
        values[~np.isfinite(inside).all(axis=(1, 2))] = complex(np.inf, np.nan)
        return values.reshape(asked.shape)[()]

    def poles(self) -> np.ndarray:
        """The eigenvalues of A."""
        return np.asarray(np.linalg.eigvals(self.A).astype(complex) if self.A.size else np.empty(0, complex))


def solved_at(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve stacked equations; NaN where a matrix is singular."""
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        singular = np.array([np.linalg.det(each) == 0 for each in matrices])
        regular = np.where(singular[:, None, None], np.eye(matrices.shape[1]), matrices)
        solved = np.linalg.solve(regular, right)
        solved[singular] = np.nan
        return solved
