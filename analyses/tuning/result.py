"""What tuning returns; the tuned design once more, by certified margins and by nonlinear steps."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.batch import Population
from actuator_lti.design.access import varied
from actuator_lti.design.model import Design, Requirement
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Floats
from analyses.comparison.found import LargeSignal
from analyses.finite import finite
from analyses.linear.loop_figures import all_loop_figures
from analyses.monte_carlo.task import StepCheck, step_columns
from analyses.motion.settling import ending_of, noticed, settlings_of, verdict_of
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements, judged, tally
from analyses.tuning.asked import Aim
from analyses.tuning.problem import Problem


@dataclass(frozen=True)
class BindingRequirement:
    """One requirement at its worst corner."""

    id: str
    label: str
    unit: str
    value: float | None  # worst over the corners; its distance is positive where met
    limit: float
    distance: float | None
    relative: float  # distance over the limit's size: what tuning makes as even as it can
    binds: bool  # whether it is among those that allow nothing better
    corner: Mapping[str, float]  # SI values of the worst corner; empty for the nominal design


@dataclass(frozen=True)
class GainSetting:
    """One gain."""

    path: str
    unit: str
    before: float | None  # SI; None of an added element, or without a rule
    by_rule: float | None
    tuned: float  # SI
    object: str  # label of the motion controller's object; empty where the design has none
    object_unit: str
    steps: int | None  # what is written into the object
    rounded: float  # SI value of that, or the tuned one; this is what the tuned design has


@dataclass(frozen=True)
class TradeOffPoint:
    """Largest phase margin that every loop keeps at its worst corner, at a bandwidth of the outermost."""

    bandwidth_hz: float
    phase_margin_deg: float
    feasible: bool


@dataclass(frozen=True)
class NonlinearCheck:
    """A step of the tuned design in the nonlinear model, with every limit and friction."""

    corner: str
    amplitude_rad: float  # linear axis: m; rad/s of a speed drive, A of a current drive
    rise_time_s: float | None
    overshoot_percent: float
    settling_time_s: float | None  # None where it does not stay within 2 % of the commanded angle
    final_error_percent: float  # friction may leave one that no gain removes
    limited: str  # the limiters that acted, and for how long


@dataclass(frozen=True)
class TuningResult:
    """A tuned design."""

    feasible: bool  # whether all that is searched for is met at every corner, with the rounded gains
    before: Design  # as it came; then with the rounded gains
    design: Design
    gains: tuple[GainSetting, ...]
    requirements: tuple[BindingRequirement, ...]
    steps: tuple[str, ...]  # how the start gains were found
    corners: int  # corners of the tolerance box that were checked (the nominal design counts)
    checks: tuple[NonlinearCheck, ...]
    trade_off: tuple[TradeOffPoint, ...]
    evaluations: int  # designs looked at
    notes: tuple[str, ...]
    aim: Aim = "least-change"
    placed: tuple[str, ...] = ()  # elements that were added, because gains alone do not meet the requirements
    confirmed: tuple[RequirementVerdict, ...] = ()  # what was searched for, also at each worst corner
    others: tuple[RequirementVerdict, ...] = ()  # all other requirements, of the tuned design
    spent: bool = False  # whether the search ended at its bound: then there may be something better
    hunting: str = ""  # after which step the tuned drive does not come to rest; empty: it does

    @property
    def verdict(self) -> Verdict:
        """What was searched for, and all other requirements."""
        return (Tally.of([Verdict.of(self.feasible)]) + tally(self.others)).verdict

    @property
    def passed(self) -> bool:
        """Whether every requirement is met."""
        return self.verdict.passes()

    def __str__(self) -> str:
        head = "what is tuned for is met" if self.feasible else "REQUIREMENTS CANNOT BE MET"
        open_ones = (f"{one.verdict}: {one.id}" for one in self.others if not one.passes)
        head = "every requirement met" if self.passed else head
        binding = (one for one in self.requirements if one.binds and one.distance)
        lines = [f"{self.design.name}: {head} over {self.corners} corners"]
        lines += [f"{g.path} = {g.rounded:.6g} {g.unit}" for g in self.gains]
        lines += [f"binding: {r.id} {r.distance:+.4g} {r.unit}" for r in binding]
        return "\n".join([*lines, *open_ones])


def confirm(
    tuned: Design, requirements: tuple[Requirement, ...], binding: tuple[BindingRequirement, ...]
) -> tuple[RequirementVerdict, ...]:
    """Judge every requirement of the tuned design, some at their worst corners, as ``margins`` does."""
    timed = any(QUANTITIES[item.quantity].timed for item in requirements)
    rows: dict[tuple[tuple[str, float], ...], list[Requirement]] = {}
    for item, result in zip(requirements, binding, strict=True):
        if result.corner:
            rows.setdefault(tuple(sorted(result.corner.items())), []).append(item)
    verdicts = [*evaluate_requirements(tuned, all_loop_figures(assemble_loops(tuned), certify=True))]
    for corner, asked in rows.items():
        design = varied(tuned, dict(corner))
        figures = all_loop_figures(assemble_loops(design), step=timed, certify=True)
        for requirement in asked:
            found = judged(design, requirement, figures, lambda name: (None, f"{name}: no figure of a loop"))
            verdicts += [replace(each, id=f"{each.id}, worst corner") for each in found]
    return tuple(verdicts)


def hunting(tuned: Design) -> str:
    """After which step a drive does not come to rest, as `validate` asks; empty where it does."""
    if tuned.controller.position is None:
        return ""
    swing = noticed(tuned, settlings_of(tuned))
    return ending_of(tuned, swing) if swing and verdict_of(tuned, swing) is Verdict.NOT_MET else ""


def nonlinear_checks(
    tuned: Design, problem: Problem, gains: Floats, result: Floats
) -> Iterator[NonlinearCheck]:
    """Steps of a twentieth and of all of full deflection (see `LargeSignal`), every limit and friction on."""
    worst, plan = int(np.argmin(result.min(axis=1))), LargeSignal.plan(tuned)
    names = ["nominal", "worst corner"][: 2 if worst else 1]
    points = problem.all_corners[[0, worst][: len(names)]]
    population = Population(tuned, problem.values_at(gains[None, :], points, problem.factors), len(names))
    for size in (0.05 * plan.step, plan.step):
        step = StepCheck(size)
        columns, percent_ms = step_columns(step, population), 10.0 * step.lasts_s(tuned)
        for k, corner in enumerate(names):
            seen = {name.partition(".")[2]: float(column[k]) for name, column in columns.items()}
            acted = {name: percent_ms * seen[f"{name}_limited"] for name in ("speed", "current", "voltage")}
            limited = ", ".join(f"{name} {ms:.3g} ms" for name, ms in acted.items() if ms > 0.0)
            rise, settling = finite(seen["rise_time"]), finite(seen["settling_time"])
            overshoot, error = seen["overshoot"], seen["final_error"]
            yield NonlinearCheck(corner, size, rise, overshoot, settling, error, limited)
