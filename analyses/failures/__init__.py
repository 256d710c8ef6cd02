"""What a drive does when a part of it fails: deflection, current and torque over time."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, asked="Asked", run="FailureCase Failures failures")
