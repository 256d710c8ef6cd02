"""Figures for a specification sheet: rates, acceleration, current, duty, step times, torque and speed."""

import math
from itertools import cycle

import numpy as np

from analyses.specification import Specification
from analyses.specification.capability import Manoeuvre
from reports import document as doc
from reports.charts import style
from reports.numbers import short, significant
from reports.sections.limits import words_of
from reports.sections.names import Unit, output_unit

EQUAL = 0.05  # relative: closed form and simulation are not told apart in the headline
BOUND_COLOURS = {
    "voltage limit": style.RED,
    "drive signal at its limit": style.RED,
    "peak current": style.ORANGE,
    "continuous current": style.BROWN,
    "speed limit": style.BLUE,
}


def section(result: Specification) -> doc.Section:
    blocks = [_capability_table(result), *_planes(result), _manoeuvre_table(result), _step_table(result)]
    intro = (
        "Closed form and simulation side by side, behind the profile of the command; manoeuvres and steps "
        "with it. Output side unless a column says motor."
    )
    words, more = _result(result), list[doc.Finding]()
    for one in result.capabilities:
        if one.duty is not None and one.duty < 0.995:
            load = f"{one.figures.load_Nm:g} {result.design.load_unit}"
            text = f"At {load} load the continuous current allows a duty of {100.0 * one.duty:.0f} %."
            more.append(doc.Finding(severity="warn", text=text, where="specification"))
    return doc.section("specification", "Actuator figures", blocks, result=words, intro=intro, findings=more)


def _result(result: Specification) -> str:
    one = max(result.capabilities, key=lambda one: one.figures.load_Nm, default=None)
    if one is None:
        return ""
    scale, unit = output_unit(result.design.axis)
    rate, push, limits = f"{unit}/s", f"{unit}/s²", result.design.command
    parts = []
    for value, found, per in (
        (one.figures.output_rate_rad_s, one.simulated_rate_rad_s, rate),
        (one.figures.acceleration_rad_s2, one.simulated_acceleration_rad_s2, push),
    ):
        if value is not None and math.isfinite(value):
            unlike = found is not None and abs(found - value) > EQUAL * abs(value)
            also = f" (simulated {significant(scale * found)})" if found is not None and unlike else ""
            parts.append(f"{significant(scale * value)} {per}{also}")
    load = f"{one.figures.load_Nm:g} {result.design.load_unit}"
    words = f"At {load} load the output reaches {' and '.join(parts)}."
    asked = ((limits.rate_rad_s, rate), (limits.acceleration_rad_s2, push))
    most = [f"{significant(scale * value)} {per}" for value, per in asked if math.isfinite(value)]
    return words + f" The profile of its command asks for at most {' and '.join(most)}." * bool(most)


def _capability_table(result: Specification) -> doc.Block:
    out, share = output_unit(result.design.axis), Unit(100.0, "%").column()
    rate, push = out.per("s").column("sig:4"), out.per("s²").column("sig:4")
    columns = [
        doc.of("figures.load_Nm", "load", "Load", result.design.load_unit, format="short:4"),
        doc.of("figures.output_rate_rad_s", "rate", "Rate", **rate, better=1),
        doc.of("simulated_rate_rad_s", "rate_seen", "Simulated", **rate),
        doc.of("figures.rate_limit", "by", "Set by"),
        doc.of("figures.acceleration_rad_s2", "push", "Acceleration", **push, better=1),
        doc.of("simulated_acceleration_rad_s2", "push_seen", "Simulated", **push),
    ]
    note = (
        "Acceleration in closed form is that of the largest torque from rest, at most the acceleration "
        "limit; simulated, the mean over a tenth of the run-up, where controllers lag and overshoot."
    )
    if result.design.motor.has_electrical_dynamics:
        at_rate = "Motor current at that rate"
        columns += [
            doc.of("figures.motor_current_A", "current", at_rate, "A", format="sig:3", better=-1),
            doc.of("simulated_current_A", "current_seen", "simulated", "A", format="sig:3"),
            doc.of("current_ratio", "ratio", "of continuous", **share),
            doc.of("duty", "duty", "Duty", **share),
        ]
        note += " Duty is the share of the time that keeps the rms current at the continuous one."
    return doc.listing("Rate, acceleration and current at each load", result.capabilities, columns, note)


def _planes(result: Specification) -> list[doc.Block]:
    linear = result.design.axis == "linear"
    fast, speed_label = (1.0, "speed, m/s") if linear else (60.0 / (2.0 * math.pi), "motor speed, rpm")
    strong, torque_label = (1.0, "force, N") if linear else (1e3, "motor torque, mN m")
    unit = result.design.load_unit
    blocks = []
    for one in result.capabilities:
        load = one.figures.load_Nm
        moves = [move for move in result.manoeuvres if move.load_Nm == load]
        title = f"{'Force' if linear else 'Torque'} and speed of the motor, load {load:g} {unit}"
        chart, panel = style.plot(400.0, speed_label, torque_label, by_point=True, title=title, legend=True)
        level = [c.torque_Nm[0] for c in result.plane.bounds if c.torque_Nm[0] == c.torque_Nm[-1]]
        top = strong * float(max([*level, *(move.peak_torque_Nm for move in moves)], default=1.0))
        widest = fast * _fastest(result, moves)
        panel.x.limits(-0.02 * widest, widest)
        panel.y.limits(-1.12 * top, 1.25 * top)
        panel.rule_y(0.0)
        for k, move in enumerate(moves):
            fold = np.where(move.speed_rad_s < 0.0, -1.0, 1.0)
            speed, torque = fast * fold * move.speed_rad_s, strong * fold * move.torque_Nm
            # a reversal is a jump of the folded path: leave a gap there
            torque = np.where(np.diff(fold, prepend=fold[0]) != 0.0, np.nan, torque)
            look: style.Style = {"colour": style.SERIES[(k + 2) % 7], "dash": k % 7, "width": 1.5}
            head, bracket, tail = move.name.partition(" (")  # long names are broken for the legend
            head = head.replace(" of what", "\nof what").replace(" as fast", "\nas fast")
            panel.curve(speed, torque, head + bracket + tail, **look)
        for bound in result.plane.bounds:
            inside = (0.97 * widest, 1.2 * top)
            _bound(panel, bound.name, fast * bound.speed_rad_s, strong * bound.torque_Nm, inside)
        steady = [d for d in result.plane.demands if d.name.startswith(f"steady motion at {load:g} ")]
        look = {"colour": style.INK, "width": 1.5, "dash": 2, "size": 5.0, "every": 8}
        for each, marker in zip(steady, cycle("os^D"), strict=False):
            speed, torque = fast * each.speed_rad_s, strong * each.torque_Nm
            panel.curve(speed, torque, each.name, marker=marker, **look)
        caption = (
            f"{'Force' if linear else 'Motor torque'} over speed at {load:g} {unit}: bounds, what steady "
            "motion needs, and the paths of standard manoeuvres at full deflection. Below zero it brakes; "
            "backward motion is turned over."
        )
        blocks.append(doc.figure("torque_speed", chart, caption))
    return blocks


def _bound(
    panel: style.Panel, name: str, speed: np.ndarray, torque: np.ndarray, inside: tuple[float, float]
) -> None:
    look: style.Style = {"colour": BOUND_COLOURS.get(name, style.INK), "width": 1.3, "dash": 1}
    if speed[0] == speed[-1]:
        panel.rule_x(speed[0], name, **look)
        return
    panel.curve(speed, torque, read=False, **look)
    if torque[0] == torque[-1]:
        panel.curve(speed, -torque, read=False, **look)
    seen = np.flatnonzero((speed < inside[0]) & (torque < inside[1]))
    if seen.size:
        k = seen[seen.size // 2]
        panel.note(name, (float(speed[k]), float(torque[k])), colour=look["colour"])


def _fastest(result: Specification, moves: list[Manoeuvre]) -> float:
    """Speed that the frame must show: the bounds in reach, and the paths."""
    highest = max((float(np.max(np.abs(move.speed_rad_s))) for move in moves), default=1.0)
    bounds = {c.name: c.speed_rad_s for c in result.plane.bounds}
    if "speed limit" in bounds:
        return 1.12 * max(highest, float(bounds["speed limit"][0]))
    crossing = float(bounds["voltage limit"][-1]) if "voltage limit" in bounds else 0.0
    return 1.12 * max(highest, crossing if crossing < 4.0 * highest else 0.0)


def _manoeuvre_table(result: Specification) -> doc.Block:
    def limits(move: Manoeuvre) -> str:
        parts = [f"{words_of(name)} {short(100.0 * share, 2)} %" for name, share in move.limits.items()]
        return ", ".join(parts) or "none"

    of_current = [
        doc.of("rms_current_A", "rms", "Current, rms", "A", format="sig:3"),
        doc.of("peak_current_A", "peak", "peak", "A", format="sig:3"),
        doc.of("duty", "duty", "Duty", "%", scale=100.0, format="sig:3"),
    ]
    of_force = [
        doc.of("rms_torque_Nm", "rms_force", "Force, rms", "N", format="sig:3"),
        doc.of("peak_torque_Nm", "peak_force", "peak", "N", format="sig:3"),
    ]
    columns = [
        doc.of("name", "name", "Manoeuvre"),
        doc.of("load_Nm", "load", "Load", result.design.load_unit, format="short:4"),
        *(of_current if result.design.motor.has_electrical_dynamics else of_force),
        doc.of(limits, "limits", "Limits that act"),
    ]
    full = output_unit(result.design.axis).of(result.design.validation.full_deflection_rad)
    return doc.listing(f"Standard manoeuvres at {full}", result.manoeuvres, columns)


def _step_table(result: Specification) -> doc.Block:
    scale, unit = output_unit(result.design.axis)
    columns = [
        doc.of("load_Nm", "load", "Load", result.design.load_unit, format="short:4"),
        doc.of("amplitude_rad", "step", "Step", unit, scale=scale, format="sig:3"),
        doc.of("fraction", "fraction", "of full", "%", scale=100.0, format="sig:2"),
        doc.of("rise_time_s", "rise", "Rise 10–90 %", "ms", scale=1e3, format="ms:3", better=-1),
        doc.of("overshoot_percent", "overshoot", "Overshoot", "%", format="fix:1", better=-1),
        doc.of("settling_time_s", "settle", "Settled to 2 %", "ms", scale=1e3, format="ms:3", better=-1),
        doc.of("peak_rate_rad_s", "rate", "Peak rate", f"{unit}/s", scale=scale, format="sig:3"),
        doc.of(lambda one: ", ".join(map(words_of, one.limits)) or "none", "limits", "Limits that act"),
    ]
    note = "Simulated with friction and all limits; a load sets in with the step, and its motion counts."
    if any(None in (one.rise_time_s, one.settling_time_s) for one in result.steps):
        note += " A dash: not reached in the time simulated, as where friction holds the output short of it."
    return doc.listing("Steps, small and large", result.steps, columns, note)
