"""Where the gain of a rational loop is one."""

from __future__ import annotations

import numpy as np

from actuator_lti.margins.checked import gain_crossovers
from actuator_lti.margins.level_crossings import LevelCrossings, unwarped
from actuator_lti.margins.loop import RationalLoop, Real
from actuator_lti.margins.trust import Doubtful


def gain_crossings(loop: RationalLoop, levels: LevelCrossings | None = None) -> Real:
    """Only the crossings of the unit circle, 0 < x < end, points of touch left out; no border poles."""
    del levels
    try:
        return gain_crossovers(loop)
    except (Doubtful, np.linalg.LinAlgError):
        return _exact_gain_crossings(loop)


def _exact_gain_crossings(loop: RationalLoop) -> Real:
    from actuator_lti.margins.exact_findings import crossings  # python-flint only where it is needed
    from actuator_lti.margins.exact_loop import exact_loop

    w = np.array([c.w for c in crossings(exact_loop(loop.given()))[0] if not c.touch])
    return unwarped(w, loop.in_z)
