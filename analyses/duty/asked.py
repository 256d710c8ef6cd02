"""What is asked of a duty cycle."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from analyses.request import Option, given

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

USUAL_SHARE, USUAL_HZ = 0.5, 1.0  # of the full deflection, where none is stated


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Hold a duty cycle against continuous current, overload protection (I2t) and winding temperature.

    The duty is a sine under a load, for a share of the time; what is not given comes from [duty]. The
    temperature needs thermal_resistance and thermal_time in [temperature], the protection limits.peak_time.
    The exit status is 1 where the duty is beyond the continuous rating or misses a requirement on it, or
    where neither is stated.

    Try: actuator-lti duty joint --amplitude "10 deg" --load "40 N*m" --share 0.3 --cycle 20
    """

    amplitude_rad: Annotated[
        float, Option('Peak, such as "5 deg"; half the full deflection.', "ANGLE", kind="output")
    ]
    frequency_hz: Annotated[float, Option("Of the sine; 1.", "Hz")] = USUAL_HZ
    load_Nm: Annotated[
        float,
        Option(
            'Load torque at the output, such as "4 N*m", all the time; the largest of validation.loads.',
            "LOAD",
            kind="load",
        ),
    ] = 0.0
    share: Annotated[float, Option("Share of the time in motion; the drive holds still for the rest; 1.")] = (
        1.0
    )
    cycle_s: Annotated[float, Option("One motion and one rest together; 10.", "s")] = 10.0

    def __post_init__(self) -> None:
        """Refuse what is no duty."""
        for name in ("amplitude_rad", "frequency_hz", "cycle_s"):
            if not 0.0 < getattr(self, name) < inf:
                raise InputError(f"{name} = {getattr(self, name):.6g}: must be positive")
        if not 0.0 < self.share <= 1.0:
            raise InputError(f"share = {self.share:g}: allowed: above 0, at most 1")
        if not isfinite(self.load_Nm):
            raise InputError(f"load_Nm = {self.load_Nm}: must be finite")
        if self.share < 1.0 and self.share * self.cycle_s * self.frequency_hz < 1.0:
            period = f"{1.0 / self.frequency_hz:g} s"
            raise InputError(f"share = {self.share:g} of {self.cycle_s:g} s: must hold a period, {period}")

    @classmethod
    def of(cls, design: Design, **chosen: float | None) -> Asked:
        """What is chosen; else [duty] of the design; else half the full deflection under the largest load."""
        usual = {
            "amplitude_rad": USUAL_SHARE * design.validation.full_deflection_rad,
            "load_Nm": max(design.validation.loads_Nm, key=abs),
        }
        stated = {} if design.duty is None else dict(vars(design.duty))
        turns = stated.pop("frequency_rad_s", None)
        stated["frequency_hz"] = None if turns is None else turns / (2.0 * pi)
        return cls(**given(usual, stated, chosen))
