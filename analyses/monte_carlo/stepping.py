"""A step of the nonlinear drive for every sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.batch import Population
from actuator_lti.errors import InputError
from analyses.engine import Arrays


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


def step_rows(step: StepCheck, population: Population) -> np.ndarray:
    """Simulator rows of every design: the nominal one with the changed columns put in."""
    from nonlinear._kernels import layout as at
    from nonlinear.batch import Reducers, put_step, repeat_row
    from nonlinear.parameters import design_row

    rows = repeat_row(design_row(population.design), population.count)
    _put_plant(population, rows)
    _put_controllers(population, rows)
    places = {
        at.SPEED_LIMIT: "limits.speed", at.ACCELERATION_LIMIT: "limits.acceleration",
        at.CURRENT_LIMIT: "limits.peak_current", at.VOLTAGE_LIMIT: "limits.voltage",
    }  # fmt: skip
    for place, path in places.items():
        if path in population.values:
            rows[:, place] = population.get(path)
    rows[:, at.LOAD] = step.load_Nm
    rows[:, at.TICKS] = np.maximum(np.round(step.duration_s / rows[:, at.PERIOD]), 1.0)
    Reducers(step_target_rad=step.amplitude_rad, extremes=True).write(rows)
    put_step(rows, at.COMMAND, step.amplitude_rad)
    return rows


def _put_plant(population: Population, rows: np.ndarray) -> None:
    from nonlinear._kernels import layout as at

    rows[:, at.RATIO] = population.stacked.total_ratio
    rows[:, at.INERTIA] = population.stacked.inertia_kgm2
    rows[:, at.DRY], rows[:, at.DRY_REVERSE] = (
        population.stacked.friction.dry_Nm(0.0, way) for way in (1, -1)
    )
    rows[:, at.VISCOUS], rows[:, at.VISCOUS_REVERSE] = (
        population.stacked.friction.viscous(way) for way in (1, -1)
    )
    places = {
        at.RESISTANCE: "motor.resistance", at.INDUCTANCE: "motor.inductance",
        at.BACK_EMF: "motor.back_emf_constant", at.TORQUE_CONSTANT: "motor.torque_constant",
        at.SOURCE_GAIN: "motor.source_gain", at.LOAD_COEFFICIENT: "friction.load_coefficient",
        at.BREAKAWAY: "friction.breakaway_ratio", at.SMOOTHING: "friction.smoothing_speed",
        at.OFFSET: "friction.offset_torque",
    }  # fmt: skip
    for place, path in places.items():
        if path in population.values:
            rows[:, place] = population.get(path)


def _put_controllers(population: Population, rows: np.ndarray) -> None:
    from nonlinear._kernels import layout as at

    design, period = population.design, np.asarray(population.get("control.period"))
    ratio = np.asarray(population.get("control.computing_delay")) / period
    whole = np.floor(ratio + 1e-9)
    rest = (ratio - whole) * period
    rows[:, at.PERIOD] = period
    rows[:, at.DELAY_TICKS] = whole
    rows[:, at.DELAY_FRACTION] = np.where(np.abs(rest) < 1e-9 * period, 0.0, rest)
    rows[:, at.POSITION_GAIN] = population.get("control.position.gain")
    rows[:, at.FEEDFORWARD] = population.get("control.position.feedforward")
    velocity, current = design.controller.velocity, design.controller.current
    if velocity is not None:
        gain = population.get("control.velocity.gain")
        rows[:, at.VELOCITY_GAIN] = gain
        if velocity.integral_time_s is not None:
            held = velocity.every * period
            rows[:, at.VELOCITY_INTEGRAL] = gain * held / population.get("control.velocity.integral_time")
        filter_time = np.asarray(population.get("encoder.filter_time"))
        rows[:, at.FILTER_COEFFICIENT] = velocity.every * period / (filter_time + velocity.every * period)
    if current is not None:
        gain = population.get("control.current.gain")
        rows[:, at.CURRENT_GAIN] = gain
        if current.integral_time_s is not None:
            rows[:, at.CURRENT_INTEGRAL] = gain * period / population.get("control.current.integral_time")


def step_columns(step: StepCheck, population: Population) -> Arrays:
    """Figures of the nonlinear step of every design, by the columns of `step_units`."""
    from nonlinear.batch import run_rows

    result = run_rows(step_rows(step, population), threads=1)
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
