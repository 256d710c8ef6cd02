"""What tuning returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.specification.verdicts import RequirementVerdict
    from analyses.tuning.asked import Aim


@dataclass(frozen=True)
class BindingRequirement:
    """One requirement at its worst corner.

    Attributes
    ----------
    id, label, unit : str
    value, limit, distance : float
        Worst over the corners; distance positive where met.
    relative : float
        Distance over the limit's size: what tuning makes as even as it can.
    binds : bool
        Whether it is among those that allow nothing better.
    corner : mapping of str to float
        SI values of the worst corner; empty for the nominal design.
    """

    id: str
    label: str
    unit: str
    value: float | None
    limit: float
    distance: float | None
    relative: float
    binds: bool
    corner: Mapping[str, float]


@dataclass(frozen=True)
class GainSetting:
    """One gain.

    Attributes
    ----------
    path, unit : str
    before, by_rule : float or None
        SI; None for a value of an added element, and for one that no rule gives.
    tuned : float
        SI.
    object : str
        Label of the motion controller's object; empty where the design has none.
    steps : int or None
        What is written into the object.
    rounded : float
        SI value of that, or the tuned one; this is what the tuned design has.
    """

    path: str
    unit: str
    before: float | None
    by_rule: float | None
    tuned: float
    object: str
    object_unit: str
    steps: int | None
    rounded: float


@dataclass(frozen=True)
class TradeOffPoint:
    """Largest phase margin that every loop keeps at its worst corner, at a position bandwidth."""

    bandwidth_hz: float
    phase_margin_deg: float
    feasible: bool


@dataclass(frozen=True)
class NonlinearCheck:
    """A step of the tuned design in the nonlinear model, with every limit and friction.

    ``settling_time_s`` is None where it does not stay within 2 % of the commanded angle; friction may leave
    an error that no gain removes. ``limited`` names the limiters that acted, with their share of the time.
    """

    corner: str
    amplitude_rad: float
    rise_time_s: float | None
    overshoot_percent: float
    settling_time_s: float | None
    final_error_percent: float
    limited: str


@dataclass(frozen=True)
class TuningResult:
    """A tuned design.

    Attributes
    ----------
    feasible : bool
        Whether every requirement on the loops is met at every corner, with the rounded gains.
    before, design : Design
        As it came, and with the rounded gains.
    gains : tuple of GainSetting
    requirements : tuple of BindingRequirement
    steps : tuple of str
        How the start gains were found.
    corners : int
        Corners of the tolerance box that were checked (the nominal design counts).
    checks : tuple of NonlinearCheck
    trade_off : tuple of TradeOffPoint
    evaluations : int
        Designs looked at.
    notes : tuple of str
    aim : {"least-change", "reserve"}
    placed : tuple of str
        Elements that were added, because gains alone do not meet the requirements.
    confirmed : tuple of RequirementVerdict
        The requirements on loops by certified margins: the tuned design, and each worst corner of one.
    """

    feasible: bool
    before: Design
    design: Design
    gains: tuple[GainSetting, ...]
    requirements: tuple[BindingRequirement, ...]
    steps: tuple[str, ...]
    corners: int
    checks: tuple[NonlinearCheck, ...]
    trade_off: tuple[TradeOffPoint, ...]
    evaluations: int
    notes: tuple[str, ...]
    aim: Aim = "least-change"
    placed: tuple[str, ...] = ()
    confirmed: tuple[RequirementVerdict, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether it is feasible."""
        return self.feasible

    def __str__(self) -> str:
        head = "every requirement met" if self.feasible else "REQUIREMENTS CANNOT BE MET"
        lines = [f"{self.design.name}: {head} over {self.corners} corners"]
        lines += [f"{g.path} = {g.rounded:.6g} {g.unit}" for g in self.gains]
        lines += [
            f"binding: {r.id} {r.distance:+.4g} {r.unit}" for r in self.requirements if r.binds and r.distance
        ]
        return "\n".join(lines)
