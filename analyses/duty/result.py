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

    ``peak``: largest in the periodic state, as if the protection did not act.
    ``acts_after_s``: from the cold drive, to the end of the cycle in which it does; None: never.
    """

    peak: float
    acts_after_s: float | None


@dataclass(frozen=True)
class Heating:
    """Temperature of the winding, the copper loss of a cycle taken as its mean.

    ``loss_W``: mean copper loss at the reference temperature.
    ``final_degC``: in the long run, the resistance growing with the temperature; inf: it never settles.
    ``limit_after_s``: when the limit is reached from ambient; None: never.
    ``time_s``, ``temperature_degC``: the rise from ambient, for drawing.
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

    ``rms_A``, ``moving_rms_A``, ``holding_A``, ``peak_A``: current: of the whole cycle, in motion (steady),
    at rest, largest.
    ``continuous_A``: what the design allows for ever; inf where it states none.
    ``limited``: limiters that act in steady motion: the duty is then not followed as asked.
    ``time_s``, ``current_A``: one period of the steady motion.
    ``overload``, ``heating``: None without overload protection, without a thermal resistance in the design.
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
