"""What is asked of the corners."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from actuator_lti.start.public_arguments import asked
from analyses.request import Option, given

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

HOT_DEGC, COLD_DEGC, SUPPLY_SHARE = 120.0, -40.0, 0.8


@asked
@dataclass(frozen=True, kw_only=True)
class Asked:
    """Judge the linear loops at the corners of the drive: hot, cold, low supply, worst tolerances.

    Resistance and torque constant follow [temperature] of the design, or copper and NdFeB. The exit status
    is 1 where a requirement is not met or not proven, or a loop not stable, at any corner.

    Try: actuator-lti corners fin --hot 85 --cold -54 --supply 22
    """

    hot_degC: Annotated[float, Option("Winding and magnets when hot; the winding's limit, or 120.", "degC")]
    cold_degC: Annotated[float, Option("Winding and magnets when cold; -40.", "degC")]
    supply_V: Annotated[float, Option("The low (or high) supply; 0.8 of limits.voltage.", "V")]
    cold_viscous: Annotated[float, Option("Factor on viscous friction in the cold; 1.")] = 1.0

    def __post_init__(self) -> None:
        """Refuse what is no corner."""
        for name, degC in (("cold", self.cold_degC), ("hot", self.hot_degC)):
            if not -273.15 < degC < 1000.0:
                raise InputError(f"{name} {degC:g} degC: allowed: above -273.15 and below 1000 degC")
        if not self.cold_degC < self.hot_degC:
            raise InputError(f"hot {self.hot_degC:g} degC: must be above cold, {self.cold_degC:g} degC")
        if not 0.0 < self.supply_V < inf:
            raise InputError(f"supply {self.supply_V:g} V: must be positive")
        if not 1.0 <= self.cold_viscous <= 1e3:
            raise InputError(f"cold viscous factor {self.cold_viscous:g}: allowed: 1 to 1000")

    @classmethod
    def of(cls, design: Design, **chosen: float | None) -> Asked:
        """What is chosen; else the winding's own limit (or 120 degC), -40 degC, and 0.8 of the supply."""
        limit = design.temperature.winding_limit_degC if design.temperature else HOT_DEGC
        usual = {
            "hot_degC": limit if isfinite(limit) else HOT_DEGC,
            "cold_degC": COLD_DEGC,
            "supply_V": SUPPLY_SHARE * design.limits.voltage_V,
        }
        return cls(**given(usual, chosen))
