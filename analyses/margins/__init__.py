"""Margins, bandwidths and requirements of a design at one operating point, and their spread over all."""

from actuator_lti.start.on_first_use import on_first_use

_ROOMS = {"Asked": f"{__name__}.asked"}
_ROOMS |= dict.fromkeys(("Margins", "margins"), f"{__name__}.run")
__getattr__, __dir__ = on_first_use(__name__, _ROOMS)
