"""A test bench in the computer: the simulator driven through a campaign of constant speeds and clutch loads.

What really happens in each run is simulated once (`simulate_bench`); what the instruments make of it, with
their noise, their errors and clocks of their own, is drawn for each seed (`virtual_bench_instruments`), and
written as the files of a real bench (`virtual_bench_files`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError

FloatArray = NDArray[np.float64]

RPM = 2.0 * np.pi / 60.0


@dataclass(frozen=True, kw_only=True)
class BenchPlan:
    """The runs of a campaign: every speed with every load; the paper's by default (section 3).

    Speeds are those of the motor; a load of zero is a disconnected clutch. Each run stands still for
    ``lead_s``, runs at constant speed, and stands again for ``lead_s``.
    """

    speeds_rad_s: tuple[float, ...] = tuple(float(k * 1000.0 * RPM) for k in range(1, 10))
    loads_Nm: tuple[float, ...] = (0.0, 2.0, 3.725, 5.45, 7.175, 8.9)
    duration_s: float = 20.0
    lead_s: float = 0.5
    log_period_s: float = 1e-3
    ripple: float = 0.01
    ripple_time_s: float = 0.2

    def __post_init__(self) -> None:
        if not 0.0 < 4.0 * self.lead_s < self.duration_s:
            raise InputError(
                f"lead_s = {self.lead_s}: between 0 and a quarter of duration_s = {self.duration_s}"
            )

    @property
    def runs(self) -> tuple[tuple[float, float], ...]:
        """Speed and load of each run."""
        return tuple((speed, load) for load in self.loads_Nm for speed in self.speeds_rad_s)


@dataclass(frozen=True, kw_only=True)
class TrueRun:
    """What happened in one run, without any instrument: one row a log period."""

    id: str
    speed_setting_rad_s: float
    load_setting_Nm: float
    time_s: FloatArray
    current_A: FloatArray
    speed_rad_s: FloatArray
    angle_rad: FloatArray
    torque_Nm: FloatArray


def simulate_bench(
    design: Design,
    plan: BenchPlan | None = None,
    *,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[TrueRun, ...]:
    """Simulate every run of a plan at the drive's own tick, and keep what falls on the log's period.

    Parameters
    ----------
    design : Design
        With a friction load path; its friction coefficients are what the campaign is to find.
    plan : BenchPlan, optional
    seed : int
        Of the clutch's slow ripple (relative standard deviation ``plan.ripple``), the only chance in it.
    progress : callable, optional
        Called with (runs done, runs in all).

    Raises
    ------
    NumericalError
        If a run does not reach its speed, because a limit of the drive holds it back.
    """
    plan = BenchPlan() if plan is None else plan
    children = np.random.default_rng(seed).spawn(len(plan.runs))
    runs = []
    for k, ((speed, load), rng) in enumerate(zip(plan.runs, children, strict=True), 1):
        runs.append(_simulate_run(design, plan, f"{k:02d}", speed, load, rng))
        if progress is not None:
            progress(k, len(plan.runs))
    return tuple(runs)


def _simulate_run(
    design: Design, plan: BenchPlan, identity: str, speed: float, load: float, rng: np.random.Generator
) -> TrueRun:
    from nonlinear import commands, loads, simulate

    command = commands.ramp(speed / design.total_ratio, plan.lead_s, plan.duration_s - plan.lead_s)
    times = np.arange(0.0, plan.duration_s + plan.log_period_s, plan.log_period_s)
    moment = _clutch_moment(plan, times, load, rng)
    run = simulate(design, command, duration_s=plan.duration_s, load_Nm=loads.series(times, moment))
    every = max(round(plan.log_period_s / design.controller.period_s), 1)
    part = slice(0, None, every)
    middle = run.motor_speed_rad_s[len(run.time_s) // 2 :: every]
    plateau = float(np.median(middle[: len(middle) // 2]))
    if abs(plateau - speed) > 0.01 * speed:
        raise NumericalError(
            f"run {identity}: reaches {plateau:.1f} rad/s of {speed:.1f} rad/s; lower speed or load"
        )
    return TrueRun(
        id=identity,
        speed_setting_rad_s=speed,
        load_setting_Nm=load,
        time_s=run.time_s[part],
        current_A=run.current_A[part],
        speed_rad_s=run.motor_speed_rad_s[part],
        angle_rad=run.motor_angle_rad[part],
        torque_Nm=np.interp(run.time_s[part], times, moment),
    )


def _clutch_moment(plan: BenchPlan, time_s: FloatArray, load: float, rng: np.random.Generator) -> FloatArray:
    """The slipping clutch: no moment at rest, its setting with a slow ripple while it turns."""
    from scipy.signal import lfilter

    keep = float(np.exp(-plan.log_period_s / plan.ripple_time_s))
    noise = rng.standard_normal(len(time_s)) * np.sqrt(1.0 - keep**2)
    ripple = 1.0 + plan.ripple * np.asarray(lfilter([1.0], [1.0, -keep], noise))
    rise = 1.0 - np.exp(-np.maximum(time_s - plan.lead_s, 0.0) / 0.02)
    stop = plan.duration_s - plan.lead_s
    fall = np.exp(-np.maximum(time_s - stop, 0.0) / 0.02)
    return np.asarray(load * ripple * rise * fall)
