"""What is no small signal about a steady motion: large commands, motion from rest, counts of the sensors."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from analyses.large_signal.conditional import Conditional, Prediction
from analyses.large_signal.from_rest import RestSweep
from analyses.limit_cycles.counts import WITHIN, Counts
from analyses.limit_cycles.run import CycleResult
from reports import document as doc
from reports.charts import style
from reports.sections.limits import words_of
from reports.sections.names import POINTS, Unit, fine_unit, output_unit, speed_unit


def large_commands(conditional: Conditional, axis: str = "rotary") -> doc.Section:
    out = output_unit(axis)
    result, *more = _words(conditional, out)
    size = conditional.threshold_rad or conditional.full_deflection_rad
    label = "Largest step after which no limit sustains an oscillation"
    facts = [doc.fact(label, out.scale * size, out.unit, better=1)]
    for point, margins in conditional.margins.items():
        if margins.stable and margins.gain_lower > 0.0:
            label = f"Lower gain margin at {POINTS.get(point, point)}, all loops closed"
            facts.append(doc.fact(label, _lower_db(margins), "dB", better=2))
    blocks = [*map(doc.text, more), doc.facts(facts)]
    if conditional.predictions:
        blocks.append(_table(conditional.predictions, out))
    intro = (
        "A limit reduces the effective gain. A loop with a lower gain margin can then become unstable at "
        "large commands, although every linear margin is sufficient. Steps are simulated with dry friction."
    )
    return doc.section(
        "conditional", "Large commands and conditional stability", blocks, result=result, intro=intro,
        status="fail" if conditional.diverges else "pass", findings=findings_of(conditional, axis),
    )  # fmt: skip


def findings_of(conditional: Conditional, axis: str = "rotary") -> list[doc.Finding]:
    text = _words(conditional, output_unit(axis))[0]
    return [doc.Finding(severity="fail", text=text, where="conditional")] if conditional.diverges else []


ENDINGS = {
    "diverges": "the output diverges",
    "keeps oscillating": "the output keeps oscillating with {swing}",
    "is held by a limit": "the drive stops short of the command",
}


def _words(conditional: Conditional, out: Unit) -> list[str]:
    full, threshold = out.of(conditional.full_deflection_rad, 4), conditional.threshold_rad
    if not conditional.diverges:
        return [f"No step from rest up to full deflection ({full}) is made to oscillate by a limit."]
    beyond = f"beyond {out.of(threshold, 4)}" if threshold else "of any size"
    words = f"Steps {beyond} do not settle (full deflection {full})"
    words += ", although every loop is stable by its linear margins" if conditional.hidden else ""
    if conditional.ending:
        words += f": {ENDINGS[conditional.ending].format(swing=out.of(conditional.end_rad or 0.0))}"
        share = f"{100 * conditional.limiter_share:.0f} % of the time"
        words += f"; the {words_of(conditional.limiter)} acts {share}" * bool(conditional.limiter)
    made, hz, swing = [f"{words}."], conditional.oscillation_hz, conditional.oscillation_rad
    if hz is not None and swing is not None:
        made.append(f"At the threshold the output nears a limit cycle of {out.of(swing)} at {hz:.3g} Hz.")
        best = next((one for one in conditional.predictions if not one.antiwindup), None)
        if best is not None:
            size = f"{out.of(best.output_rad)} at {best.frequency_hz:.3g} Hz"
            made.append(f"The describing function of the {best.limiter} predicts {size}.")
    return made


WINDUP = {True: "yes: safer than predicted", False: "no"}


def _lower_db(of: Any) -> float:
    return 20.0 * math.log10(of.gain_lower)


def _table(predictions: tuple[Prediction, ...], out: Unit) -> doc.Block:
    columns = [
        doc.of("limiter", "limiter", "Limit"),
        doc.of(lambda one: POINTS.get(one.point, one.point), "point", "In front of it"),
        doc.of(_lower_db, "gain", "Lower gain margin", "dB", format="sig:4", better=2),
        doc.of(lambda one: one.amplitude / one.limit, "ratio", "Amplitude over limit", format="sig:3"),
        doc.of("frequency_hz", "hertz", "Oscillates at", "Hz", format="sig:3"),
        doc.of("output_rad", "output", "Output", **out.column()),
        doc.of(lambda one: WINDUP[one.antiwindup], "antiwindup", "Anti-windup in front"),
    ]
    note = "Describing function of saturation: from this amplitude on an oscillation is sustained."
    return doc.listing("Predicted limit cycles", predictions, columns, note)


NAMES = {"motor": "Motor encoder", "output": "Output encoder"}


def counts(found: Sequence[Counts], axis: str = "rotary") -> doc.Section:
    intro = (
        "A counted position is a staircase. About the edge of a count it is a relay (gain 2 q/(π A)); for "
        "large amplitudes its gain tends to 1. The motor's counts are seen in the speed made of them, the "
        "output's in its position."
    )
    cycles = [(one, cycle) for one in found for cycle in one.cycles]
    blocks: list[doc.Block] = [_facts(one, axis) for one in found]
    blocks += [_cycles(cycles, fine_unit(axis))] if cycles else []
    words = [sentence(one, axis) for one in found]
    findings = [doc.Finding(severity="info", text=text, where="counts") for text in words]
    title = "Counts of the encoders"
    return doc.section("counts", title, blocks, result=" ".join(words), intro=intro, findings=findings)


def sentence(one: Counts, axis: str) -> str:
    speed, side = speed_unit(axis), "" if axis == "linear" else " (motor side)"
    words = [f"{one.ripple_rad_s:.2g} {speed} of ripple at {one.ripple_at_rad_s:.3g} {speed}{side}"]
    if one.speed_step_rad_s is not None:
        words.append(f"steps of {one.speed_step_rad_s:.3g} {speed} in the speed estimate")
    if one.standing_rad:
        words.append(f"up to {fine_unit(axis).of(one.standing_rad, 2)} of standing error")
    return f"{NAMES[one.sensor]}: counts add {', '.join(words)}."


def _facts(one: Counts, axis: str) -> doc.Block:
    out, speed = fine_unit(axis), Unit(1.0, speed_unit(axis))
    within = f"Linear within {100 * WITHIN:.0f} %"
    rows = (
        (f"{NAMES[one.sensor]}: one count", one.quantum_rad, out, 0),
        ("Ripple of the motor's speed, largest", one.ripple_rad_s, speed, 0),
        ("at a motor speed of", one.ripple_at_rad_s, speed, 0),
        ("Standing error of one count, without friction", one.standing_rad, out, -1),
        ("what counts add to it after a step with friction", one.standing_simulated_rad, out, -1),
        (f"{within} from this amplitude at the sensor on, by describing function", one.linear_rad, out, 0),
        ("Linear from this amplitude on, simulated at the bandwidth", one.linear_simulated_rad, out, 0),
        ("Steps of the speed estimate", one.speed_step_rad_s, speed, 0),
    )
    return doc.facts(
        doc.fact(label, of.scale * value, of.unit, better=better)
        for label, value, of, better in rows
        if value is not None
    )


def _cycles(cycles: Sequence[tuple[Counts, CycleResult]], out: Unit) -> doc.Block:
    columns = [
        doc.of(lambda pair: NAMES[pair[0].sensor], "sensor", "Sensor"),
        doc.of(lambda pair: pair[1].cycle.inner_rad, "amplitude", "Amplitude at the sensor", **out.column()),
        doc.of(lambda pair: pair[1].cycle.output_rad, "output", "At the output", **out.column()),
        doc.of(lambda pair: pair[1].cycle.frequency_hz, "hertz", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda pair: pair[1].ratio, "ratio", "Simulated over predicted", format="sig:3"),
        doc.of(lambda pair: pair[1].verdict, "verdict", "Verdict"),
    ]
    note = "Without dry friction, which quiets most of them."
    return doc.listing("Limit cycles of the counts", cycles, columns, note)


def from_rest(sweep: RestSweep, axis: str) -> list[doc.Section]:
    """Make the section where there is dry friction that is described; else none."""
    if not np.isfinite(sweep.described).any():
        return []
    scale, unit = output_unit(axis)
    ends = dict.fromkeys(f"{scale * end(sweep.amplitude_rad):.3g}" for end in (np.min, np.max))
    clear = "" if any(sweep.limiter) else ", below every limit"
    words = described(sweep)
    caption = (
        f"Command to output from rest, amplitude {' to '.join(ends)} {unit}{clear}. {words} The "
        "sliding loop does not include the reversals."
    )
    intro = "Dry friction has no small-signal gain where the speed changes sign: it depends on the amplitude."
    block = doc.figure("rest_sweep", _chart(sweep), caption)
    return [doc.section("from-rest", "From rest: effect of dry friction", [block], result=words, intro=intro)]


def _chart(sweep: RestSweep) -> style.Chart:
    chart, (top, bottom, off) = style.stack(500.0, 3, 3, 2)
    look: style.Style = {"colour": style.BLUE, "marker": "o", "size": 6.0, "hollow": True, "line": False}
    top.curve(sweep.frequency_hz, style.decibels(sweep.measured), "simulated from rest", **look)
    bottom.curve(sweep.frequency_hz, style.phases(sweep.measured), "simulated from rest", **look)
    lines = {"sliding loop": sweep.sliding, "describing function of dry friction": sweep.described}
    for k, (label, values) in enumerate(lines.items(), 1):
        moves = np.where(np.abs(sweep.measured) > 0.0, sweep.measured, np.nan)
        top.curve(sweep.frequency_hz, style.decibels(values), label, **style.series(k))
        bottom.curve(sweep.frequency_hz, style.phases(values), label, **style.series(k))
        ratio = np.abs(values) / np.abs(moves)
        off.curve(sweep.frequency_hz, style.decibels(ratio), label, **style.series(k))
    off.rule_y(0.0)
    off.y.label = "difference, dB"
    every = np.concatenate([style.phases(values) for values in (sweep.measured, *lines.values())])
    style.bode_axes(top, bottom, every)
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
