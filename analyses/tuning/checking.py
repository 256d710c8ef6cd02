"""The tuned design in the nonlinear model: small and large steps, nominal and worst corner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.batch import Population
from analyses.monte_carlo.stepping import StepCheck, step_columns
from analyses.tuning.problem import Problem
from analyses.tuning.result import NonlinearCheck

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

_SMALL = 0.05


def nonlinear_checks(
    tuned: Design, problem: Problem, gains: np.ndarray, result: np.ndarray
) -> tuple[NonlinearCheck, ...]:
    """Steps of a twentieth of full deflection and of full deflection, with every limit and friction on."""
    from analyses.variant_figures import LargeSignal

    worst = int(np.argmin(result.min(axis=1)))
    plan = LargeSignal.plan(tuned)
    rows = {"nominal": problem.all_corners[0], "worst corner": problem.all_corners[worst]}
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
