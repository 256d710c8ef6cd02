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
    """A limit cycle by describing function."""

    cause: Cause  # quantisation: of the output's sensor, or of the motor's
    with_friction: bool  # whether the drive's dry friction, by its own describing function, is in it
    output_rad: float  # amplitude of the output, peak
    # Amplitude of what the nonlinearity sees: the twist at the coupling, the sensor's angle, or the motor's
    # speed (rad/s)
    inner_rad: float
    frequency_hz: float
    stable: bool  # whether motion near it comes nearer; ``False``: the border between dying out and growing
    state: dict[str, complex]  # its shape by state of the loop, at this amplitude
    load_Nm: float = 0.0  # load torque that it is at


@dataclass(frozen=True)
class Confirmation:
    """A predicted cycle against the simulator, started in its shape at several sizes."""

    cycle: Cycle
    # Amplitude of the output over the predicted one: of a stable cycle where the motion ends, of an unstable
    # one the size from which it grows; ``None``: refuted
    ratio: float | None
    frequency_hz: float | None  # where the motion ends, of a stable one

    @property
    def verdict(self) -> Seen:
        """In one word."""
        return "refuted" if self.ratio is None else "confirmed"


@dataclass(frozen=True)
class LimitCycles:
    """Cycles of one design."""

    design: Design
    confirmations: tuple[Confirmation, ...]  # every predicted cycle
    # Steps of several sizes, without load and at every load of the design, waited for
    rests: tuple[Settling, ...]
    looked_for: tuple[str, ...]  # the causes that the design has

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step of the drive as it is that does not come to rest; None: all do."""
        return noticed(self.design, self.rests)

    @property
    def verdict(self) -> Verdict:
        """Whether every step of the drive as it is ends at rest, or in a swing that a requirement accepts."""
        waived = waiver_of_rest(self.design) is not None
        return Tally.of([verdict_of(self.design, self.hunting)], [waived]).verdict
