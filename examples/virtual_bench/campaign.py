"""A test bench in the computer: the simulator driven through a campaign of constant speeds and clutch loads.

What really happens in each run is simulated once (`simulate_bench`); what the instruments make of it, with
their noise, their errors and clocks of their own, is drawn for each seed (`instruments`), and written as the
files of a real bench (`files`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats

CLUTCH_KNEE = 0.5
"""Share of a run's speed over which the slipping clutch builds up its moment."""
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
    time_s: Floats
    current_A: Floats
    speed_rad_s: Floats
    angle_rad: Floats
    torque_Nm: Floats


def simulate_bench(
    design: Design,
    plan: BenchPlan | None = None,
    *,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[TrueRun, ...]:
    """Simulate every run of a plan at the drive's own tick, and keep what falls on the log's period.

    The design has a friction load path; its friction coefficients are what the campaign is to find. ``seed``
    is that of the clutch's slow ripple (relative standard deviation ``plan.ripple``), the only chance in it.

    Raises `InputError`: for a linear axis or a drive without a current. Raises `NumericalError`: if a run
    does not reach its speed, because a limit of the drive holds it back.
    """
    plan = BenchPlan() if plan is None else plan
    if design.axis != "rotary" or design.motor.torque_constant_Nm_A is None:
        raise InputError("the bench needs a rotary drive with a torque constant", where=design.name)
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
    moment = load * _ripple(plan, len(times), rng)
    every = max(round(plan.log_period_s / design.controller.period_s), 1)
    load_series = loads.series(times, moment)
    run = simulate(design, command, plan.duration_s, load_series, record_every=every)
    rows = len(run.time_s)
    plateau = float(np.median(run.motor_speed_rad_s[rows // 2 : 3 * rows // 4]))
    if abs(plateau - speed) > 0.01 * speed:
        raise NumericalError(
            f"run {identity}: reaches {plateau:.1f} rad/s of {speed:.1f} rad/s; lower speed or load"
        )
    return TrueRun(
        id=identity,
        speed_setting_rad_s=speed,
        load_setting_Nm=load,
        time_s=run.time_s,
        current_A=run.current_A,
        speed_rad_s=run.motor_speed_rad_s,
        angle_rad=run.motor_angle_rad,
        torque_Nm=np.interp(run.time_s, times, moment) * _build_up(run.motor_speed_rad_s, speed),
    )


def _ripple(plan: BenchPlan, rows: int, rng: np.random.Generator) -> Floats:
    """The clutch's slow ripple about one, a first-order process."""
    from scipy.signal import lfilter

    keep = float(np.exp(-plan.log_period_s / plan.ripple_time_s))
    noise = rng.standard_normal(rows) * np.sqrt(1.0 - keep**2)
    return np.asarray(1.0 + plan.ripple * lfilter([1.0], [1.0, -keep], noise))


def _build_up(speed_rad_s: Floats, setting_rad_s: float) -> Floats:
    """Share of the clutch's moment at the sensor: none at rest, all of it at the run's speed.

    The simulated drive feels the whole moment throughout, which at rest and in the few ms of run-up only
    changes its dry friction.
    """
    return np.asarray(
        np.tanh(np.abs(speed_rad_s) / (CLUTCH_KNEE * setting_rad_s)) / np.tanh(1.0 / CLUTCH_KNEE)
    )
