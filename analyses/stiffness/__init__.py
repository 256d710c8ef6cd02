"""Stiffness of a drive at its output: dynamic, static, lost motion (model.md section 9)."""

from analyses.stiffness.injected import check_stiffness, lost_motion_seen, stiffness_at_rest
from analyses.stiffness.result import AtRest, Check, LostMotion, Stiffness, StiffnessCurve
from analyses.stiffness.run import stiffness, stiffness_curves

__all__ = [
    "AtRest",
    "Check",
    "LostMotion",
    "Stiffness",
    "StiffnessCurve",
    "check_stiffness",
    "lost_motion_seen",
    "stiffness",
    "stiffness_at_rest",
    "stiffness_curves",
]
