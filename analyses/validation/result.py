"""What a validation finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from analyses.loop_figures import LoopFigures
from analyses.validation.at_rest import RestSweep
from analyses.validation.conditional import Conditional
from analyses.validation.confirm import Confirmation
from analyses.validation.counts import Counts
from analyses.validation.figures import Measured
from analyses.validation.from_rest import RestSteps
from analyses.validation.ledger import Entry
from analyses.validation.release import AmplitudeMargin
from analyses.validation.response import Sweep, SweepErrors
from analyses.validation.tones import ToneSweep

if TYPE_CHECKING:
    from analyses.friction_effects import FrictionEffects
    from analyses.large_signal import LargeSignals
    from analyses.specification import Specification

Complexes = npt.NDArray[np.complex128]


NOTICED = 1e-6  # of full deflection


@dataclass(frozen=True)
class LoopValidation:
    """One loop, linear and measured.

    Attributes
    ----------
    name : str
    figures : LoopFigures
        Linear.
    measured : Measured or None
        ``None`` where the loop is not stable, so that nothing can be measured; ``reason`` says so.
    open_loop, closed_loop : ndarray of complex, shape (K,)
        Linear responses at the frequencies of the sweep.
    open_errors, closed_errors : SweepErrors or None
    tones : ToneSweep or None
    tone_errors : SweepErrors or None
    confirmed : tuple of Confirmation
    reason : str
    """

    name: str
    figures: LoopFigures
    measured: Measured | None
    open_loop: Complexes
    closed_loop: Complexes
    open_errors: SweepErrors | None
    closed_errors: SweepErrors | None
    tones: ToneSweep | None
    tone_errors: SweepErrors | None
    confirmed: tuple[Confirmation, ...]
    reason: str = ""


@dataclass(frozen=True)
class PointValidation:
    """A break point with all other loops closed, linear and measured."""

    name: str
    sweep: Sweep | None
    open_errors: SweepErrors | None
    confirmed: tuple[Confirmation, ...]


@dataclass(frozen=True)
class Validation:
    """Everything the nonlinear simulator says of a design's linear predictions.

    Attributes
    ----------
    ledger : tuple of Entry
        Every prediction beside its measurement.
    loops, points : mapping by name
    amplitude_margins : tuple of AmplitudeMargin
    conditional : Conditional or None
    rest_sweep : RestSweep or None
    rest_steps : RestSteps or None
    command : Sweep or None
        Response to the command.
    counts : tuple of Counts
        What the counts of each encoder do.
    large_signals, friction, specification : results or None
        Of `analyses.large_signal`, `analyses.friction_effects`, `analyses.specification`.
    seconds : mapping of str to float
        How the time divided.
    notes : tuple of str
        What could not be done, and why.
    held_by_friction : tuple of str
        Loops that are stable with the friction that is left out where the drive is tested, and only with it.
    """

    design: Design
    ledger: tuple[Entry, ...]
    loops: Mapping[str, LoopValidation]
    points: Mapping[str, PointValidation]
    amplitude_margins: tuple[AmplitudeMargin, ...]
    conditional: Conditional | None
    rest_sweep: RestSweep | None
    rest_steps: RestSteps | None
    large_signals: LargeSignals | None
    friction: FrictionEffects | None
    specification: Specification | None
    seconds: Mapping[str, float]
    notes: tuple[str, ...] = ()
    command: Sweep | None = None
    counts: tuple[Counts, ...] = ()
    held_by_friction: tuple[str, ...] = ()

    @property
    def failed(self) -> tuple[Entry, ...]:
        """Predictions that do not hold where they should."""
        return tuple(row for row in self.ledger if row.passed is False)

    @property
    def judged(self) -> bool:
        """Whether there is a prediction that could be judged."""
        return any(row.passed is not None for row in self.ledger)

    @property
    def unstable(self) -> tuple[str, ...]:
        """Loops that are not stable."""
        return tuple(
            name
            for name, loop in self.loops.items()
            if loop.figures.margins.stable is False and name not in self.held_by_friction
        )

    @property
    def undecided(self) -> tuple[str, ...]:
        """Loops of which the data do not tell whether they are stable."""
        return tuple(name for name, loop in self.loops.items() if loop.figures.margins.stable is None)

    @property
    def instability(self) -> str:
        """Which loops are not known to be stable, and what the simulator says of it; else empty."""
        said = {row.loop: row for row in self.ledger if row.quantity == "stability"}
        parts = []
        for name in (*self.unstable, *self.undecided):
            row = said.get(name)
            if name in self.undecided:
                parts.append(f"stability of the {name} loop not known")
            elif self.loops[name].figures.margins.verdict == "on the border":
                parts.append(f"the {name} loop is on the border of stability")
            else:
                seen: dict[bool | None, str] = {
                    True: ", and a run of it grows as predicted",
                    False: ", but no run of it grows so",
                }
                parts.append(f"the {name} loop is unstable{seen.get(row.passed if row else None, '')}")
        return "; ".join(parts)

    @property
    def hunting(self) -> bool:
        """Whether the drive does not come to rest after a step, by dry friction.

        A swing of less than `NOTICED` of full deflection is listed with what friction does, it fails nothing.
        """
        points = () if self.friction is None else self.friction.points
        swings = [point.cycles.hunting for point in points]
        least = NOTICED * self.design.validation.full_deflection_rad
        return any(one is not None and one.swing_rad >= least for one in swings)

    @property
    def verdict(self) -> str:
        """In a word: ``"PASS"``, ``"FAIL"``, ``"UNDECIDED"`` or ``"NOTHING JUDGED"``."""
        if self.passed:
            return "PASS"
        if self.undecided and not (self.failed or self.unstable or self.hunting):
            return "UNDECIDED"
        return "FAIL" if self.judged else "NOTHING JUDGED"

    @property
    def passed(self) -> bool:
        """Whether predictions were judged, all hold, and the drive settles: no loop unstable or unknown, no
        command within full deflection diverges, dry friction sustains no motion.
        """
        unstable = bool(self.unstable or self.undecided or self.hunting)
        diverges = self.conditional is not None and self.conditional.diverges
        border = None if self.large_signals is None else self.large_signals.border
        off = border is not None and border.passed is False
        return self.judged and not (self.failed or unstable or diverges or off)

    def __str__(self) -> str:
        judged = [row for row in self.ledger if row.passed is not None]
        held = sum(row.passed is True for row in judged)
        wrong = [self.instability, "the drive hunts: after a step it does not come to rest" * self.hunting]
        first = "".join([f"{self.design.name}: ", *(f"{part}; " for part in wrong if part)])
        if not judged:
            return f"{first}nothing judged: no linear prediction could be compared"
        words = f"{first}{held} of {len(judged)} predictions agree with the simulation"
        words += f", {len(self.ledger) - len(judged)} shown with the reason why they need not"
        if self.conditional is not None and self.conditional.diverges:
            ending = {"keeps oscillating": "oscillate", "is held by a limit": "stop short"}
            does = ending.get(self.conditional.ending, "diverge")
            words += f"; a command within full deflection makes the drive {does}"
            if self.conditional.limiter:
                words += f" ({self.conditional.limiter} limit)"
        border = None if self.large_signals is None else self.large_signals.border
        if border is not None and border.passed is False:
            words += (
                "; a limit first acts at another command, or is another one, than the linear loop foresees"
            )
        return words
