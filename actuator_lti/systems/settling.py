"""How long a sampled linear system takes to settle: by the mode that decays last, what rests left out."""

from collections.abc import Sequence
from math import inf, log

import numpy as np

from actuator_lti.systems.rest_mode import ROUNDED, without_rest_modes


def slowest_mode(ticks: Sequence[np.ndarray]) -> float:
    """Largest magnitude, per tick, of a mode of matrices A that act one after the other and round again.

    An angle that nothing holds, or a torque that an integral and a spring hold, is at rest and none of them;
    nor is what neither decays nor grows but for rounding, as a spring that nothing damps. 0: none is left.

    >>> slowest_mode([np.array([[0.5, 0.0], [1.0, 1.0]])])  # a speed, and the angle that it turns
    0.5
    """
    n = len(ticks[0])
    moving, _ = without_rest_modes([(A, np.zeros((n, 1)), np.zeros((1, n))) for A in ticks])
    one = np.eye(len(moving[0][0]))
    change = np.zeros_like(one)  # by all ticks, not what is left after them: of slow modes it has more digits
    for A, _, _ in moving:
        change = (A - one) @ (one + change) + change
    sizes = np.abs(1.0 + np.linalg.eigvals(change))
    return float(sizes[np.abs(sizes - 1.0) > ROUNDED].max(initial=0.0)) ** (1.0 / len(ticks))


def settling_ticks(slowest: float, left: float) -> float:
    """Ticks after which so much is ``left`` of a mode of that size a tick; inf: it grows.

    >>> settling_ticks(0.5, 0.125), settling_ticks(1.1, 0.125), settling_ticks(0.0, 0.125)
    (3.0, inf, 0.0)
    """
    if slowest > 1.0:
        return inf
    return log(left) / log(slowest) if slowest > 0.0 else 0.0
