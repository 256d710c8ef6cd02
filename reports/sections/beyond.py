"""What is no small signal about a steady motion: large commands, motion from rest, counts of the sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from analyses.large_signal.conditional import Conditional, Prediction
from analyses.large_signal.from_rest import RestSweep
from analyses.limit_cycles.counts import WITHIN, Counts
from analyses.limit_cycles.run import Confirmation
from reports import document as doc
from reports.charts import style
from reports.document_schema import FactItem
from reports.sections.names import POINTS, output_unit


def large_commands(conditional: Conditional, axis: str = "rotary") -> doc.Section:
    """Make the section: what the describing functions say, and what steps of growing size do."""
    scale, unit = output_unit(axis)
    result, *more = _words(conditional, scale, unit)
    blocks = [*map(doc.text, more), _large_facts(conditional, scale, unit)]
    if conditional.predictions:
        blocks.append(_table(conditional.predictions, scale, unit))
    intro = (
        "A limit reduces the effective gain. A loop with a lower gain margin can then become unstable at "
        "large commands, although every linear margin is sufficient. Steps are simulated with dry friction."
    )
    return doc.section(
        "conditional", "Large commands and conditional stability", blocks, result=result, intro=intro,
        status="fail" if conditional.diverges else "pass", findings=findings_of(conditional, axis),
    )  # fmt: skip


def findings_of(conditional: Conditional, axis: str = "rotary") -> list[doc.Finding]:
    text = _words(conditional, *output_unit(axis))[0]
    return [doc.Finding(severity="fail", text=text, where="conditional")] if conditional.diverges else []


def _words(conditional: Conditional, scale: float, unit: str) -> list[str]:
    full = f"{conditional.full_deflection_rad * scale:.4g} {unit}"
    if not conditional.diverges:
        return [f"No step from rest up to full deflection ({full}) is made to oscillate by a limit."]
    threshold = conditional.threshold_rad or 0.0
    beyond = f"beyond {threshold * scale:.4g} {unit}" if threshold else "of any size"
    words = f"Steps {beyond} do not settle (full deflection {full})"
    words += ", although every loop is stable by its linear margins" if conditional.hidden else ""
    words += f": {_ending(conditional, scale, unit)}." if conditional.ending else "."
    made = [words]
    hz, swing = conditional.oscillation_hz, conditional.oscillation_rad
    if hz is not None and swing is not None:
        size = f"{swing * scale:.3g} {unit}"
        made.append(f"At the threshold the output nears a limit cycle of {size} at {hz:.3g} Hz.")
        best = next((one for one in conditional.predictions if not one.antiwindup), None)
        if best is not None:
            size = f"{best.output_rad * scale:.3g} {unit} at {best.frequency_hz:.3g} Hz"
            made.append(f"The describing function of the {best.limiter} limit predicts {size}.")
    return made


def _ending(conditional: Conditional, scale: float, unit: str) -> str:
    swing = f"{(conditional.end_rad or 0.0) * scale:.3g} {unit}"
    words = {
        "diverges": "the output diverges",
        "keeps oscillating": f"the output keeps oscillating with {swing}",
        "is held by a limit": "the drive stops short of the command",
    }[conditional.ending]
    share = f"; the {conditional.limiter} limit acts {100 * conditional.limiter_share:.0f} % of the time"
    return words + share * bool(conditional.limiter)


def _large_facts(conditional: Conditional, scale: float, unit: str) -> doc.Block:
    size = (conditional.threshold_rad or conditional.full_deflection_rad) * scale
    items = [doc.fact("Largest step after which no limit sustains an oscillation", size, unit, better=1)]
    for point, margins in conditional.margins.items():
        if margins.stable and margins.gain_lower > 0.0:
            label = f"Lower gain margin at {POINTS.get(point, point)}, all loops closed"
            items.append(doc.fact(label, _lower_db(margins), "dB", better=2))
    return doc.facts(items)


WINDUP = {True: "yes: safer than predicted", False: "no"}


def _lower_db(of: Any) -> float:
    return 20.0 * math.log10(of.gain_lower)


def _table(predictions: tuple[Prediction, ...], scale: float, unit: str) -> doc.Block:
    columns = [
        doc.of("limiter", "limiter", "Limit"),
        doc.of(lambda one: POINTS.get(one.point, one.point), "point", "In front of it"),
        doc.of(_lower_db, "gain", "Lower gain margin", "dB", format="sig:4", better=2),
        doc.of(lambda one: one.amplitude / one.limit, "ratio", "Amplitude over limit", format="sig:3"),
        doc.of("frequency_hz", "hertz", "Oscillates at", "Hz", format="sig:3"),
        doc.of("output_rad", "output", "Output", unit, scale=scale, format="sig:3"),
        doc.of(lambda one: WINDUP[one.antiwindup], "antiwindup", "Anti-windup in front"),
    ]
    note = "Describing function of saturation: from this amplitude on an oscillation is sustained."
    return doc.listing("Predicted limit cycles", predictions, columns, note)


NAMES = {"motor": "Motor encoder", "output": "Output encoder"}


def counts(found: Sequence[Counts], axis: str = "rotary") -> doc.Section:
    """Make the section: standing error, ripple, limit cycles, and from where the loop is linear."""
    intro = (
        "A counted angle is a staircase. About the edge of a count it is a relay (gain 2 q/(π A)); for "
        "large amplitudes its gain tends to 1. The motor's counts are seen in the speed made of them, the "
        "output's in its position."
    )
    cycles = [(one, cycle) for one in found for cycle in one.cycles]
    blocks: list[doc.Block] = [doc.facts(_facts(one, axis)) for one in found]
    blocks += [_cycles(cycles, axis)] if cycles else []
    words = [sentence(one, axis) for one in found]
    findings = [doc.Finding(severity="info", text=text, where="counts") for text in words]
    title = "Counts of the encoders"
    return doc.section("counts", title, blocks, result=" ".join(words), intro=intro, findings=findings)


def sentence(one: Counts, axis: str) -> str:
    scale, unit, speed = _units(axis)
    side = "" if axis == "linear" else " (motor side)"
    words = [f"{one.ripple_rad_s:.2g} {speed} of ripple at {one.ripple_at_rad_s:.3g} {speed}{side}"]
    if one.speed_step_rad_s is not None:
        words.append(f"steps of {one.speed_step_rad_s:.3g} {speed} in the speed estimate")
    if one.standing_rad:
        words.append(f"up to {one.standing_rad * scale:.2g} {unit} of standing error")
    return f"{NAMES[one.sensor]}: counts add {', '.join(words)}."


def _facts(one: Counts, axis: str) -> list[FactItem]:
    scale, unit, speed = _units(axis)
    name = NAMES[one.sensor]
    standing, seen = one.standing_rad * scale, one.standing_seen_rad * scale
    within = f"Linear within {100 * WITHIN:.0f} %"
    linear = f"{within} from this amplitude at the sensor on, by describing function"
    items = [
        doc.fact(f"{name}: one count", one.quantum_rad * scale, unit),
        doc.fact("Ripple of the motor's speed, largest", one.ripple_rad_s, speed),
        doc.fact("at a motor speed of", one.ripple_at_rad_s, speed),
        doc.fact("Standing error of one count, without friction", standing, unit, better=-1),
        doc.fact("what counts add to it after a step with friction", seen, unit, better=-1),
        doc.fact(linear, one.linear_rad * scale, unit),
    ]
    if one.linear_seen_rad is not None:
        label = "Linear from this amplitude on, simulated at the bandwidth"
        items.append(doc.fact(label, one.linear_seen_rad * scale, unit))
    if one.speed_step_rad_s is not None:
        items.append(doc.fact("Steps of the speed estimate", one.speed_step_rad_s, speed))
    return items


def _cycles(cycles: Sequence[tuple[Counts, Confirmation]], axis: str) -> doc.Block:
    scale, unit, _ = _units(axis)
    size: dict[str, Any] = {"unit": unit, "scale": scale, "format": "sig:3"}
    columns = [
        doc.of(lambda pair: NAMES[pair[0].sensor], "sensor", "Sensor"),
        doc.of(lambda pair: pair[1].cycle.inner_rad, "amplitude", "Amplitude at the sensor", **size),
        doc.of(lambda pair: pair[1].cycle.output_rad, "output", "At the output", **size),
        doc.of(lambda pair: pair[1].cycle.frequency_hz, "hertz", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda pair: pair[1].ratio, "ratio", "Simulated over predicted", format="sig:3"),
        doc.of(lambda pair: pair[1].verdict, "verdict", "Verdict"),
    ]
    note = "Without dry friction, which quiets most of them."
    return doc.listing("Limit cycles of the counts", cycles, columns, note)


def _units(axis: str) -> tuple[float, str, str]:
    return (*output_unit(axis), "m/s" if axis == "linear" else "rad/s")


def from_rest(sweep: RestSweep, axis: str) -> list[doc.Section]:
    """Make the section where there is dry friction that is described; else none."""
    if not np.isfinite(sweep.described).any():
        return []
    scale, unit = output_unit(axis)
    low, high = sweep.amplitude_rad.min() * scale, sweep.amplitude_rad.max() * scale
    clear = "" if any(sweep.limiter) else ", below every limit"
    words = described(sweep)
    sizes = f"{low:.3g} {unit}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g} {unit}"
    caption = (
        f"Command to output from rest, amplitude {sizes}{clear}. {words} The "
        "sliding loop does not include the reversals."
    )
    intro = "Dry friction has no small-signal gain where the speed changes sign: it depends on the amplitude."
    block = doc.figure("rest_sweep", _chart(sweep), caption)
    return [doc.section("from-rest", "From rest: effect of dry friction", [block], result=words, intro=intro)]


def _chart(sweep: RestSweep) -> style.Chart:
    chart = style.Chart(width=style.WIDE, height=500.0)
    top, bottom, off = chart.column(3, 3, 2)
    moves = np.abs(sweep.measured) > 0.0
    points: style.Style = {"colour": style.BLUE, "marker": "o", "size": 6.0, "hollow": True, "line": False}
    lines = (
        ("simulated from rest", sweep.measured, points),
        ("sliding loop", sweep.sliding, style.series(1)),
        ("describing function of dry friction", sweep.described, style.series(2)),
    )
    phases = []
    for label, values, look in lines:
        size = np.abs(values)
        decibel = 20.0 * np.log10(np.where(size > 0.0, size, np.nan))
        phase = np.degrees(np.unwrap(np.angle(values)))
        phases += phase[np.isfinite(phase)].tolist()
        top.curve(sweep.frequency_hz, decibel, label, **look)
        bottom.curve(sweep.frequency_hz, phase, label, **look)
        if look is not points:
            seen = np.where(moves, np.abs(sweep.measured), 1.0)
            ratio = np.where(moves & (size > 0.0), size, np.nan) / seen
            off.curve(sweep.frequency_hz, 20.0 * np.log10(ratio), label, **look)
    off.rule_y(0.0)
    style.phase_axis(bottom, phases)
    style.frequency(off)
    top.y.label, bottom.y.label, off.y.label = "magnitude, dB", "phase, deg", "difference, dB"
    return chart


def described(sweep: RestSweep) -> str:
    """How far the describing function is from the simulation, in figures: no verdict."""
    both = (sweep.measured != 0.0) & np.isfinite(sweep.measured) & (np.abs(sweep.described) > 0.0)
    ratio = sweep.measured[both] / sweep.described[both]
    if not ratio.size:
        return "The describing function is not compared: dry friction holds the rotor."
    gain = float(np.abs(20.0 * np.log10(np.abs(ratio))).max())
    phase = float(np.abs(np.degrees(np.angle(ratio))).max())
    words = "The describing function at the simulated speed amplitude differs from the simulation by up to"
    return f"{words} {gain:.2g} dB and {phase:.2g} deg."
