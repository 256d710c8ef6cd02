"""Tune a design: rules, refinement, rounding to the controller's steps, all corners, nonlinear check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.asked.quantities import LOOP_QUANTITIES
from actuator_lti.design import parameter_value, paths_of, with_values
from actuator_lti.design.fields import Structure, field_of
from actuator_lti.design.loader import as_design
from analyses.monte_carlo.judging import in_populations, label
from analyses.tuning.asked import Aim, TuningSettings
from analyses.tuning.least import least_change
from analyses.tuning.placing import Placed, checked, neighbours, object_of, place, step_of_gain, subsets
from analyses.tuning.problem import MOST_DESIGNS, Problem, limit_of, loop_requirements, problem_of, size_of
from analyses.tuning.result import BindingRequirement, GainSetting, TuningResult, confirm, nonlinear_checks
from analyses.tuning.rules import RuleGains, rule_gains
from analyses.tuning.solve import RESERVE, Solution, solve, trade_off

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, Requirement
    from analyses.specification.requirements import RequirementVerdict

Progress = Callable[[int, int], None]
_BINDS = 0.02  # relative distance above the smallest within which a requirement counts as binding


def tune(
    design: Design | str | PathLike[str],
    settings: TuningSettings | None = None,
    *,
    progress: Progress | None = None,
) -> TuningResult:
    """Find gains that meet the requirements on loops over all corners of the tolerances.

    With the aim ``least-change`` those nearest to the design as it is (`analyses.tuning.least`); with
    ``reserve`` those that stay as far as possible from every limit, relative to the limit. Both search the
    exact sampled loops. Where gains alone do not do, the elements of ``place`` are tried, one, then two, then
    all; the fewest that do are kept. Where nothing does, the best compromise comes back, and the distances
    say by how much it misses. What is returned is judged once more by certified margins.

    Parameters
    ----------
    progress : callable, optional
        Called with (stages done, stages in all).

    Raises
    ------
    InputError
        If there is no requirement on a loop, or an element has no place in the drive.
    """
    design, settings = as_design(design), settings or TuningSettings()
    wanted = loop_requirements(design, settings.requirements)
    choices = list(subsets(checked(design, settings.place)))
    stages = len(choices) + 3
    tell = progress or (lambda done, total: None)
    tell(0, stages)
    rules = rule_gains(design)
    searched = 0
    best: Attempt | None = None
    for k, elements in enumerate(choices):
        placed = place(design, elements)
        problem = problem_of(
            placed.design, wanted, rules.values, placed.variables, share_of(searched, len(choices) - k)
        )
        seek = least_change if settings.aim == "least-change" else solve
        solution = seek(problem, give_up=k + 1 < len(choices))
        searched += problem.evaluations
        if best is None or solution.slack > best.solution.slack:
            best = Attempt(placed, problem, solution, problem.evaluations)
        tell(k + 1, stages)
        if solution.slack >= 0.0:
            break
    assert best is not None
    placed, problem, solution = best.placed, best.problem, best.solution
    gains = _rounded(problem, solution, settings.aim) if settings.rounded else solution.gains
    result = problem.exact_distances(gains[None, :], problem.all_corners)[0]
    tuned = replace(_tuned(problem, gains), name=f"{design.name}-tuned")
    tell(len(choices) + 1, stages)
    requirements = _binding(problem, gains, result, settings.aim)
    confirmed = confirm(tuned, wanted, requirements)
    tell(len(choices) + 2, stages)
    checks = nonlinear_checks(tuned, problem, result) if settings.check else ()
    curve = trade_off(problem, solution.gains, solution.working[:3]) if settings.curve else ()
    searched += problem.evaluations - best.evaluations
    tell(stages, stages)
    return TuningResult(
        bool(result.min() >= 0.0) and all(v.passes for v in confirmed),
        design,
        tuned,
        _settings(problem, design, rules, solution.gains, gains),
        requirements,
        rules.steps,
        len(problem.all_corners),
        checks,
        curve,
        searched,
        (*_notes(problem, gains, result), *_said(confirmed), *_left_out(design)),
        settings.aim,
        placed.elements,
        confirmed,
    )


def share_of(searched: int, choices: int) -> int:
    """Designs that the next of some choices may look at: half of what is left, all of it for the last."""
    left = MOST_DESIGNS - searched
    return max(left if choices == 1 else left // 2, MOST_DESIGNS // 12)


@dataclass(frozen=True)
class Attempt:
    """What one choice of elements came to."""

    placed: Placed
    problem: Problem
    solution: Solution
    evaluations: int


def _said(confirmed: tuple[RequirementVerdict, ...]) -> tuple[str, ...]:
    """Where a certified margin does not bear out what the search result."""
    return tuple(
        f"Not confirmed by certified margins: {v.id}: "
        + (v.reason if v.value is None else f"{v.value:.6g} {v.requirement.unit}")
        for v in confirmed
        if v.verdict != "met"
    )


def _left_out(design: Design) -> tuple[str, ...]:
    """Requirements on loops that the search does not see."""
    of_loops = [item for item in design.requirements if item.quantity in LOOP_QUANTITIES]
    names = ", ".join(item.id for item in of_loops if not in_populations(item, design))
    return (f"Not searched for, as each takes a computation of one design: {names}.",) if names else ()


def _rounded(problem: Problem, solution: Solution, aim: Aim) -> np.ndarray:
    """Of all roundings up and down: the least change that meets all, or else the one farthest from limits."""
    choices = neighbours(problem.design, problem.paths, solution.gains)
    slack = problem.distances(choices, solution.working).min(axis=(1, 2))
    order = -slack
    if aim == "least-change":
        order = np.where(slack >= 0.0, problem.change(choices) - 1e6, -slack)
    best = np.argsort(order, kind="stable")[:4]
    whole = problem.distances(choices[best], problem.all_corners).min(axis=(1, 2))
    if aim == "least-change" and np.any(whole >= 0.0):
        return choices[best[int(np.argmax(whole >= 0.0))]]
    return choices[best[int(np.argmax(whole))]]


def _tuned(problem: Problem, gains: np.ndarray) -> Design:
    pairs = zip(problem.paths, map(float, gains), problem.variables, strict=True)
    # what did not move keeps its text and source
    moved = {path: value for path, value, v in pairs if v.home is None or value != v.home}
    return with_values(problem.design, moved)


def _binding(
    problem: Problem, gains: np.ndarray, result: np.ndarray, aim: Aim
) -> tuple[BindingRequirement, ...]:
    """Every requirement at its worst corner."""
    smallest = float(result.min())
    enough = smallest >= RESERVE * (1.0 - _BINDS)
    if aim == "least-change":  # nothing binds a design that meets all as it came
        enough = smallest >= _BINDS or np.array_equal(gains, problem.present)
    made = []
    for k, requirement in enumerate(problem.requirements):
        corner = int(np.argmin(result[:, k]))
        relative = float(result[corner, k])
        known = -3.0 < relative < np.inf
        distance = relative * size_of(requirement) if known else None
        made.append(
            BindingRequirement(
                requirement.id, label(requirement), requirement.unit, _value(requirement, distance),
                limit_of(requirement), distance, relative, relative <= smallest + _BINDS and not enough,
                {} if corner == 0 else {f.path: float(v) for f, v in
                                        zip(problem.factors, problem.all_corners[corner], strict=True)},
            )
        )  # fmt: skip
    return tuple(made)


def _value(requirement: Requirement, distance: float | None) -> float | None:
    """The figure itself, from its distance to the limit."""
    if distance is None:
        return None
    limit = limit_of(requirement)
    return limit + distance if requirement.minimum is not None else limit - distance


def _settings(
    problem: Problem, before: Design, rules: RuleGains, tuned: np.ndarray, rounded: np.ndarray
) -> tuple[GainSetting, ...]:
    known_before = set(paths_of(before))
    made = []
    for k, path in enumerate(problem.paths):
        known, step, field = (
            object_of(problem.design, path),
            step_of_gain(problem.design, path),
            field_of(path),
        )
        assert field is not None
        made.append(
            GainSetting(
                path, field.unit(Structure.of(problem.design)),
                parameter_value(before, path) if path in known_before else None,
                rules.values.get(path), float(tuned[k]), "" if known is None else known.label,
                "" if known is None else known.unit, None if step is None else round(rounded[k] / step),
                float(rounded[k]),
            )
        )  # fmt: skip
    return tuple(made)


def _notes(problem: Problem, gains: np.ndarray, result: np.ndarray) -> tuple[str, ...]:
    notes = [
        "Distances are the smallest over the nominal design and all corners of the tolerance box; a margin "
        "that is worst inside the box is not seen here, `montecarlo` on the tuned design looks there.",
    ]
    left = [f.path for f in problem.toleranced if f not in problem.factors]
    if left:
        notes.append(f"Corners are those of the ten strongest tolerances; nominal: {', '.join(left)}.")
    if problem.spent:
        notes.append(f"The search ended after {problem.evaluations} designs, its bound.")
    if result.min() < 0.0:
        missed = [r.id for k, r in enumerate(problem.requirements) if result[:, k].min() < 0.0]
        notes.insert(0, f"Cannot be met together, best compromise found misses: {', '.join(missed)}.")
    at_end = (gains <= problem.lower * (1 + 1e-9)) | (gains >= problem.upper * (1 - 1e-9))
    at_end &= gains != problem.present
    ends = [path for path, at in zip(problem.paths, at_end, strict=True) if at]
    if ends:
        notes.append(f"At the end of what may be set, and so binding too: {', '.join(ends)}.")
    return tuple(notes)
