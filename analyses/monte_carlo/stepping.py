"""A step of the nonlinear drive for every sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.batch import Population
from actuator_lti.errors import InputError
from analyses.studies.engine import Arrays

if TYPE_CHECKING:
    from nonlinear import Rows


@dataclass(frozen=True)
class StepCheck:
    """A step command at the output shaft, from rest."""

    amplitude_rad: float  # linear axis: m
    duration_s: float = 0.5
    load_Nm: float = 0.0  # load torque, constant

    def __post_init__(self) -> None:
        if not (0 < self.amplitude_rad < np.inf and 0 < self.duration_s <= 100.0):
            raise InputError("nonlinear step: an amplitude above 0 and a duration above 0, at most 100 s")


def step_units() -> dict[str, str]:
    """Columns of a nonlinear step with their units.

    Rise, overshoot and settling against the commanded angle (missing where it is not reached);
    ``final_error`` at the end, in percent of it; shares of the time in which a limiter acted.
    """
    return {
        "nonlinear.rise_time": "s",
        "nonlinear.overshoot": "%",
        "nonlinear.settling_time": "s",
        "nonlinear.final_error": "%",
        "nonlinear.peak_current": "A",
        "nonlinear.speed_limited": "%",
        "nonlinear.current_limited": "%",
        "nonlinear.voltage_limited": "%",
    }


def step_rows(step: StepCheck, population: Population) -> Rows:
    """Simulator rows of every design."""
    from nonlinear import Rows

    rows = Rows.of(population.stacked, population.count)
    rows["load"] = step.load_Nm
    rows["ticks"] = np.maximum(np.round(step.duration_s / rows["period"]), 1.0)
    rows.step_figures(step.amplitude_rad)
    rows.extremes()
    rows.step("command", step.amplitude_rad)
    return rows


def step_columns(step: StepCheck, population: Population) -> Arrays:
    """Figures of the nonlinear step of every design, by the columns of `step_units`."""
    result = step_rows(step, population).run(threads=1)
    low, high = result.extreme("current_A")
    figures = result.step
    columns = {
        "nonlinear.rise_time": figures.rise_time_s,
        "nonlinear.overshoot": figures.overshoot_percent,
        "nonlinear.settling_time": figures.settling_time_s,
        "nonlinear.final_error": 100.0 * (1.0 - figures.final_ratio),
        "nonlinear.peak_current": np.maximum(np.abs(low), np.abs(high)),
        **{f"nonlinear.{name}_limited": 100.0 * result.limit_fraction(name)
           for name in ("speed", "current", "voltage")},
    }  # fmt: skip
    return {name: np.where(result.ok, values, np.nan) for name, values in columns.items()}
