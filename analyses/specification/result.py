"""Everything that a specification of the actuator asks for, in one result; step times from small to full."""

from dataclasses import dataclass

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.loops import Loops, assemble_loops
from analyses.finite import finite
from analyses.large_signal.tones import TANH_TOLERANCE, settling_ticks_in_periods
from analyses.motion.settling import step_ticks
from analyses.specification import capability
from nonlinear import LIMITERS, Rows

SMALLEST = 0.01  # of full deflection: the small-signal step, beside the design's own fractions
BAND = 0.02


@dataclass(frozen=True)
class StepTime:
    """A step of the command, output side; ``None`` where a level was not reached in time."""

    load_Nm: float
    fraction: float  # of full deflection
    amplitude_rad: float
    rise_time_s: float | None  # 10 to 90 %
    overshoot_percent: float
    settling_time_s: float | None
    peak_rate_rad_s: float  # largest rate of the output
    peak_current_A: float | None
    limits: dict[str, float]  # fraction of the time simulated in which each limit acts, where it does


def step_times(design: Design) -> tuple[StepTime, ...]:
    """Simulate steps at every fraction of full deflection and every load torque."""
    fractions = sorted({SMALLEST, *design.validation.amplitude_fractions})
    loads = design.validation.loads_Nm
    sizes = np.tile(np.array(fractions) * design.validation.full_deflection_rad, len(loads))
    rows = Rows.of(design, len(sizes))
    rows.step("command", sizes)
    rows["load"], rows["tanh_tolerance"] = np.repeat(loads, len(fractions)), TANH_TOLERANCE
    rows.step_figures(sizes, BAND)
    rows.extremes()
    rows["ticks"] = step_ticks(design, sizes)
    result = rows.run()
    speeds, currents = result.extreme("motor_speed_rad_s"), result.extreme("current_A")
    peaks = np.maximum(-speeds[0], speeds[1]) / design.total_ratio
    if design.coupling is not None:  # the load swings on its spring
        runs = (rows.take(np.array([k])).trajectory() for k in range(len(sizes)))
        peaks = np.array([np.nanmax(np.abs(np.asarray(run.output_speed_rad_s))) for run in runs])
    electric = design.motor.has_electrical_dynamics
    limited = {name: result.limit_fraction(name) for name in LIMITERS}
    return tuple(
        StepTime(
            load_Nm=float(rows["load"][k]),
            fraction=fractions[k % len(fractions)],
            amplitude_rad=float(sizes[k]),
            rise_time_s=finite(result.step.rise_time_s[k]),
            overshoot_percent=float(result.step.overshoot_percent[k]),
            settling_time_s=finite(result.step.settling_time_s[k]),
            peak_rate_rad_s=float(peaks[k]),
            peak_current_A=float(max(-currents[0][k], currents[1][k])) if electric else None,
            limits={name: float(share[k]) for name, share in limited.items() if share[k] > 0.0},
        )
        for k in range(len(sizes))
    )


@dataclass(frozen=True)
class Specification:
    """Figures for a specification sheet."""

    design: Design
    capabilities: tuple[capability.Capability, ...]  # one a load torque
    steps: tuple[StepTime, ...]  # by load torque, then from small to full deflection
    plane: capability.TorqueSpeedPlane
    manoeuvres: tuple[capability.Manoeuvre, ...]  # by load torque


def specification(design: AnyDesign, loops: Loops | None = None) -> Specification:
    """Work out and simulate the figures at each load torque of the design.

    ``loops``: sampled and sliding, of this design, if they are there already.

    Raises `InputError`, `NumericalError`: as `assemble_loops` and `simulate`.
    """
    design = as_design(design)
    loops = assemble_loops(design) if loops is None else loops
    settling_s = settling_ticks_in_periods(loops) * design.controller.period_s
    loads = design.validation.loads_Nm
    result = tuple(capability.capability(design, load, settling_s) for load in loads)
    rates = [one.figures.output_rate_rad_s for one in result]
    pushes = [one.figures.acceleration_rad_s2 for one in result]
    each = zip(loads, rates, pushes, strict=True)
    moves = tuple(move for at in each for move in capability.manoeuvres(design, *at, settling_s))
    top = max(rates) * design.total_ratio
    return Specification(
        design, result, step_times(design), capability.torque_speed_plane(design, top), moves
    )
