"""Tune a design: rules, refinement, rounding to the controller's steps, all corners, nonlinear check."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from actuator_lti.asked.quantities import with_unit
from actuator_lti.design import parameter_value, paths_of, with_values
from actuator_lti.design.fields import FIELDS, Structure, template_of
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design, Requirement
from actuator_lti.types import Floats, Progress
from analyses.specification.requirements import RequirementVerdict, words_of
from analyses.tuning import result
from analyses.tuning.asked import Aim, TuningSettings
from analyses.tuning.least import least_change
from analyses.tuning.problem import (
    MOST_DESIGNS,
    Problem,
    asked_for,
    gain_requirements,
    problem_of,
    why_not_searched,
)
from analyses.tuning.solve import POINTS, RESERVE, Solution, solve, trade_off
from analyses.tuning.start import Element, RuleGains, checked, neighbours, object_of, rule_gains, step_of_gain

_BINDS = 0.02  # relative distance above the smallest within which a requirement counts as binding


def tune(
    design: AnyDesign, settings: TuningSettings | None = None, *, progress: Progress = None
) -> result.TuningResult:
    """Find gains that meet the requirements that gains move over all corners of the tolerances.

    With the aim ``least-change`` those nearest to the design as it is (`analyses.tuning.least`); with
    ``reserve`` those that stay as far as possible from every limit, relative to the limit. Both search the
    exact sampled loops. Where gains alone do not do, the elements of ``place`` are tried, one, then two, then
    all; the fewest that do are kept. Where nothing does, the best compromise comes back, and the distances
    say by how much it misses. What is returned is judged once more as `margins` does, by every requirement of
    the design; what was searched for at its worst corners as well.

    ``progress`` is called with (stages done, stages in all).

    Raises `InputError`: if there is no requirement on a loop, or an element has no place in the drive.
    """
    design, settings = as_design(design), settings or TuningSettings()
    wanted = gain_requirements(design, settings.requirements)
    allowed = checked(design, settings.place)
    choices = [each for count in range(len(allowed) + 1) for each in combinations(allowed, count)]
    stages = len(choices) + 3 + POINTS * settings.curve
    tell = progress or (lambda done, total: None)
    tell(0, stages)
    rules = rule_gains(design)
    tried: list[tuple[Problem, Solution]] = []
    for one in _tried(design, wanted, choices, rules, settings.aim):
        tried.append(one)
        tell(len(tried), stages)
    problem, solution = max(tried, key=lambda one: one[1].slack)
    gains = _rounded(problem, solution, settings.aim) if settings.rounded else solution.gains
    distances = problem.exact_distances(gains[None, :], problem.all_corners)[0]
    moved = {  # what did not move keeps its text and source
        item.path: float(value)
        for item, value in zip(problem.variables, gains, strict=True)
        if item.home is None or value != item.home
    }
    stated = asked_for(problem.design, settings.requirements)
    tuned = with_values(problem.design, moved)
    tuned = replace(tuned, name=f"{design.name}-tuned", requirements=stated)
    tell(len(choices) + 1, stages)
    requirements = tuple(_binding(problem, gains, distances, settings.aim))
    verdicts = result.confirm(tuned, wanted, requirements)
    confirmed = tuple(v for v in verdicts if v.requirement in wanted)
    tell(len(choices) + 2, stages)
    checks = tuple(result.nonlinear_checks(tuned, problem, gains, distances)) if settings.check else ()
    curve = tuple[result.TradeOffPoint, ...]()
    if settings.curve:
        before = len(choices) + 2
        curve = trade_off(problem, solution.gains, solution.working[:3], lambda k: tell(before + k, stages))
    tell(stages, stages)
    feasible = bool(distances.min() >= 0.0) and all(v.passes for v in confirmed)
    return result.TuningResult(
        feasible=feasible,
        before=design,
        design=tuned,
        gains=tuple(_settings(problem, design, rules, solution.gains, gains)),
        requirements=requirements,
        steps=rules.steps,
        corners=len(problem.all_corners),
        checks=checks,
        trade_off=curve,
        evaluations=sum(one.evaluations for one, _ in tried),
        notes=(*why_not_searched(stated, design), *_notes(problem, gains, distances, confirmed)),
        aim=settings.aim,
        placed=problem.elements,
        confirmed=confirmed,
        others=tuple(v for v in verdicts if v.requirement not in wanted),
        spent=problem.spent,
        hunting=result.hunting(tuned) if settings.check and feasible else "",
    )


def _tried(
    design: Design,
    wanted: tuple[Requirement, ...],
    choices: Sequence[tuple[Element, ...]],
    rules: RuleGains,
    aim: Aim,
) -> Iterator[tuple[Problem, Solution]]:
    """What each choice of elements comes to, up to the first that does."""
    seek, left = least_change if aim == "least-change" else solve, MOST_DESIGNS
    for elements in choices:
        last = elements == choices[-1]
        most = max(left if last else left // 2, MOST_DESIGNS // 12)  # designs that it may look at
        problem = problem_of(design, wanted, rules.values, elements, most)
        solution = seek(problem, give_up=not last)
        left -= problem.evaluations
        yield problem, solution
        if solution.slack >= 0.0:
            return


def _rounded(problem: Problem, solution: Solution, aim: Aim) -> Floats:
    """Of all roundings up and down: the least change that meets all, or else the one farthest from limits."""
    choices = neighbours(problem.design, problem.paths, solution.gains)
    slack = problem.distances(choices, solution.working).min(axis=(1, 2))
    order = -slack
    if aim == "least-change":
        order = np.where(slack >= 0.0, problem.change(choices) - 1e6, -slack)
    best = np.argsort(order, kind="stable")[:4]
    whole = problem.distances(choices[best], problem.all_corners).min(axis=(1, 2))
    if aim == "least-change" and np.any(whole >= 0.0):
        whole = whole >= 0.0
    return choices[best[int(np.argmax(whole))]]


def _binding(
    problem: Problem, gains: Floats, distances: Floats, aim: Aim
) -> Iterator[result.BindingRequirement]:
    """Every requirement at its worst corner."""
    smallest = float(distances.min())
    enough = smallest >= RESERVE * (1.0 - _BINDS)
    if aim == "least-change":  # nothing binds a design that meets all as it came
        enough = smallest >= _BINDS or np.array_equal(gains, problem.present)
    for k, (requirement, away) in enumerate(zip(problem.requirements, distances.T, strict=True)):
        worst = int(np.argmin(away))
        relative, limit = float(away[worst]), requirement.bound
        distance = relative * requirement.size if -3.0 < relative < np.inf else None
        value = None
        if distance is not None:
            value = problem.found(gains, problem.all_corners[worst])[k]
            limit = requirement.nearer(value)
        values = problem.values_at(gains[None, :], problem.all_corners[[worst]], problem.factors)
        binds = relative <= smallest + _BINDS and not enough
        at = {factor.path: float(values[factor.path][0]) for factor in problem.factors if worst}
        words = words_of(requirement, requirement.loop, problem.design.load_unit)
        about = (requirement.id, words, requirement.unit)
        yield result.BindingRequirement(*about, value, limit, distance, relative, binds, at)


def _settings(
    problem: Problem, before: Design, rules: RuleGains, tuned: Floats, rounded: Floats
) -> Iterator[result.GainSetting]:
    there, structure = set(paths_of(before)), Structure.of(problem.design)
    for path, exact, value in zip(problem.paths, map(float, tuned), map(float, rounded), strict=True):
        known, step = object_of(problem.design, path), step_of_gain(problem.design, path)
        yield result.GainSetting(
            path=path,
            unit=FIELDS[template_of(path)].unit(structure),
            before=parameter_value(before, path) if path in there else None,
            by_rule=rules.values.get(path),
            tuned=exact,
            object=known.label if known else "",
            object_unit=known.unit if known else "",
            steps=None if step is None else round(value / step),
            rounded=value,
        )


def _notes(
    problem: Problem, gains: Floats, distances: Floats, confirmed: tuple[RequirementVerdict, ...]
) -> Iterator[str]:
    """What was missed, what was not looked at, what a certified margin does not bear out."""
    if distances.min() < 0.0:
        missed = [r.id for k, r in enumerate(problem.requirements) if distances[:, k].min() < 0.0]
        yield f"Cannot be met together, best compromise found misses: {', '.join(missed)}."
    yield (
        "Distances are the smallest over the nominal design and all corners of the tolerance box; a margin "
        "that is worst inside the box is not seen here, `montecarlo` on the tuned design looks there."
    )
    if left := [f.path for f in problem.toleranced if f not in problem.factors]:
        yield f"Corners are those of the ten strongest tolerances; nominal: {', '.join(left)}."
    if problem.spent:
        yield f"The search ended after {problem.evaluations} designs, its bound."
    at_end = (gains <= problem.lower * (1 + 1e-9)) | (gains >= problem.upper * (1 - 1e-9))
    at_end &= gains != problem.present
    if ends := [path for path, at in zip(problem.paths, at_end, strict=True) if at]:
        yield f"At the end of what may be set, and so binding too: {', '.join(ends)}."
    for one in confirmed:
        if one.verdict != "met":
            said = one.reason if one.value is None else with_unit(one.value, one.requirement.unit, ".6g")
            yield f"Not confirmed by certified margins: {one.id}: {said}"
