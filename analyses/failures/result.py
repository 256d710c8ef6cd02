"""What is asked of the failure cases, and what they return."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.settling import Settling

Floats = npt.NDArray[np.float64]
NEAR_SHARE = 0.1  # of the full deflection: the deflection asked for where none is stated


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Deflections and times at which the failure cases are judged.

    Attributes
    ----------
    stop_rad : float
        Deflection of the mechanical stop; the run of a case ends there.
    deflection_rad : float
        Deflection to which the time is taken.
    detection_s : float
        Time after the failure at which it is detected.
    watched_s : float
        How long after the failure a case is followed.
    load_Nm : float
        Moment at the output, pushing forward, there from the start.
    """

    stop_rad: float
    deflection_rad: float
    detection_s: float = 0.1
    watched_s: float = 1.0
    load_Nm: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        for name in ("stop_rad", "deflection_rad", "detection_s", "watched_s"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise InputError(f"{name} = {getattr(self, name)}: must be positive")
        if self.deflection_rad > self.stop_rad:
            raise InputError(
                f"deflection {self.deflection_rad:g}: must not be beyond the stop, {self.stop_rad:g}"
            )
        if self.detection_s > self.watched_s:
            raise InputError(
                f"detection {self.detection_s:g} s: must not be after {self.watched_s:g} s, the end"
            )
        if not np.isfinite(self.load_Nm):
            raise InputError(f"load {self.load_Nm}: must be finite")

    @classmethod
    def of(cls, design: Design, **chosen: float | None) -> Asked:
        """What is chosen; the rest from [failure] of the design; else its full deflection is the stop."""
        stated = vars(design.failure) if design.failure is not None else {}
        given = {
            name: value
            for name, value in (stated | {k: v for k, v in chosen.items() if v is not None}).items()
            if value is not None
        }
        full = given.pop("stop_rad", design.validation.full_deflection_rad)
        near = given.pop("deflection_rad", NEAR_SHARE * full)
        return cls(stop_rad=full, deflection_rad=near, **given)


@dataclass(frozen=True)
class FailureCase:
    """One failure; time runs from the failure, deflection from where the output then was.

    Attributes
    ----------
    name, words : str
        Such as ``"hard-over"``, and what happens.
    time_s, deflection_rad, current_A, moment_Nm : ndarray
        Output side; the moment is that in the coupling (rigid: the motor's torque times the reduction).
    to_deflection_s, to_stop_s : float or None
        Time to the deflection asked for and to the stop, either side; ``None``: not reached while watched.
    at_detection_rad : float
        Largest deflection until the failure is detected.
    peak_current_A, peak_moment_Nm : float
        Largest magnitudes.
    protected_s : float or None
        When the overload protection (I2t) acts first.
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

    Attributes
    ----------
    left_out : dict of str to str
        By name: why a case does not exist for the drive.
    before : tuple of Settling
        What holding each start ends in, the drive whole.
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
