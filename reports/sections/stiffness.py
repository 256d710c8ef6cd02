"""Stiffness at the output: how far a load pushes it, powered and unpowered, and what play takes away."""

import math
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from analyses.stiffness import Check, Stiffness, StiffnessCurve, stiffness
from analyses.stiffness.run import AGREED, READ
from reports import document as doc
from reports.charts import style
from reports.numbers import short
from reports.sections import requirements
from reports.sections.names import output_unit, push_words

STATES = {
    "powered": "powered, command held",
    "shorted": "unpowered, winding shorted",
    "open": "unpowered, winding open",
}
WAYS = {"driving": "motor against the load", "driven": "load moving the motor"}


def of_design(design: Design) -> doc.Section:
    return {**section(stiffness(design, simulated=False)), "status": "info"}


def section(result: Stiffness) -> doc.Section:
    unit = f"{result.design.load_unit}/{'m' if result.design.axis == 'linear' else 'rad'}"
    blocks = [
        *(*_figure(result, unit), _table(result, unit)),
        *requirements.table(result.requirements),
        *([_lost_motion(result)] if result.lost_motion else []),
        *([_at_rest(result, unit)] if result.at_rest else []),
        *([_checks(result, unit)] if result.checks else []),
    ]
    intro = (
        f"Load {push_words(result.design)} over the deflection of the output, the command held: the inverse "
        "of the linear response from load to output. Friction slides; dry friction and play are not in the "
        "curves."
    )
    if result.curves[0].way != "sliding":
        intro += (
            " Friction by load adds to a load that the motor moves against, and takes from one that moves "
            "the motor; a requirement is judged on the smaller stiffness of both."
        )
    status, words = result.verdict.role(), _result(result, unit)
    return doc.section("stiffness", "Stiffness", blocks, result=words, intro=intro, status=status)


def _result(result: Stiffness, unit: str) -> str:
    words = f"A load {push_words(result.design)} does not move the output of this drive"
    first = result.curves[0]
    if np.isfinite(first.stiffness_Nm_rad).any():
        powered = [one for one in result.curves if (one.state, one.load_Nm) == ("powered", first.load_Nm)]
        static = min(one.static_Nm_rad for one in powered)
        weak = min(powered, key=lambda one: one.least)
        words = f"{short(static, 4)} {unit}" if math.isfinite(static) else "infinite (the drive comes back)"
        words = f"Powered{_at_load(result, first)}, the static stiffness is {words}; the least is "
        words += f"{short(weak.least[0], 4)} {unit} at {weak.least[1]:.3g} Hz{_way(weak, ' ({})')}"
    if result.checks:
        most, lost = max(check.difference for check in result.checks), result.lost_motion_difference
        count = len({check.frequency_hz for check in result.checks})
        words += f"; small loads at {count} frequencies agree to {most:.1e}, allowed {AGREED:g}"
        words += "" if lost is None else f", the lost motion to {lost:.1e}, allowed {READ:g}"
        words += " (relative)"
    elif result.unproven:
        words += f"; nothing is compared: {result.unproven}"
    return f"{words}. {requirements.result(result.requirements)}".rstrip()


def _figure(result: Stiffness, unit: str) -> list[doc.Block]:
    shown = [curve for curve in result.curves if np.isfinite(curve.stiffness_Nm_rad).all()]
    if not shown:
        return []
    chart, (top, bottom) = style.stack(420.0, 1.2, 1.0)
    top.y.log, top.y.label, bottom.y.label = True, f"stiffness, {unit}", "phase, deg"
    phases = [style.phases(curve.stiffness_Nm_rad) for curve in shown]
    for k, (curve, phase) in enumerate(zip(shown, phases, strict=True)):
        name = _state(result, curve)
        top.curve(curve.frequency_hz, np.abs(curve.stiffness_Nm_rad), name, **style.series(k))
        bottom.curve(curve.frequency_hz, phase, name, **style.series(k))
    style.frequency(bottom, shown[0].frequency_hz)
    style.phase_axis(bottom, np.concatenate(phases))
    return [doc.figure("stiffness", chart, "Dynamic stiffness of the output, powered and unpowered.")]


def _table(result: Stiffness, unit: str) -> doc.Block:
    infinite = any(math.isinf(value) for one in result.curves for value in (one.static_Nm_rad, one.least[0]))
    notes = ["Infinite: the output comes back to its place, or does not move at all."] * infinite
    pushed = any(one.static_Nm_rad < 0.0 for one in result.curves)
    notes += ["Below 0: the drive pushes the output away from its place."] * pushed
    static: dict[str, Any] = {"unit": unit, "format": "sig:4", "better": 1}
    hertz: dict[str, Any] = {"unit": "Hz", "format": "sig:4"}
    columns = [
        doc.of(lambda one: _state(result, one), "state", "State"),
        doc.of(lambda one: _or_infinite(one.static_Nm_rad), "static", "Static", **static),
        doc.of(lambda one: _or_infinite(one.least[0]), "least", "Least", **static),
        doc.of(lambda one: one.least[1] if one.least[0] < math.inf else None, "at", "at", **hertz),
    ]
    return doc.listing("Stiffness by state", result.curves, columns, " ".join(notes))


def _state(result: Stiffness, curve: StiffnessCurve) -> str:
    """With the load, where one is not 0, and the way of the friction, where there are two."""
    return STATES[curve.state] + _at_load(result, curve) + _way(curve, ", {}")


def _way(one: StiffnessCurve | Check, form: str) -> str:
    return form.format(WAYS[one.way]) if one.way in WAYS else ""


def _at_load(result: Stiffness, curve: StiffnessCurve) -> str:
    return f", {curve.load_Nm:g} {result.design.load_unit}" * any(one.load_Nm for one in result.curves)


def _or_infinite(stiffness: float) -> float | str:
    return stiffness if math.isfinite(stiffness) else "infinite"


def _lost_motion(result: Stiffness) -> doc.Block:
    size, lost = output_unit(result.design.axis).column("sig:4"), result.lost_motion
    assert lost is not None
    columns = [
        doc.of(lambda row: row[0], "what", "What"),
        doc.of(lambda row: row[1], "predicted", "Predicted", **size),
        doc.of(lambda row: row[2], "simulated", "Simulated", **size),
    ]
    rows = [("play", lost.play_rad, None)]
    if result.design.load.moment_max_Nm > 0.0:  # the largest load is known
        rows.append(("lost motion", lost.predicted_rad, lost.simulated_rad))
    note = (
        "Lost motion as gear makers read it, the motor held: between the middles of hysteresis at ±3 % of "
        f"the largest load {push_words(result.design)}, without the load's friction."
    )
    return doc.listing("Lost motion at the output", rows, columns, note)


def _at_rest(result: Stiffness, unit: str) -> doc.Block:
    note = (
        "Fundamental of the simulated drive as it is, with its dry friction, play and quantisation, the "
        "command held. No value: the output does not move, or not the same in the next period."
    )
    of_load = result.design.load_unit
    columns = [
        doc.of("moment_Nm", "moment", f"Load {push_words(result.design)}, peak", of_load, format="sig:3"),
        doc.of("frequency_hz", "frequency_hz", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda one: abs(one.simulated_Nm_rad), "simulated", "Stiffness", unit, format="sig:4"),
    ]
    return doc.listing("At rest, by amplitude", result.at_rest, columns, note)


def _checks(result: Stiffness, unit: str) -> doc.Block:
    note = (
        "The simulator's own derivative from a load, without play and counts: at rest without dry friction "
        "or, where friction has another slope in motion, creeping forward with it. Predicted is the linear "
        "stiffness there."
    )
    size: dict[str, Any] = {"unit": unit, "format": "sig:6"}
    columns = [
        doc.of("frequency_hz", "frequency_hz", "Frequency", "Hz", format="sig:4"),
        doc.of(lambda one: _or_infinite(abs(one.predicted_Nm_rad)), "predicted", "Predicted", **size),
        doc.of(lambda one: _or_infinite(abs(one.simulated_Nm_rad)), "simulated", "Simulated", **size),
        doc.of("difference", "difference", "Relative difference", format="sig:2"),
        *([doc.of(lambda one: _way(one, "{}"), "way", "Friction")] if _way(result.checks[0], "{}") else []),
    ]
    return doc.listing("Small loads", result.checks, columns, note)
