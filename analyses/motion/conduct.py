"""How a simulated motion ends, by the one judge of rest (`nonlinear.settling.rest`), and its numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.files.tree import Tree
from analyses.motion.settling import counted, faint_words, words
from nonlinear.runs.trajectory import COMMAND_UNITS, Trajectory
from nonlinear.settling.rest import judge


@dataclass(frozen=True)
class Conduct:
    """What a run ends in, the command and the load staying as they are at its end.

    ``status``: ``"comes to rest"`` (of a speed or less: ``"becomes steady"``), ``"sits on a limit"`` (it does
    while this acts), ``"limit cycle"``, ``"still moving"``, ``"diverging"``; ``"following"`` where command or
    load go on changing; or why the run stopped.
    ``detail``: with figures; empty where there is nothing to say.
    """

    status: str
    detail: str = ""

    @property
    def wanted(self) -> bool:
        """Whether the drive rests, turns steadily or follows, no limit in its way."""
        return self.status in ("comes to rest", "becomes steady", "following")


def conduct(run: Trajectory, full_deflection_rad: float = 0.0) -> Conduct:
    """Judge a run; where its end comes too early, the drive is followed beyond it.

    Swings that are too small beside full deflection (m on a linear axis) are rest.

    Examples
    --------
    >>> from nonlinear import commands, simulate
    >>> conduct(simulate("ilr33-amber", commands.step(0.01), duration_s=0.2)).status
    'comes to rest'
    """
    if run.status != "ok":
        return Conduct(run.status, run.advice)
    rest = None if run.running is None else judge(run.running)
    if rest is None:
        return Conduct("following")
    unit, factor = COMMAND_UNITS[run.axis, "velocity" if run.stage == "voltage" else run.stage]
    if run.stage == "position":
        rest = counted(rest, full_deflection_rad)
    if not rest.comes_to_rest:
        text = words(rest, factor, unit).removeprefix("limit cycle of ").removeprefix("still moving ")
        return Conduct(rest.verdict, text)
    limits = [f"{n} limit of {run.limits[n].limit:.4g} {run.limits[n].unit}" for n in rest.limited]
    if limits:
        return Conduct("sits on a limit", ", ".join(limits))
    left = faint_words(rest, factor, unit) if rest.amplitude else ""
    return Conduct("comes to rest" if run.stage == "position" else "becomes steady", left)


def summary(run: Trajectory, full_deflection_rad: float = 0.0) -> Tree:
    """What happened, in numbers, SI; full deflection as in `conduct`."""
    limits = {
        name: {"limit": u.limit, "unit": u.unit, "fraction": u.fraction, "first_time_s": u.first_time_s}
        for name, u in run.limits.items()
    }
    angle = "m" if run.axis == "linear" else "rad"
    si = {"position": angle, "velocity": f"{angle}_s", "current": "A", "voltage": "V"}[run.stage]
    ended = conduct(run, full_deflection_rad)
    out = {
        "design": run.design_name,
        "status": ended.status,
        "status_detail": ended.detail,
        "rows": run.time_s.size,
        "period_s": run.period_s,
        f"largest_output_{angle}": np.abs(run.output_angle_rad).max(),
        "commanded": run.stage,
        f"largest_command_{si}": np.abs(run.reference_rad).max(),
        f"largest_error_{si}": np.abs(run.reference_rad - run.followed).max(),
        f"final_output_{angle}": run.output_angle_rad[-1],
        f"largest_motor_speed_{angle}_s": np.abs(run.motor_speed_rad_s).max(),
        "largest_current_A": np.abs(run.current_A).max(),
        "rms_current_A": np.sqrt(np.mean(run.current_A**2)),
        "largest_voltage_V": np.abs(run.voltage_V).max(),
        "limits": limits,
        "events": run.events,
        "events_per_tick": run.events_per_tick,
        "stick_fraction": run.stick_fraction,
        "parameters_hash": run.parameters_hash,
    }
    if run.energy is not None:
        out["energy"] = {**vars(run.energy), "relative_error": run.energy.relative_error}
    return out
