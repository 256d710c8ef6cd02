"""Stiffness of a drive at its output: dynamic, static, lost motion (model.md section 9)."""

from analyses.stiffness.curves import stiffness_curves
from analyses.stiffness.injected import check_stiffness, lost_motion_seen
from analyses.stiffness.result import Check, LostMotion, Stiffness, StiffnessCurve
from analyses.stiffness.run import stiffness

__all__ = [
    "Check",
    "LostMotion",
    "Stiffness",
    "StiffnessCurve",
    "check_stiffness",
    "lost_motion_seen",
    "stiffness",
    "stiffness_curves",
]
