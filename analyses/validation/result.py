"""What a validation finds."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.checks import CHECKS
from actuator_lti.design.model import Design
from actuator_lti.drive.signals import LIMITERS
from analyses.friction_effects.result import FrictionEffects
from analyses.large_signal.conditional import Conditional
from analyses.large_signal.from_rest import AmplitudeMargin, RestSweep
from analyses.large_signal.result import LargeSignals
from analyses.limit_cycles.counts import Counts
from analyses.linear.loop_figures import LoopFigures
from analyses.motion.settling import Settling, ending_of, noticed, verdict_of, waiver_of_rest
from analyses.specification import Specification
from analyses.validation.in_time import BenchSweep, MarginShown, StepShown
from analyses.validation.row import Row

REST = {
    Verdict.MET: "",
    Verdict.NOT_MET: "the drive does not come to rest ",
    Verdict.NOT_PROVEN: "the drive is not known to come to rest ",
}


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Everything the nonlinear simulator says of a design's predictions."""

    design: Design
    rows: tuple[Row, ...]  # every check: tangent, runs in time, numbers of the design
    figures: Mapping[str, LoopFigures]  # linear loops, as they are tested (the current's with a locked rotor)
    loops: Mapping[str, LoopFigures] = field(default_factory=dict)  # the same as `margins` judges them
    steps: Mapping[str, StepShown] = field(default_factory=dict)
    margins: Mapping[str, MarginShown] = field(default_factory=dict)  # runs on either side of the gain margin
    sweeps: Mapping[str, BenchSweep] = field(default_factory=dict)
    amplitude_margins: tuple[AmplitudeMargin, ...] = ()  # findings from here on
    conditional: Conditional | None = None
    rest_sweep: RestSweep | None = None
    counts: tuple[Counts, ...] = ()
    settlings: tuple[Settling, ...] = ()  # what steps of the drive as it is end in
    large_signals: LargeSignals | None = None
    friction: FrictionEffects | None = None
    specification: Specification | None = None
    held_by_friction: tuple[str, ...] = ()  # stable only with friction that is left out where it is tested
    notes: tuple[str, ...] = ()  # what could not be done, and why

    @property
    def tally(self) -> Tally:
        waived = [self.waived(f"{row.loop}/{row.name}") for row in self.rows]
        return Tally.of((row.verdict for row in self.rows), waived)

    def waived(self, what: str) -> bool:
        """Whether the design waives a check not proven: of a loop, or one row of it (``loop/name``)."""
        return self.design.waiver_of(f"{CHECKS}-{what}") is not None

    @property
    def not_met(self) -> tuple[Row, ...]:
        return tuple(row for row in self.rows if row.verdict is Verdict.NOT_MET)

    @property
    def unstable(self) -> tuple[str, ...]:
        """Loops that are not stable: as `analyses.margins` judges them, or where they are tested."""
        judged = [name for name, own in self.loops.items() if own.is_stable is False]
        tested = [name for name, own in self.figures.items() if own.margins.stable is False]
        spared = {*self.held_by_friction, *self.held}
        return tuple(dict.fromkeys([*judged, *(name for name in tested if name not in spared)]))

    @property
    def held(self) -> tuple[str, ...]:
        """Loops that are unstable only by themselves, in a drive that is stable."""
        return tuple(name for name, own in self.loops.items() if own.held is not None)

    @property
    def undecided(self) -> tuple[str, ...]:
        """Loops of which the data do not tell whether they are stable."""
        doubts = [name for name, own in self.figures.items() if own.margins.stable is None]
        doubts += [name for name, own in self.loops.items() if own.is_stable is None]
        return tuple(dict.fromkeys(doubts))

    @property
    def hunting(self) -> Settling | None:
        """The largest motion that a step of the drive as it is ends in, by whatever cause; None: it rests."""
        return noticed(self.design, self.settlings)

    @property
    def rest(self) -> Verdict:
        """Whether it comes to rest, or swings no more than its requirement accepts."""
        return verdict_of(self.design, self.hunting)

    @property
    def rest_words(self) -> str:
        """What is said of a drive that does not come to rest; empty where it does."""
        return "" if self.hunting is None else REST[self.rest] + ending_of(self.design, self.hunting)

    @property
    def failures(self) -> tuple[str, ...]:
        """What the drive does that it must not, beside rows that are not met; a sentence each."""
        free = {"current": ", rotor free"}
        found = [f"the {name} loop is unstable{free.get(name, '')}" for name in self.unstable]
        if self.rest is Verdict.NOT_MET:
            found.append(self.rest_words)
        if self.conditional is not None and self.conditional.diverges:
            ending = {"keeps oscillating": "oscillate", "is held by a limit": "stop short"}
            does = ending.get(self.conditional.ending, "diverge")
            by = f" ({LIMITERS[self.conditional.limiter].words})" if self.conditional.limiter else ""
            found.append(f"a command within full deflection makes the drive {does}{by}")
        return tuple(found)

    @property
    def verdict(self) -> Verdict:
        """``not met`` where a row is, or the drive fails by itself; then ``not proven``; else ``met``."""
        if self.not_met or self.failures:
            return Verdict.NOT_MET
        doubts = [not self.waived(f"stable-{name}") for name in self.undecided]
        doubts.append(self.rest is Verdict.NOT_PROVEN and waiver_of_rest(self.design) is None)
        return Verdict.NOT_PROVEN if not self.rows or any(doubts) else self.tally.verdict

    @property
    def passed(self) -> bool:
        """Whether every prediction was judged and met, and the drive comes to rest where it is sent."""
        return self.verdict is Verdict.MET

    def sentences(self) -> list[str]:
        """The verdict in words: rows counted, and what the drive does that it must not."""
        said = [self.tally.words("predictions"), *self.failures]
        said += [f"stability of the {name} loop not known" for name in self.undecided]
        return said + [self.rest_words] * (bool(self.rest_words) and self.rest is not Verdict.NOT_MET)

    @property
    def words(self) -> str:
        return "; ".join(self.sentences())

    def __str__(self) -> str:
        return f"{self.design.name}: {self.words}"
