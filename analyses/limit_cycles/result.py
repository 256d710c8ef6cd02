"""What the analysis of limit cycles returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.model import Design
from analyses.motion.settling import Settling, noticed, verdict_of, waiver_of_rest

Cause = Literal["play", "quantisation", "motor-quantisation", "friction"]
Seen = Literal["confirmed", "refuted"]


@dataclass(frozen=True)
class Cycle:
    """A limit cycle by describing function.

    ``cause``: quantisation: of the output's sensor, or of the motor's.
    ``with_friction``: whether the drive's dry friction, by its own describing function, is in it.
    ``output_rad``: amplitude of the output, peak.
    ``inner_rad``: amplitude of what the nonlinearity sees: the twist at the coupling, the sensor's angle, or
    the motor's speed (rad/s).
    ``stable``: whether motion near it comes nearer; ``False``: the border between dying out and growing.
    ``state``: its shape by state of the loop, at this amplitude.
    ``load_Nm``: load torque that it is at.
    """

    cause: Cause
    with_friction: bool
    output_rad: float
    inner_rad: float
    frequency_hz: float
    stable: bool
    state: dict[str, complex]
    load_Nm: float = 0.0


@dataclass(frozen=True)
class Confirmation:
    """A predicted cycle against the simulator, started in its shape at several sizes.

    ``ratio``: amplitude of the output over the predicted one: of a stable cycle where the motion ends, of an
    unstable one the size from which it grows; ``None``: refuted.
    ``frequency_hz``: where the motion ends, of a stable one.
    """

    cycle: Cycle
    ratio: float | None
    frequency_hz: float | None

    @property
    def verdict(self) -> Seen:
        """In one word."""
        return "refuted" if self.ratio is None else "confirmed"


@dataclass(frozen=True)
class LimitCycles:
    """Cycles of one design.

    ``confirmations``: every predicted cycle.
    ``rests``: steps of several sizes, without load and at every load of the design, waited for.
    ``looked_for``: the causes that the design has.
    """

    design: Design
    confirmations: tuple[Confirmation, ...]
    rests: tuple[Settling, ...]
    looked_for: tuple[str, ...]

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step of the drive as it is that does not come to rest; None: all do."""
        return noticed(self.design, self.rests)

    @property
    def verdict(self) -> Verdict:
        """Whether every step of the drive as it is ends at rest, or in a swing that a requirement accepts."""
        waived = waiver_of_rest(self.design) is not None
        return Tally.of([verdict_of(self.design, self.hunting)], [waived]).verdict
