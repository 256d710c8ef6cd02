"""A `Trajectory` as plain data: its figure and what a summary says of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from actuator_lti.design.control import Stage
from actuator_lti.tree import Tree
from analyses.conduct import conduct
from nonlinear import Trajectory
from reports.document import abscissa, rounded
from reports.sections.thinning import kept_rows

if TYPE_CHECKING:
    from reports.figures import trajectory as trajectory_figure

LONGEST_GAP_S = 0.002  # spans of an active limit closer than this fraction of the run are drawn as one


def figure_data(run: Trajectory) -> trajectory_figure.Data:
    """Data of the figure ``trajectory``: thinned with the peaks kept."""
    linear = run.axis == "linear"
    angle, unit = (1e3, "mm") if linear else (180.0 / np.pi, "deg")
    speed_unit = "m/s" if linear else "rad/s"
    shown = [run.output_angle_rad, run.motor_speed_rad_s, run.current_A, run.voltage_V]
    rows = kept_rows(shown)

    def series(label: str, values: npt.NDArray[np.float64]) -> trajectory_figure.Signal:
        return {"label": label, "values": rounded(values[rows])}

    def ordered(stage: Stage, factor: float = 1.0) -> list[trajectory_figure.Signal]:
        """The command, in the panel of what it orders."""
        return [series("command", run.reference_rad * factor)] if run.stage == stage else []

    position = [series("output", run.output_angle_rad * angle), *ordered("position", angle)]
    speed = [series("speed", run.motor_speed_rad_s), *ordered("velocity", run.ratio)]
    if run.stage == "position" and run.speed_command_rad_s.any():
        speed.append(series("commanded", run.speed_command_rad_s))
    panels = [
        _panel(f"output position, {unit}", position, run, None),
        _panel(f"{'axis' if linear else 'motor'} speed, {speed_unit}", speed, run, "speed"),
    ]
    if run.current_A.any():
        current = [series("current", run.current_A), *ordered("current")]
        if run.stage in ("position", "velocity") and run.current_command_A.any():
            current.append(series("commanded", run.current_command_A))
        panels.append(_panel("motor current, A", current, run, "current"))
    panels.append(
        _panel("voltage, V", [series("voltage", run.voltage_V), *ordered("voltage")], run, "voltage")
    )
    return {"time_s": abscissa(run.time_s[rows], 8), "panels": panels}


def _panel(
    label: str, series: list[trajectory_figure.Signal], run: Trajectory, limiter: str | None
) -> trajectory_figure.Part:
    use = run.limits[limiter] if limiter else None
    active = spans(run.limit_active(limiter), run.time_s) if limiter else []
    limit = use.limit if use and np.isfinite(use.limit) else None
    return {"label": label, "series": series, "limit": limit, "limit_label": limiter or "", "active": active}


def spans(active: npt.NDArray[np.bool_], time_s: npt.NDArray[np.float64]) -> list[list[float]]:
    """From when to when something was active; spans that a figure cannot tell apart are joined.

    Examples
    --------
    >>> import numpy as np
    >>> spans(np.array([False, True, True, False]), np.arange(4.0))
    [[1.0, 3.0]]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(np.int8), [0]))))
    end = float(time_s[-1]) + (float(time_s[1]) if time_s.size > 1 else 0.0)
    times = np.append(time_s, end)
    gap = LONGEST_GAP_S * end
    out: list[list[float]] = []
    for start, stop in zip(times[edges[::2]], times[edges[1::2]], strict=True):
        if out and start - out[-1][1] < gap:
            out[-1][1] = float(stop)
        else:
            out.append([float(start), float(stop)])
    return out


def summary(run: Trajectory) -> Tree:
    """What happened, in numbers (for ``--json``)."""
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
