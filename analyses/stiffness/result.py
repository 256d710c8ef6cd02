"""What the stiffness analysis returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design

State = Literal["powered", "shorted", "open"]


@dataclass(frozen=True)
class StiffnessCurve:
    """Dynamic stiffness K = M_ext / output angle over frequency, in one state of the drive.

    ``state``: all loops closed and the command held; unpowered with the winding shorted (a bridge at zero
    voltage); unpowered without a current.
    ``stiffness_Nm_rad``: N m/rad (linear axis: N/m); inf where the output does not move.
    ``static_Nm_rad``: limit at zero frequency: 0 of an output that runs away, inf of one that comes back.
    """

    state: State
    frequency_hz: npt.NDArray[np.float64]
    stiffness_Nm_rad: npt.NDArray[np.complex128]
    static_Nm_rad: float

    @property
    def least(self) -> tuple[float, float]:
        """Smallest |K| and its frequency in Hz; 0 Hz where the static one is below all others."""
        size = np.abs(self.stiffness_Nm_rad)
        k = int(np.argmin(size))
        if self.static_Nm_rad < size[k]:
            return self.static_Nm_rad, 0.0
        return float(size[k]), float(self.frequency_hz[k])


@dataclass(frozen=True)
class LostMotion:
    """How far the output stays apart after a moment to either side has gone, the motor held.

    ``play_rad``: the play of the coupling at the output.
    ``foreseen_rad``: read at +-3 % of the largest load moment
    (`actuator_lti.loops.stiffness.lost_motion_rad`).
    ``seen_rad``: the same in the simulator; None where it was not asked.
    """

    play_rad: float
    foreseen_rad: float
    seen_rad: float | None = None


@dataclass(frozen=True)
class Check:
    """One frequency, by the simulator's own derivative at rest, without dry friction and play.

    Both are inf where the output does not move, as behind a gear that locks.
    """

    frequency_hz: float
    foreseen_Nm_rad: complex
    seen_Nm_rad: complex

    @property
    def difference(self) -> float:
        """Relative difference of the two compliances."""
        if np.isinf(self.foreseen_Nm_rad):
            return 0.0 if np.isinf(self.seen_Nm_rad) else np.inf
        return abs(self.foreseen_Nm_rad / self.seen_Nm_rad - 1.0)


@dataclass(frozen=True)
class AtRest:
    """Fundamental stiffness of the drive as it is, at rest, to a sinusoidal moment; inf: no motion."""

    moment_Nm: float
    frequency_hz: float
    seen_Nm_rad: complex


@dataclass(frozen=True)
class Stiffness:
    """All of it for one design; ``unproven`` says why the simulator could not be asked."""

    design: Design
    curves: tuple[StiffnessCurve, ...]
    lost_motion: LostMotion | None
    checks: tuple[Check, ...] = ()
    at_rest: tuple[AtRest, ...] = ()
    unproven: str = ""

    @property
    def lost_motion_difference(self) -> float | None:
        """Relative difference of lost motion as predicted and as simulated; None where it was not read."""
        lost = self.lost_motion
        return None if lost is None or lost.seen_rad is None else abs(lost.seen_rad / lost.foreseen_rad - 1.0)

    @property
    def verdict(self) -> Verdict:
        """Whether every check agrees to `AGREED`, and lost motion to `READ`; not proven without a check."""
        if not self.checks:
            return Verdict.NOT_PROVEN
        read = (self.lost_motion_difference or 0.0) <= READ
        return Verdict.of(read and all(check.difference <= AGREED for check in self.checks))

    @property
    def passed(self) -> bool:
        """Whether it is met."""
        return self.verdict is Verdict.MET


AGREED, READ = 1e-6, 1e-2
