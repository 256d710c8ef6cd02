"""Margins, bandwidths and requirements of a design at one operating point, and their spread over all."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, asked="Asked", run="Margins margins")
