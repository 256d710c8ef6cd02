"""A step of the nonlinear drive for every sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.batch import Population
from actuator_lti.errors import InputError
from analyses.engine import Arrays


@dataclass(frozen=True)
class StepCheck:
    """A step command at the output shaft.

    Attributes
    ----------
    amplitude_rad : float
    duration_s : float
    load_Nm : float
    """

    amplitude_rad: float
    duration_s: float = 0.5
    load_Nm: float = 0.0

    def __post_init__(self) -> None:
        if not (self.amplitude_rad > 0 and self.duration_s > 0):
            raise InputError("nonlinear step: amplitude and duration must be positive")


def step_units(step: StepCheck) -> dict[str, str]:
    """Columns of a nonlinear step with their units."""
    return {
        "nonlinear.rise_time": "s",
        "nonlinear.overshoot": "%",
        "nonlinear.settling_time": "s",
        "nonlinear.final_error": "%",
        "nonlinear.peak_current": "A",
    }


def step_columns(step: StepCheck, population: Population) -> Arrays:
    """Figures of the nonlinear step of every design."""
    raise InputError("nonlinear samples are not available yet")


def _unused(values: np.ndarray) -> np.ndarray:
    return values
