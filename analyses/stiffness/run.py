"""The whole stiffness analysis of a design."""

from __future__ import annotations

import numpy as np

from actuator_lti.design.model import Design
from analyses.stiffness.curves import stiffness_curves
from analyses.stiffness.injected import check_stiffness, lost_motion, stiffness_at_rest
from analyses.stiffness.result import Stiffness

CHECKED_HZ = (2.0, 10.0, 50.0)
REST_HZ = (2.0, 20.0)
REST_FRACTIONS = (0.01, 0.1, 1.0)  # of the largest moment


def stiffness(design: Design, *, simulated: bool = True) -> Stiffness:
    """Dynamic and static stiffness and lost motion of a design.

    Parameters
    ----------
    design : Design
    simulated : bool
        Put them to the simulator: a moment injected at three frequencies, and a slow one to either side.

    Raises
    ------
    InputError
        For a loop that is not stable.
    """
    held = design.controller.position is not None
    checks = check_stiffness(design, CHECKED_HZ) if simulated and held else ()
    largest = design.load.moment_max_Nm if any(np.isfinite(one.foreseen_Nm_rad) for one in checks) else 0.0
    asked = [(f, share * largest) for f in REST_HZ for share in REST_FRACTIONS]
    return Stiffness(
        design,
        stiffness_curves(design),
        lost_motion(design, seen=simulated and held),
        checks,
        stiffness_at_rest(design, asked) if largest > 0.0 else (),
        "no position loop holds the output" if simulated and not checks else "",
    )
