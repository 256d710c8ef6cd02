"""A step of the nonlinear drive for every sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.batch import Population
from actuator_lti.errors import InputError
from analyses.engine import Arrays

if TYPE_CHECKING:
    from nonlinear import Rows


@dataclass(frozen=True)
class StepCheck:
    """A step command at the output shaft, from rest.

    Attributes
    ----------
    amplitude_rad : float
        Linear axis: m.
    duration_s : float
    load_Nm : float
        Hinge moment, constant.
    """

    amplitude_rad: float
    duration_s: float = 0.5
    load_Nm: float = 0.0

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
    """Simulator rows of every design: the nominal one with the changed columns put in."""
    from nonlinear import Rows

    rows = Rows.of(population.design, population.count)
    _put_plant(population, rows)
    _put_controllers(population, rows)
    places = {
        "speed_limit": "limits.speed", "acceleration_limit": "limits.acceleration",
        "current_limit": "limits.peak_current", "voltage_limit": "limits.voltage",
    }  # fmt: skip
    for place, path in places.items():
        if path in population.values:
            rows[place] = population.get(path)
    rows["load"] = step.load_Nm
    rows["ticks"] = np.maximum(np.round(step.duration_s / rows["period"]), 1.0)
    rows.step_figures(step.amplitude_rad)
    rows.extremes()
    rows.step("command", step.amplitude_rad)
    return rows


def _put_plant(population: Population, rows: Rows) -> None:
    stacked = population.stacked
    rows["ratio"], rows["inertia"] = stacked.total_ratio, stacked.inertia_kgm2
    rows["dry"], rows["dry_reverse"] = (stacked.friction.dry_Nm(0.0, way) for way in (1, -1))
    rows["viscous"], rows["viscous_reverse"] = (stacked.friction.viscous(way) for way in (1, -1))
    places = {
        "resistance": "motor.resistance", "inductance": "motor.inductance",
        "back_emf": "motor.back_emf_constant", "torque_constant": "motor.torque_constant",
        "source_gain": "motor.source_gain", "load_coefficient": "friction.load_coefficient",
        "breakaway": "friction.breakaway_ratio", "smoothing": "friction.smoothing_speed",
        "offset": "friction.offset_torque",
    }  # fmt: skip
    for place, path in places.items():
        if path in population.values:
            rows[place] = population.get(path)


def _put_controllers(population: Population, rows: Rows) -> None:
    design, period = population.design, np.asarray(population.get("control.period"))
    ratio = np.asarray(population.get("control.computing_delay")) / period
    whole = np.floor(ratio + 1e-9)
    rest = (ratio - whole) * period
    rows["period"] = period
    rows["delay_ticks"] = whole
    rows["delay_fraction"] = np.where(np.abs(rest) < 1e-9 * period, 0.0, rest)
    rows["position_gain"] = population.get("control.position.gain")
    rows["feedforward"] = population.get("control.position.feedforward")
    velocity, current = design.controller.velocity, design.controller.current
    if velocity is not None:
        gain = population.get("control.velocity.gain")
        rows["velocity_gain"] = gain
        if velocity.integral_time_s is not None:
            held = velocity.every * period
            rows["velocity_integral"] = gain * held / population.get("control.velocity.integral_time")
        filter_time = np.asarray(population.get("encoder.filter_time"))
        rows["filter_coefficient"] = velocity.every * period / (filter_time + velocity.every * period)
    if current is not None:
        gain = population.get("control.current.gain")
        rows["current_gain"] = gain
        if current.integral_time_s is not None:
            rows["current_integral"] = gain * period / population.get("control.current.integral_time")


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
