"""Run every failure of a design on the split drive of `analyses.failures.cases`."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf

import numpy as np

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import follows_angle, runs, straight
from actuator_lti.errors import InputError, NumericalError, UnstableError
from actuator_lti.types import Floats
from analyses.failures.asked import Asked
from analyses.failures.cases import Case, Halves, cases_of
from analyses.motion.settling import Settling, counted, outcome, settle, settling_ticks_of
from analyses.specification.capability import drive_figures
from analyses.specification.requirements import RequirementVerdict, judged_by, tally
from nonlinear.runs.trajectory import ADVICE


@dataclass(frozen=True)
class FailureCase:
    """One failure; time runs from the failure, deflection from where the output then was."""

    name: str  # such as ``"hard-over"``
    words: str  # what happens
    # Output side; the torque is that in the coupling; rigid, what the output takes: its inertia and load, or
    # on a jam the motor's torque less the train's friction
    time_s: Floats
    deflection_rad: Floats
    speed_rad_s: Floats
    current_A: Floats
    moment_Nm: Floats
    to_deflection_s: float | None  # either side, as the stop; ``None``: not reached while watched
    to_stop_s: float | None
    at_detection_rad: float  # largest deflection until the failure is detected
    peak_speed_rad_s: float  # largest magnitudes
    peak_current_A: float
    peak_moment_Nm: float
    protected_s: float | None  # when the overload protection (I2t) acts first


@dataclass(frozen=True)
class Failures:
    """All cases of a design."""

    design: Design
    asked: Asked
    cases: tuple[FailureCase, ...]
    left_out: dict[str, str]  # by name: why a case does not exist for the drive
    before: tuple[Settling, ...]  # what holding each start ends in, the drive whole

    @property
    def hard_over_time_s(self) -> float:
        """From the hard-over of the power stage to the stop; inf where it is not reached while watched."""
        reached = self.case("hard-over").to_stop_s
        return inf if reached is None else reached

    @property
    def failure_deflection_rad(self) -> float:
        """Largest deflection until detection over all failures."""
        return max(case.at_detection_rad for case in self.cases)

    @property
    def failure_moment_Nm(self) -> float:
        """Largest torque in the train over all failures."""
        return max(case.peak_moment_Nm for case in self.cases)

    @cached_property
    def requirements(self) -> tuple[RequirementVerdict, ...]:
        """Those of the design on failures."""
        return judged_by(self.design, "failures", self)

    @property
    def verdict(self) -> Verdict | None:
        """That of the requirements; ``None`` without any."""
        return tally(self.requirements).verdict if self.requirements else None

    def case(self, name: str) -> FailureCase:
        """A case by its name; raises `InputError` where there is none."""
        by_name = {one.name: one for one in self.cases}
        if name not in by_name:
            raise InputError(f"failure {name!r}: one of {', '.join(by_name)}")
        return by_name[name]


SETTLED = 1e-3
LONGEST_S = 5.0  # of waiting before a failure
MOST_TICKS = 400_000


def failures(design: AnyDesign, asked: Asked | None = None) -> Failures:
    """Follow every failure case from its start to the stop or to the end of the time watched.

    By default the design's full deflection is the stop, a tenth of it the deflection asked for.

    Raises `InputError`: for a drive whose closed loop is not stable, or a time of too many ticks. Raises
    `NumericalError`: if a run fails.

    >>> from actuator_lti.design import load_design
    >>> result = failures(load_design("ilr33-amber"))
    >>> result.case("jam").at_detection_rad < result.case("hard-over").at_detection_rad
    True
    """
    design = as_design(design)
    asked = Asked.of(design) if asked is None else asked
    if asked.watched_s / design.controller.period_s > MOST_TICKS:
        longest = f"{MOST_TICKS * design.controller.period_s:g} s ({MOST_TICKS} ticks)"
        raise InputError(f"watched_s = {asked.watched_s:g} s: allowed: at most {longest}")
    wait = ceil(_settling_s(design, asked) / design.controller.period_s)
    cases, left_out = cases_of(design, asked)
    before = {start: _before(design, asked.load_Nm, start) for start in sorted({c.start for c in cases})}
    settled = {start: Halves(design, asked.load_Nm) for start in before}
    for start, halves in settled.items():
        rest = before[start].rest
        stays = rest.comes_to_rest and not (runs(design) and follows_angle(design))
        _hold(halves, start, wait, MOST_TICKS if stays else wait, 2.0 * rest.amplitude)
    made = dict[str, FailureCase]()
    for case in cases:
        halves = settled[case.start].copy()
        if _reaches(halves, case):
            one = _followed(halves, asked, case)
            made[case.name] = _worse(made.get(case.name, one), one)
        else:
            left_out |= {case.name: f"its output does not get half-way to the stop in {LONGEST_S:g} s"}
    return Failures(design, asked, tuple(made.values()), left_out, tuple(before.values()))


def _before(design: Design, load_Nm: float, start: float) -> Settling:
    """What holding a start ends in; a drive that turns is asked without what passes as it turns."""
    if not runs(design):
        return outcome(design, load_Nm, start)
    one = settle(straight(design), load_Nm, start)
    return replace(one, rest=counted(one.rest, SETTLED * start))


def _worse(first: FailureCase, second: FailureCase) -> FailureCase:
    """That of the larger deflection until detection, with the larger peaks of both."""
    taken = max(first, second, key=lambda each: each.at_detection_rad)
    peaks = ("peak_speed_rad_s", "peak_current_A", "peak_moment_Nm")
    return replace(taken, **{name: max(getattr(first, name), getattr(second, name)) for name in peaks})


def _hold(halves: Halves, start: float, wait: int, most: int, swing: float) -> None:
    """Hold a start until what it orders spans over ``wait`` ticks `SETTLED` of its size beside its swing.

    Whole periods of the controller: a failure comes as its outermost stage runs, when it does the most.
    """
    whole = halves.whole(start)
    wait = ceil(wait / whole.base_ticks) * whole.base_ticks
    for _ in range(0, most, wait):
        piece = whole.advance(wait)
        if piece.status != "ok":
            raise NumericalError(f"before a failure ({piece.status}): {ADVICE[piece.status]}")
        seen = halves.followed(piece)
        if np.ptp(seen) <= SETTLED * abs(seen[-1]) + swing:
            break
    halves.go_on_from(whole)


def _settling_s(design: Design, asked: Asked) -> float:
    """Time to reach half the stop, or the speed before, and settle."""
    ticks, period = settling_ticks_of(design, SETTLED), design.controller.period_s
    if ticks == inf:
        raise UnstableError("failures: the closed loop is not stable")
    figures = drive_figures(design)
    rate, way = min(figures.output_rate_rad_s, design.command.rate_rad_s), 0.5 * asked.stop_rad
    if design.controller.position is None:
        rate, way = figures.acceleration_rad_s2, asked.speed_rad_s
    travel = way / rate if rate > 0.0 else LONGEST_S
    return min(0.1 + travel + ticks * period, MOST_TICKS * period)


def _followed(halves: Halves, asked: Asked, case: Case) -> FailureCase:
    """What comes of a failure."""
    Ts, start = halves.design.controller.period_s, halves.output_rad
    words = case.words.format(**halves.turning)
    case.broken(halves)
    rows = []
    for k in range(ceil(asked.watched_s / Ts) + 1):
        moved = halves.output_rad - start
        true = halves.step(case.command(k * Ts))
        overloaded = halves.controller.value("overloaded")
        rows.append((k * Ts, moved, true.output_speed_rad_s, true.current_A, halves.moment_Nm, overloaded))
        if case.stops and abs(moved) >= asked.stop_rad:
            break
    t, free, speed, current, moment, overloaded = np.array(rows).T
    moved = np.clip(free, -asked.stop_rad, asked.stop_rad)  # the stop is hard, a tick goes past it
    protected = t[overloaded > 0.0]
    return FailureCase(
        name=case.name,
        words=words,
        time_s=t,
        deflection_rad=moved,
        speed_rad_s=speed,
        current_A=current,
        moment_Nm=moment,
        to_deflection_s=_first(t, np.abs(free), asked.deflection_rad),
        to_stop_s=_first(t, np.abs(free), asked.stop_rad),
        at_detection_rad=float(np.abs(moved)[t <= asked.detection_s * (1.0 + 1e-12)].max()),
        peak_speed_rad_s=float(np.abs(speed).max()),
        peak_current_A=float(np.abs(current).max()),
        peak_moment_Nm=float(np.abs(moment).max()),
        protected_s=float(protected[0]) if protected.size else None,
    )


def _reaches(halves: Halves, case: Case) -> bool:
    """Follow the command until the output is where the failure happens; whether it gets there."""
    start, period = halves.output_rad, halves.design.controller.period_s
    for k in range(0 if case.at_rad is None else ceil(LONGEST_S / period)):
        if abs(halves.output_rad - start) >= (case.at_rad or 0.0):
            return True
        halves.step(case.command(k * period))
    return case.at_rad is None


def _first(t: Floats, size: Floats, level: float) -> float | None:
    """Time at which a level is first crossed, on a line between two ticks."""
    if size.max() < level:
        return None
    k = int(np.argmax(size >= level))
    return float(np.interp(level, size[k - 1 : k + 1], t[k - 1 : k + 1])) if k else float(t[0])
