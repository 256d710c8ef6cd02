"""Duty cycle against the continuous rating: current, overload protection and winding temperature."""

import math

import numpy as np

from actuator_lti.asked.verdict import Verdict
from actuator_lti.drive.operating import follows_angle, runs
from analyses.duty.run import Duty
from reports import document as doc
from reports.charts import style
from reports.numbers import seconds
from reports.sections import requirements
from reports.sections.names import command_unit, push_words

_SHOWN = 400


def section(result: Duty) -> doc.Section:
    intro = (
        "The motion is simulated until its rms current is steady, friction, play and limits at work, the "
        "overload protection left out; a rest goes on from there, and a motion begins from the rest. Their "
        "current, repeated without end, heats the winding by its mean copper loss and drives the overload "
        "state. Power is of copper and shaft: a supply or brake resistor takes what comes back."
    )
    note = f"Duty: {asked_words(result)}."
    if runs(result.design) and follows_angle(result.design) and result.asked.share < 1.0:
        note += " The load turns with the drive: this is one motion of many, which begin at other angles."
    if result.heating is None:
        note += " No winding temperature: the design states no temperature.thermal_resistance."
    if result.overload is None:
        note += " No overload state: the design states no limits.peak_time."
    table = doc.table("What the duty asks of the motor", _COLUMNS, _rows(result), note)
    grave = doc.severity(result.verdict)
    grave = "warn" if grave == "info" and result.limited else grave
    own = requirements.table(result.requirements)
    blocks, words = [table, *own, _figure(result)], summary(result)
    return doc.section("duty", "Duty cycle", blocks, result=words, intro=intro, severity=grave)


RATED = {
    Verdict.MET: "within continuous rating",
    Verdict.NOT_MET: "beyond continuous rating",
    Verdict.NOT_PROVEN: "not judged",
}
_COLUMNS = [
    doc.column("what", "What"),
    doc.column("value", "Found", format="sig:4"),
    doc.column("limit", "Allowed", format="sig:4"),
    doc.column("unit", "Unit"),
    doc.column("when", "Reached after", "s", format="sig:3"),
]


def asked_words(result: Duty) -> str:
    asked, size = result.asked, command_unit(result.design).of(result.asked.size_of(result.design))
    words = f"±{size} at {asked.frequency_hz:.3g} Hz"
    if asked.ramp_s > 0.0:
        words = f"0 to {size} and back in {seconds(asked.ramp_s)} each, at {asked.frequency_hz:.3g} Hz"
    if asked.current_A is not None:
        words += ", the output held,"
    words += f" under {asked.load_Nm:.3g} {result.design.load_unit}"
    if asked.share < 1.0:
        words += f", {100.0 * asked.share:.3g} % of every {asked.cycle_s:.3g} s"
    return words


def summary(result: Duty) -> str:
    limited = f"; it is not followed as asked, limited by {' and '.join(result.limited)}"
    said = f"{asked_words(result)} is {RATED[result.rated]}: {_found(result)}"
    said += "" if result.steady else "; the motion is not steady where its simulation ends"
    return said + limited * bool(result.limited) + f". {requirements.result(result.requirements)}".rstrip()


def _found(result: Duty) -> str:
    """What is beyond its limit, else the current."""
    if beyond := [row for row in _rows(result) if row["_status"] == "fail"]:
        units = [f" {row['unit']}".rstrip() for row in beyond]
        shown = zip(beyond, units, strict=True)
        return "; ".join(
            f"{r['what']} {r['value']:.4g}{unit}, limit {r['limit']:.4g}{unit}" for r, unit in shown
        )
    known = math.isfinite(result.continuous_A)
    limit = f", limit {result.continuous_A:.4g} A" if known else ", and no continuous current is stated"
    return f"{result.rms_A:.4g} A, rms over time{limit}"


def _rows(result: Duty) -> list[doc.Row]:
    over, heat = result.overload, result.heating
    peak = result.design.limits.peak_current_A
    rows: list[doc.Row] = [
        _row("current, rms over time", result.rms_A, result.continuous_A, "A"),
        _row("current in motion, rms", result.moving_rms_A, math.inf, "A"),
    ]
    rows += [_row("current at rest, rms", result.holding_A, math.inf, "A")] * (result.asked.share < 1.0)
    rows.append({**_row("current, peak", result.peak_A, peak, "A"), "_status": None})
    push, unit = push_words(result.design), result.design.load_unit
    figures = (
        (f"motor {push}, rms over time", result.rms_torque_Nm, unit),
        (f"motor {push}, peak", result.peak_torque_Nm, unit),
        ("copper loss, mean", result.copper_W, "W"),
        ("power into the motor, mean", result.mean_power_W, "W"),
        ("power into the motor, peak", result.peak_power_W, "W"),
        ("power back from the motor, peak", result.fed_back_W, "W"),
    )
    rows += [_row(what, value, math.inf, unit) for what, value, unit in figures]
    rows += [_row("overload state, peak", over.peak, 1.0, "", over.acts_after_s)] if over else []
    if heat is not None:
        rows.append(_row("winding temperature", heat.final_degC, heat.limit_degC, "°C", heat.limit_after_s))
    return rows


def _row(what: str, value: float, limit: float, unit: str, when: float | None = None) -> doc.Row:
    status = "fail" if value > limit else None
    return {"what": what, "value": value, "limit": limit, "unit": unit, "when": when, "_status": status}


def _figure(result: Duty) -> doc.Block:
    chart = style.Chart(width=style.WIDE, height=320.0)
    panel, rows = chart.panel(y="current, A", title="One period of the motion"), result.period_ticks
    every, last = max(1, rows // _SHOWN), float(result.time_s[rows - 1])
    largest = int(np.argmax(np.abs(result.current_A)))
    scale, first = style.time_axis(panel, last), min(largest // rows * rows, result.current_A.size - rows)
    current = result.current_A[first : first + rows : every]
    panel.curve(result.time_s[:rows:every] * scale, current, "current", **style.series(0))
    panel.rule_y(result.rms_A, "rms of the duty", seen=True, colour=style.BLUE, dash=1)
    if math.isfinite(result.continuous_A):
        panel.rule_y(result.continuous_A, "continuous", seen=True, colour=style.RED, dash=2)
    panel.x.limits(0.0, last * scale)
    periods = len(result.time_s) // rows
    whole = "turns of the load" if runs(result.design) and follows_angle(result.design) else "ticks"
    most = f", the largest of {periods}, which come nearest to whole {whole}" * (periods > 1)
    caption = f"Motor current over one period of the motion{most}."
    if result.heating is not None:
        caption += " Right: the winding from ambient."
        panel, heat = chart.panel(y="winding, °C", title="Winding"), result.heating
        scale = style.time_axis(panel, float(heat.time_s[-1]))
        panel.curve(heat.time_s * scale, heat.temperature_degC, "winding", **style.series(1))
        if math.isfinite(heat.limit_degC):
            panel.rule_y(heat.limit_degC, "limit", seen=True, colour=style.RED, dash=1)
    return doc.figure("duty", chart, caption)
