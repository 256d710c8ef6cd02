"""Stiffness of a drive at its output: dynamic, static, lost motion (model.md section 9)."""

from actuator_lti.start.on_first_use import from_rooms

_RESULTS = "AtRest Check LostMotion Stiffness StiffnessCurve "
_QUESTIONS = "check_stiffness lost_motion_simulated stiffness stiffness_at_rest stiffness_curves"
__getattr__, __dir__ = from_rooms(__name__, run=_RESULTS + _QUESTIONS)
