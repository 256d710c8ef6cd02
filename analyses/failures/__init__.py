"""What a drive does when a part of it fails: deflection, current and moment over time."""

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:
    from analyses.failures.asked import Asked
    from analyses.failures.run import FailureCase, Failures, failures

__all__ = ["Asked", "FailureCase", "Failures", "failures"]

_ROOMS = {"Asked": "asked", "FailureCase": "run", "Failures": "run", "failures": "run"}
__getattr__, __dir__ = on_first_use(__name__, {name: f"{__name__}.{room}" for name, room in _ROOMS.items()})
