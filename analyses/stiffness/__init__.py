"""Stiffness of a drive at its output: dynamic, static, lost motion (model.md section 9)."""

from actuator_lti.start.on_first_use import on_first_use

_RESULTS = ("AtRest", "Check", "LostMotion", "Stiffness", "StiffnessCurve")
_QUESTIONS = ("check_stiffness", "lost_motion_seen", "stiffness", "stiffness_at_rest", "stiffness_curves")
__all__ = [*_RESULTS, *_QUESTIONS]
__getattr__, __dir__ = on_first_use(__name__, dict.fromkeys(__all__, f"{__name__}.run"))
