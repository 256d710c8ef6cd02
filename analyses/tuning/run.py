"""Tune a design: rules, refinement, rounding to the controller's steps, all corners, nonlinear check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from analyses.monte_carlo.judging import label
from analyses.tuning.checking import nonlinear_checks
from analyses.tuning.objects import neighbours, object_of, step_of_gain
from analyses.tuning.problem import Problem, limit_of, loop_requirements, problem_of, size_of
from analyses.tuning.program import RESERVE
from analyses.tuning.result import BindingRequirement, GainSetting, TuningResult
from analyses.tuning.rules import RuleGains, rule_gains
from analyses.tuning.solve import Solution, solve
from analyses.tuning.trade_off import trade_off

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, Requirement

Progress = Callable[[int, int], None]
_BINDS = 0.02  # relative distance above the smallest within which a requirement counts as binding


@dataclass(frozen=True)
class TuningSettings:
    """What tuning is to do.

    Attributes
    ----------
    requirements : tuple of Requirement
        In place of those of the design on the same figure of the same loop.
    rounded : bool
        Round the gains to the steps of the motion controller's objects, where the design has them.
    curve, check : bool
        Whether the trade-off curve and the nonlinear check are wanted.
    """

    requirements: tuple[Requirement, ...] = ()
    rounded: bool = True
    curve: bool = True
    check: bool = True


def tune(
    design: Design, settings: TuningSettings | None = None, *, progress: Progress | None = None
) -> TuningResult:
    """Find gains that stay as far as possible from every limit, over all corners of the tolerances.

    From the inner loop out by the rules of `rule_gains`, then by optimisation over the exact sampled loops:
    the smallest distance to a requirement, relative to its limit, is made as large as possible, at every
    corner of the tolerance box. Where it stays negative the requirements cannot be met together, and the
    distances say by how much the best compromise misses them.

    Parameters
    ----------
    design : Design
    settings : TuningSettings, optional
    progress : callable, optional
        Called with (stages done, stages in all).

    Raises
    ------
    InputError
        If there is no requirement on a loop.
    """
    settings = settings or TuningSettings()
    tell = progress or (lambda done, total: None)
    rules = rule_gains(design)
    problem = problem_of(design, loop_requirements(design, settings.requirements), _present(design, rules))
    tell(1, 5)
    solution = solve(problem)
    tell(2, 5)
    gains = _rounded(problem, solution) if settings.rounded else solution.gains
    tell(3, 5)
    result = problem.distances(gains[None, :], problem.all_corners)[0]
    tuned = _tuned(problem, gains)
    curve = trade_off(problem, solution.gains, solution.working[:3]) if settings.curve else ()
    tell(4, 5)
    requirements = _binding(problem, gains, result)
    checks = nonlinear_checks(tuned, problem, gains, result) if settings.check else ()
    tell(5, 5)
    return TuningResult(
        bool(result.min() >= 0.0),
        design,
        tuned,
        _settings(problem, rules, solution.gains, gains),
        requirements,
        rules.steps,
        len(problem.all_corners),
        checks,
        curve,
        problem.evaluations,
        _notes(problem, gains, result),
    )


def _present(design: Design, rules: RuleGains) -> dict[str, float]:
    """Rule gains; a P controller keeps having no integral time."""
    return dict(rules.values)


def _rounded(problem: Problem, solution: Solution) -> np.ndarray:
    """Of all roundings up and down the one that stays farthest from the limits."""
    choices = neighbours(problem.design, problem.paths, solution.gains)
    slack = problem.distances(choices, solution.working).min(axis=(1, 2))
    best = np.argsort(-slack, kind="stable")[:4]
    whole = problem.distances(choices[best], problem.all_corners).min(axis=(1, 2))
    return choices[best[int(np.argmax(whole))]]


def _tuned(problem: Problem, gains: np.ndarray) -> Design:
    from actuator_lti.design import with_values

    changed = with_values(problem.design, dict(zip(problem.paths, map(float, gains), strict=True)))
    return replace(changed, name=f"{problem.design.name}-tuned")


def _binding(problem: Problem, gains: np.ndarray, result: np.ndarray) -> tuple[BindingRequirement, ...]:
    """Every requirement at its worst corner."""
    smallest = float(result.min())
    enough = smallest >= RESERVE * (1.0 - _BINDS)
    made = []
    for k, requirement in enumerate(problem.requirements):
        corner = int(np.argmin(result[:, k]))
        relative = float(result[corner, k])
        known = -3.0 < relative < 10.0
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
    problem: Problem, rules: RuleGains, tuned: np.ndarray, rounded: np.ndarray
) -> tuple[GainSetting, ...]:
    from actuator_lti.design import parameter_value
    from actuator_lti.design.fields import Structure, field_of

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
                path, field.unit(Structure.of(problem.design)), parameter_value(problem.design, path),
                rules.values[path], float(tuned[k]), "" if known is None else known.label,
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
    if result.min() < 0.0:
        missed = [r.id for k, r in enumerate(problem.requirements) if result[:, k].min() < 0.0]
        notes.insert(0, f"Cannot be met together, best compromise found misses: {', '.join(missed)}.")
    at_end = (gains <= problem.lower * (1 + 1e-9)) | (gains >= problem.upper * (1 - 1e-9))
    ends = [path for path, at in zip(problem.paths, at_end, strict=True) if at]
    if ends:
        notes.append(f"At the end of what may be set, and so binding too: {', '.join(ends)}.")
    return tuple(notes)
