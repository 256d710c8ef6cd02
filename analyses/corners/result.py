"""What is asked of the corners, and what they return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.loop_figures import LoopFigures
from analyses.verdicts import RequirementVerdict, tally

HOT_DEGC, COLD_DEGC, SUPPLY_SHARE = 120.0, -40.0, 0.8


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Where the corners lie.

    Attributes
    ----------
    hot_degC, cold_degC : float
        Temperature of winding and magnets.
    supply_V : float
        The low supply.
    cold_viscous : float
        Factor on the viscous friction of motor and load in the cold (grease); 1: unchanged.
    """

    hot_degC: float
    cold_degC: float
    supply_V: float
    cold_viscous: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what is no corner."""
        if not -273.15 < self.cold_degC < self.hot_degC < 1000.0:
            raise InputError(f"cold {self.cold_degC:g}, hot {self.hot_degC:g} degC: allowed: cold below hot")
        if not 0.0 < self.supply_V < float("inf"):
            raise InputError(f"low supply {self.supply_V:g} V: must be positive")
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
        return cls(**usual | {name: value for name, value in chosen.items() if value is not None})


@dataclass(frozen=True)
class Corner:
    """The drive at one corner.

    Attributes
    ----------
    name : str
    words : str
        What differs from the nominal drive.
    design : Design
    figures : mapping of str to LoopFigures
        Of its sampled, sliding loops.
    verdicts : tuple of RequirementVerdict
    """

    name: str
    words: str
    design: Design
    figures: Mapping[str, LoopFigures]
    verdicts: tuple[RequirementVerdict, ...]

    @property
    def passed(self) -> bool:
        """Whether no requirement fails and every loop is stable."""
        return tally(self.verdicts).passes and all(one.sound for one in self.figures.values())


@dataclass(frozen=True)
class Corners:
    """All corners of a design, the nominal drive first."""

    design: Design
    asked: Asked
    corners: tuple[Corner, ...]

    @property
    def passed(self) -> bool:
        """Whether every corner passes."""
        return all(corner.passed for corner in self.corners)
