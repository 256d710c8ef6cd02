"""The drive at its corners: hot, cold, low supply, and the worst ends of its tolerances."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, asked="Asked", run="Corner Corners corners worst_of")
