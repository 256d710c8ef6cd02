"""A linear system as matrices and names only.

`assemble_loops` works with these, and with `actuator_lti.systems.plain_delays.PlainDelaySystem` where there
are exact delays. The python-control system of one (`as_control` there) is made where somebody asks for it:
importing python-control takes longer than the margins of a drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from actuator_lti.systems.resolvent import responses


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
        """The eigenvalues of A."""
        return np.asarray(np.linalg.eigvals(self.A).astype(complex) if self.A.size else np.empty(0, complex))
