"""One motion: what happened in numbers, and its figure."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from actuator_lti.design.control import Stage
from actuator_lti.drive.signals import LIMITERS, Limiter
from actuator_lti.files.atomic import write_text
from actuator_lti.files.reading import Tree
from analyses.motion.run import Motion
from analyses.motion.settling import Conduct, summary
from nonlinear import Trajectory
from nonlinear.runs.trajectory import COMMAND_UNITS
from reports import document as doc
from reports.charts import style
from reports.charts.svg import paper_svg
from reports.sections.names import output_unit

Signals = list[tuple[str, npt.NDArray[np.float64]]]
Acting = tuple[Limiter, ...]
LONGEST_GAP_S = 0.002  # spans of an active limit closer than this fraction of the run are drawn as one


def section(result: Motion) -> doc.Section:
    run, ended = result.run, result.ended
    figure = doc.figure("trajectory", chart_of(run), caption="The motion over time.", alt="The motion.")
    blocks = [figure, _table(run, ended), _limits(run), *([_energy(run)] if run.energy else [])]
    words = f"{run.time_s.size} rows, status {ended.status}" + f" ({ended.said})" * bool(ended.said)
    return doc.section("simulate", "Motion", blocks, result=words, status="info" if ended.wanted else "warn")


def data(result: Motion) -> Tree:
    return {**summary(result.run, result.ended), "files": result.asked.files}


def write(result: Motion, folder: Path | None) -> list[str]:
    """Write the plot that is asked for; all files of the motion."""
    if result.asked.plot is not None:
        write_text(result.asked.plot, paper_svg(chart_of(result.run), "f"))
    return result.asked.files


def _table(run: Trajectory, ended: Conduct) -> doc.Block:
    """Largest and last values: outputs in the unit of the command line, motor speeds in rpm as well."""
    unit, per_SI = COMMAND_UNITS[run.axis, run.stage]
    rows: list[doc.Row] = []
    for name, value in summary(run, ended).items():
        first, second, *_ = f"{name}_".split("_")
        if second in ("command", "error", "response"):
            what = MOVES[run.stage] if second == "response" else second
            rows.append({"what": f"{first} {what}", "value": value * per_SI, "unit": unit})
        elif second == "output":
            what = "output position" if run.axis == "linear" else "output angle"
            rows += [{**row, "what": f"{first} {what}"} for row in _in_words(name, value)]
        elif isinstance(value, float):
            rows += _in_words(name, value)
    events = f"stick-slip events (at most {run.events_per_tick} in one tick)"
    return doc.table("What happened", COLUMNS, [*rows, {"what": events, "value": run.events, "unit": ""}])


COLUMNS = [
    doc.column("what", "What"),
    doc.column("value", "Value", format="short:6"),
    doc.column("unit", "Unit"),
]
MOVES = {"velocity": "output speed", "current": "motor current"}
UNITS = (
    ("_rad_s", 1.0, "rad/s"), ("_m_s", 1.0, "m/s"), ("_rad", 180.0 / np.pi, "deg"), ("_m", 1e3, "mm"),
    ("_A", 1.0, "A"), ("_V", 1.0, "V"), ("_s", 1.0, "s"),
)  # fmt: skip


def _in_words(name: str, value: float) -> list[doc.Row]:
    """A figure as people read it.

    >>> [row["unit"] for row in _in_words("largest_motor_speed_rad_s", 100.0)]
    ['rad/s', 'rpm']
    """
    ending, factor, unit = next((one for one in UNITS if name.endswith(one[0])), ("", 1.0, ""))
    what = name.removesuffix(ending).replace("_", " ").replace("rms current", "current, rms over time")
    rpm: doc.Row = {"what": "", "value": value * 30.0 / np.pi, "unit": "rpm"}
    return [{"what": what, "value": value * factor, "unit": unit}, *[rpm] * (unit == "rad/s")]


def _limits(run: Trajectory) -> doc.Block:
    uses = [(name, use, bool(np.isfinite(use.limit))) for name, use in run.limits.items()]
    columns = [
        doc.of(lambda one: one[0], "name", "Limit"),
        doc.of(lambda one: one[1].limit if one[2] else "none", "limit", "Value", format="short:6"),
        doc.of(lambda one: one[1].unit * one[2], "unit", "Unit"),
        doc.of(lambda one: one[1].fraction, "share", "Acts, of the time", "%", scale=100.0, format="short:3"),
        doc.of(lambda one: one[1].first_time_s, "first", "First at", "s", format="short:6"),
    ]
    return doc.listing("Limits", uses, columns)


def _energy(run: Trajectory) -> doc.Block:
    assert run.energy is not None
    values = {**vars(run.energy), "balance, relative": run.energy.relative_error}
    rows = [(n.removesuffix("_J").replace("_", " "), v, "J" * n.endswith("_J")) for n, v in values.items()]
    return doc.table("Where the electrical energy went", COLUMNS, rows)


def chart_of(run: Trajectory) -> style.Chart:
    """Position, speed, current and voltage on one time axis, thinned with the peaks kept."""
    linear, (angle, unit) = run.axis == "linear", output_unit(run.axis)
    command: dict[Stage, Signals] = {run.stage: [("command", run.reference_rad)]}
    speed = [("speed", run.motor_speed_rad_s)]
    speed += [(name, run.ratio * values) for name, values in command.get("velocity", [])]
    if run.stage == "position" and run.speed_command_rad_s.any():
        speed.append(("commanded", run.speed_command_rad_s))
    current = [("current", run.current_A), *command.get("current", [])]
    if run.stage in ("position", "velocity") and run.current_command_A.any():
        current.append(("commanded", run.current_command_A))
    position = [("output", run.output_angle_rad), *command.get("position", [])]
    position = [(name, angle * values) for name, values in position]
    parts: list[tuple[str, Signals, Acting]] = [
        (f"output position, {unit}", position, ()),
        (f"{'axis' if linear else 'motor'} speed, {'m/s' if linear else 'rad/s'}", speed, _limiters("w_ref")),
        *[("motor current, A", current, _limiters("i_ref", "i", "torque_command"))]
        * bool(run.current_A.any()),
        ("voltage, V", [("voltage", run.voltage_V), *command.get("voltage", [])], _limiters("u")),
    ]
    rows = style.kept_rows([run.output_angle_rad, run.motor_speed_rad_s, run.current_A, run.voltage_V])
    chart, panels = style.stack(60.0 + 150.0 * len(parts), *(1.0 for _ in parts), legend=True)
    scale = style.time_axis(panels[-1], float(run.time_s[rows][-1]))
    time = run.time_s[rows] * scale
    for panel, (label, signals, limiters) in zip(panels, parts, strict=True):
        panel.y.label = label
        for one in (each for each in limiters if each.name in run.limits):
            colour = style.RED if one.kind == "value" else style.ORANGE
            for start, stop in spans(run.limit_active(one.name), run.time_s):
                panel.band_x(start * scale, stop * scale, f"{one.words} acts", colour=colour)
        # the command lies under the response: drawn last in the list, first on the paper
        for k, (name, values) in reversed(list(enumerate(signals))):
            panel.curve(time, values[rows], name, width=2.0 if k == 0 else 1.5, **style.series(k))
        limit = run.limits[limiters[0].name].limit if limiters else np.inf
        if limit > 4.0 * max(np.abs(v[rows]).max() for _, v in signals):  # out of reach of the signals
            if np.isfinite(limit):
                panel.note(f"limit ±{limit:.4g}, off scale", corner="top left", colour=style.MUTED)
        elif np.isfinite(limit):
            for sign, words in ((1.0, f"limit ±{limit:.4g}"), (-1.0, "")):
                panel.rule_y(sign * limit, words, seen=True, colour=style.RED, width=1.2, dash=1)
    panels[-1].x.limits(time[0], time[-1])
    return chart


def _limiters(*signals: str) -> Acting:
    """What limits the signals of a panel, the clamp first; what shapes the command is no limit."""
    return tuple(one for one in LIMITERS.values() if one.signal in signals and one.kind != "command")


def spans(active: npt.NDArray[np.bool_], time_s: npt.NDArray[np.float64]) -> list[list[float]]:
    """From when to when something was active; spans that a figure cannot tell apart are joined.

    >>> spans(np.array([False, True, True, False]), np.arange(4.0))
    [[1.0, 3.0]]
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(np.int8), [0]))))
    end = float(time_s[-1]) + (float(time_s[1]) if time_s.size > 1 else 0.0)
    times = np.append(time_s, end)[edges]
    joined = 2 * np.flatnonzero(np.diff(times)[1::2] < LONGEST_GAP_S * end)
    apart: list[list[float]] = np.delete(times, [joined + 1, joined + 2]).reshape(-1, 2).tolist()
    return apart
