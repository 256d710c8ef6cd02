"""One motion of the nonlinear drive, as a command line asks for it."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, asked="Asked", run="Motion motion")
