"""How much each parameter moves each figure: slopes over 0.1 %, swings over its tolerance or 10 %."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.asked.quantities import LOOP_QUANTITIES, drive_cases
from actuator_lti.batch import Population, drive_figures, linear_figures, variable_paths
from actuator_lti.design import parameter_value, tolerances
from actuator_lti.design.model import Design
from analyses.monte_carlo.judging import behind_mean
from analyses.studies.sampling import Factor

STEP = 1e-3
SWING = 0.1


@dataclass(frozen=True)
class Sensitivity:
    """One parameter and one figure."""

    path: str  # dotted key
    figure: str
    per_percent: float  # change of the figure per +1 % of the parameter (central difference of 0.1 %)
    low_value: float  # one end of the parameter, SI
    high_value: float
    low: float  # the figure there; NaN where it does not exist
    high: float

    @property
    def swing(self) -> float:
        """Distance between the figures at both ends."""
        return abs(_rise(self.low, self.high))


@dataclass(frozen=True)
class Sensitivities:
    """Every figure against every parameter."""

    base: Mapping[str, float]  # figures of the nominal design
    entries: tuple[Sensitivity, ...]

    def tornado(self, figure: str) -> tuple[Sensitivity, ...]:
        """The parameters that move a figure, the strongest first."""
        least = 1e-9 * max(abs(self.base[figure]), 1e-9)
        chosen = [one for one in self.entries if one.figure == figure and one.swing > least]
        return tuple(sorted(chosen, key=lambda one: (-one.swing, one.path)))


def sensitivities(design: Design, paths: Sequence[str] | None = None) -> Sensitivities:
    """Sensitivities of margins, bandwidths and static figures to parameters of a design, by dotted keys.

    By default to every number of the plant and the controller that is not zero.

    The position loop's crossover, and so its bandwidth, follows its gain:

    >>> from actuator_lti import load_design
    >>> result = sensitivities(load_design("ilr33-amber"), ["control.position.gain"])
    >>> round(result.tornado("position.bandwidth")[0].per_percent, 2)
    0.38
    """
    every = {path: parameter_value(design, path) for path in paths or variable_paths(design)}
    there = {path: value for path, value in every.items() if value != 0.0 and np.isfinite(value)}
    nominal = {path: value for path, value in there.items() if not path.startswith("friction.breakaway")}
    ends = {path: (value * (1 - SWING), value * (1 + SWING)) for path, value in nominal.items()}
    for path, _, tolerance in tolerances(design):
        if path in nominal:
            ends[path] = Factor(path, nominal[path], tolerance).box
    moves = [{p: to} for p, v in nominal.items() for to in (v * (1 - STEP), v * (1 + STEP), *ends[p])]
    figures = population_figures(moved(design, nominal, moves), design)
    entries = []
    for k, path in enumerate(nominal):
        for name, column in figures.items():
            down, up, low, high = column[1 + 4 * k : 5 + 4 * k].tolist()
            entries.append(Sensitivity(path, name, _rise(down, up) / (200.0 * STEP), *ends[path], low, high))
    return Sensitivities({name: float(column[0]) for name, column in figures.items()}, tuple(entries))


def _rise(low: float, high: float) -> float:
    """High less low; 0 where both are the same infinity (a stiffness that no load overcomes)."""
    return 0.0 if low == high else float(high - low)


def moved(design: Design, base: Mapping[str, float], moves: Sequence[Mapping[str, float]]) -> Population:
    """The design, and once for each move the same with some of its numbers at other values (SI)."""
    values = {p: np.array([value, *(one.get(p, value) for one in moves)]) for p, value in base.items()}
    return Population(design, values, 1 + len(moves))


def population_figures(
    population: Population, design: Design, *, time_figures: bool = False
) -> dict[str, np.ndarray]:
    """Figures of many designs by column; static ones at the design's loads, of unstable loops negative."""
    columns = population_loop_figures(population, design, time_figures=time_figures)
    for name, load in drive_cases(design.validation.loads_Nm):
        if name != "motor_current" or design.motor.has_electrical_dynamics:
            columns[f"drive.{name}@{load:g}"] = drive_figures(population, name, load)
    return columns


def population_loop_figures(
    population: Population, design: Design, *, time_figures: bool = False
) -> dict[str, np.ndarray]:
    """Those of `population_figures` that are of the loops alone."""
    linear = linear_figures(population, time_figures=time_figures, held=True)
    columns = {}
    for loop in linear.loops:
        for name, quantity in LOOP_QUANTITIES.items():
            unlike = behind_mean(design, loop, name)
            if (time_figures or not quantity.timed) and not unlike:  # stairs of samples have no slope
                values = linear.quantity(name, loop)
                sized = np.abs(values) if quantity.absolute else values
                columns[f"{loop}.{name}"] = np.where(linear.stable(loop), sized, -sized)
    return columns
