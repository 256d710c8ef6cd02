"""A sampled linear system as matrices and names only.

`assemble_loops` works with these. The python-control system of one (`PlainSystem.to_control`) is made where
somebody asks for it: importing python-control takes longer than the margins of a drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, eq=False)
class PlainSystem:
    """``x+ = A x + B u, y = C x + D u`` of one input and one output, every ``dt`` seconds.

    Margins, bandwidths and step figures take it as they take a `control.StateSpace`.

    Attributes
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, 1), (1, n), (1, 1)
    dt : float
        Sampling period in s.
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

    def to_control(self) -> control.StateSpace:
        """The same as a named python-control system."""
        import control

        names = {"inputs": [self.source], "outputs": [self.signal], "name": self.name}
        if self.states:
            names["states"] = [state.replace(".", "_") for state in self.states]
        return control.ss(self.A, self.B, self.C, self.D, self.dt, remove_useless_states=False, **names)


def as_control(system: Any) -> Any:
    """The python-control system of a `PlainSystem`; anything else as it is."""
    return system.to_control() if isinstance(system, PlainSystem) else system
