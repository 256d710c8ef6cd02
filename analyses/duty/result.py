"""What is asked of a duty cycle, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError

Floats = npt.NDArray[np.float64]
USUAL_SHARE, USUAL_HZ = 0.5, 1.0  # of the full deflection, where none is stated


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A duty: a sine of the command, for a share of the time, the drive holding still for the rest.

    Attributes
    ----------
    amplitude_rad, frequency_hz : float
        Of the sine, peak, at the output.
    load_Nm : float
        Constant moment at the output, all the time.
    share : float
        Share of the time in motion, above 0 to 1 (S3 duty).
    cycle_s : float
        One motion and one rest together; the motion is whole periods of the sine.
    """

    amplitude_rad: float
    frequency_hz: float = USUAL_HZ
    load_Nm: float = 0.0
    share: float = 1.0
    cycle_s: float = 10.0

    def __post_init__(self) -> None:
        """Refuse what is no duty."""
        for name in ("amplitude_rad", "frequency_hz", "cycle_s"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise InputError(f"{name} = {getattr(self, name)}: must be positive")
        if not 0.0 < self.share <= 1.0:
            raise InputError(f"share = {self.share}: allowed: above 0, at most 1")
        if not np.isfinite(self.load_Nm):
            raise InputError(f"load_Nm = {self.load_Nm}: must be finite")
        if self.share < 1.0 and self.share * self.cycle_s * self.frequency_hz < 1.0:
            period = f"{1.0 / self.frequency_hz:g} s"
            raise InputError(f"share = {self.share:g} of {self.cycle_s:g} s: must hold a period, {period}")

    @classmethod
    def of(cls, design: Design, **chosen: float | None) -> Asked:
        """What is chosen; else [duty] of the design; else half the full deflection under the largest load."""
        usual: dict[str, float | None] = {
            "amplitude_rad": USUAL_SHARE * design.validation.full_deflection_rad,
            "load_Nm": max(design.validation.loads_Nm, key=abs),
        }
        if design.duty is not None:
            stated = dict(vars(design.duty))
            turns = stated.pop("frequency_rad_s")
            stated["frequency_hz"] = None if turns is None else turns / (2.0 * np.pi)
            usual |= {name: value for name, value in stated.items() if value is not None}
        usual |= {name: value for name, value in chosen.items() if value is not None}
        return cls(**usual)  # type: ignore[arg-type]


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
    def passed(self) -> bool:
        """Whether the drive does this for ever: current, protection and temperature."""
        warm = self.heating is None or self.heating.final_degC <= self.heating.limit_degC
        acts = self.overload is not None and self.overload.acts_after_s is not None
        return self.rms_A <= self.continuous_A and not acts and warm
