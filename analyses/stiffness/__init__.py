"""Stiffness of a drive at its output: dynamic, static, lost motion (model.md section 9)."""

from analyses.stiffness.run import (
    AtRest,
    Check,
    LostMotion,
    Stiffness,
    StiffnessCurve,
    check_stiffness,
    lost_motion_seen,
    stiffness,
    stiffness_at_rest,
    stiffness_curves,
)

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
