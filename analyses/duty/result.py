"""What a duty cycle returns."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
import numpy.typing as npt

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design
from analyses.duty.asked import Asked

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Overload:
    """The overload (I2t) state under this duty, for ever repeated; it acts at 1.

    Attributes
    ----------
    peak : float
        Largest in the periodic state, as if the protection did not act.
    acts_after_s : float or None
        From the cold drive, to the end of the cycle in which it does; None: never.
    """

    peak: float
    acts_after_s: float | None


@dataclass(frozen=True)
class Heating:
    """Temperature of the winding, the copper loss of a cycle taken as its mean.

    Attributes
    ----------
    loss_W : float
        Mean copper loss at the reference temperature.
    final_degC : float
        In the long run, the resistance growing with the temperature; inf: it never settles.
    limit_degC : float
    limit_after_s : float or None
        When the limit is reached from ambient; None: never.
    time_s, temperature_degC : ndarray
        The rise from ambient, for drawing.
    """

    loss_W: float
    final_degC: float
    limit_degC: float
    limit_after_s: float | None
    time_s: Floats
    temperature_degC: Floats


@dataclass(frozen=True)
class Duty:
    """A duty cycle and what it asks of the motor.

    Attributes
    ----------
    rms_A, moving_rms_A, holding_A, peak_A : float
        Current: of the whole cycle, in motion (steady), at rest, largest.
    continuous_A : float
        What the design allows for ever; inf where it states none.
    limited : tuple of str
        Limiters that act in steady motion: the duty is then not followed as asked.
    time_s, current_A : ndarray
        One period of the steady motion.
    overload : Overload or None
        None without overload protection.
    heating : Heating or None
        None without a thermal resistance in the design.
    """

    design: Design
    asked: Asked
    rms_A: float
    moving_rms_A: float
    holding_A: float
    peak_A: float
    continuous_A: float
    limited: tuple[str, ...]
    time_s: Floats
    current_A: Floats
    overload: Overload | None
    heating: Heating | None

    @property
    def verdict(self) -> Verdict:
        """Whether the drive may do this for ever by what is stated: current, protection, temperature."""
        stated = [self.rms_A <= self.continuous_A] if isfinite(self.continuous_A) else []
        if self.heating is not None and isfinite(self.heating.limit_degC):
            stated.append(self.heating.final_degC <= self.heating.limit_degC)
        if self.overload is not None:
            stated.append(self.overload.acts_after_s is None)
        return Verdict.of(all(stated) if stated else None)
