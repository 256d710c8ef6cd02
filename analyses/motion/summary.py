"""A motion in numbers."""

from __future__ import annotations

import numpy as np

from actuator_lti.files.tree import Tree
from analyses.motion.conduct import conduct
from nonlinear import Trajectory


def summary(run: Trajectory) -> Tree:
    """What happened, in numbers, SI."""
    limits = {
        name: {"limit": u.limit, "unit": u.unit, "fraction": u.fraction, "first_time_s": u.first_time_s}
        for name, u in run.limits.items()
    }
    angle = "m" if run.axis == "linear" else "rad"
    si = {"position": angle, "velocity": f"{angle}_s", "current": "A", "voltage": "V"}[run.stage]
    ended = conduct(run)
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
