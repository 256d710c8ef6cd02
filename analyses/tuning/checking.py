"""The tuned design once more: by certified margins, and by steps in the nonlinear model."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.batch import Population
from actuator_lti.design import with_values
from actuator_lti.loops import assemble_loops
from analyses.linear.loop_figures import all_loop_figures
from analyses.monte_carlo.stepping import StepCheck, step_columns
from analyses.specification.requirements import judged
from analyses.tuning.problem import Problem
from analyses.tuning.result import NonlinearCheck

if TYPE_CHECKING:
    from actuator_lti.design.model import Design, Requirement
    from analyses.specification.requirements import RequirementVerdict
    from analyses.tuning.result import BindingRequirement

_SMALL = 0.05


def confirm(
    tuned: Design, requirements: tuple[Requirement, ...], binding: tuple[BindingRequirement, ...]
) -> tuple[RequirementVerdict, ...]:
    """Judge the tuned design, and each requirement's worst corner, by certified margins.

    The search asks the many-designs figures; this asks what ``margins`` asks. ``binding`` holds the same
    requirements at their worst corners.
    """
    timed = any(QUANTITIES[item.quantity].timed for item in requirements)
    rows: dict[tuple[tuple[str, float], ...], list[Requirement]] = {(): list(requirements)}
    for item, result in zip(requirements, binding, strict=True):
        if result.corner:
            rows.setdefault(tuple(sorted(result.corner.items())), []).append(item)
    verdicts: list[RequirementVerdict] = []
    for corner, asked in rows.items():
        design = with_values(tuned, dict(corner), check=False)
        figures = all_loop_figures(assemble_loops(design), step=timed, certify=True)
        for requirement in asked:
            verdicts += [
                replace(each, id=f"{each.id}, worst corner") if corner else each
                for each in judged(design, requirement, figures, _nothing)
            ]
    return tuple(verdicts)


def _nothing(name: str) -> tuple[float | None, str]:
    return None, f"{name}: not a figure of a loop"


def nonlinear_checks(tuned: Design, problem: Problem, result: np.ndarray) -> tuple[NonlinearCheck, ...]:
    """Steps of a twentieth of full deflection and of full deflection, with every limit and friction on."""
    from analyses.comparison.variant_figures import LargeSignal

    worst = int(np.argmin(result.min(axis=1)))
    plan = LargeSignal.plan(tuned)
    rows = {"nominal": problem.all_corners[0]}
    if worst:
        rows["worst corner"] = problem.all_corners[worst]
    population = Population(
        tuned,
        {f.path: np.array([row[k] for row in rows.values()]) for k, f in enumerate(problem.factors)},
        len(rows),
    )
    checks = []
    for share in (_SMALL, 1.0):
        step = StepCheck(share * plan.deflection_rad, plan.duration_s)
        columns = step_columns(step, population)
        for k, corner in enumerate(rows):
            checks.append(_check({n: float(v[k]) for n, v in columns.items()}, corner, step.amplitude_rad))
    return tuple(checks)


def _check(values: dict[str, float], corner: str, amplitude_rad: float) -> NonlinearCheck:
    limited = [
        f"{name} {values[f'nonlinear.{name}_limited']:.1f} %"
        for name in ("speed", "current", "voltage")
        if values[f"nonlinear.{name}_limited"] > 0.0
    ]
    return NonlinearCheck(
        corner, amplitude_rad, _known(values["nonlinear.rise_time"]), values["nonlinear.overshoot"],
        _known(values["nonlinear.settling_time"]), values["nonlinear.final_error"], ", ".join(limited),
    )  # fmt: skip


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
