"""What the failure cases return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.failures.asked import Asked
from analyses.motion.settling import Settling

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class FailureCase:
    """One failure; time runs from the failure, deflection from where the output then was.

    ``name``, ``words``: such as ``"hard-over"``, and what happens.
    ``time_s``, ``deflection_rad``, ``current_A``, ``moment_Nm``: output side; the moment is that in the
    coupling (rigid: the motor's torque times the reduction).
    ``to_deflection_s``, ``to_stop_s``: time to the deflection asked for and to the stop, either side;
    ``None``: not reached while watched.
    ``at_detection_rad``: largest deflection until the failure is detected.
    ``peak_current_A``, ``peak_moment_Nm``: largest magnitudes.
    ``protected_s``: when the overload protection (I2t) acts first.
    """

    name: str
    words: str
    time_s: Floats
    deflection_rad: Floats
    current_A: Floats
    moment_Nm: Floats
    to_deflection_s: float | None
    to_stop_s: float | None
    at_detection_rad: float
    peak_current_A: float
    peak_moment_Nm: float
    protected_s: float | None


@dataclass(frozen=True)
class Failures:
    """All cases of a design.

    ``left_out``: by name: why a case does not exist for the drive.
    ``before``: what holding each start ends in, the drive whole.
    """

    design: Design
    asked: Asked
    cases: tuple[FailureCase, ...]
    left_out: dict[str, str]
    before: tuple[Settling, ...]

    def case(self, name: str) -> FailureCase:
        """A case by its name.

        Raises
        ------
        InputError
            Where there is none of that name.
        """
        for one in self.cases:
            if one.name == name:
                return one
        raise InputError(f"failure {name!r}: one of {', '.join(one.name for one in self.cases)}")
