"""Failure cases: what the output does before anybody notices, and what the train has to carry."""

from math import inf
from typing import Any

import numpy as np

from actuator_lti.asked.verdict import Verdict
from analyses.failures.run import Failures
from analyses.motion.settling import acting, noticed, verdict_of, worded
from reports import document as doc
from reports.charts import style
from reports.numbers import seconds, short
from reports.sections import requirements
from reports.sections.names import Unit, command_unit, output_unit, push_words

NAMES = {
    "hard-over": "Hard-over of the power stage",
    "open-phase": "Open phase",
    "hard-over-command": "Hard-over command",
    "jam": "Jam",
    "frozen-sensor": "Frozen sensor",
    "lost-sensor": "Lost sensor",
    "oscillatory-command": "Oscillatory command",
}
_SHOWN = 400


def section(result: Failures) -> doc.Section:
    out, asked, push = output_unit(result.design.axis), result.asked, push_words(result.design)
    swing, load = noticed(result.design, result.before), f"{asked.load_Nm:g} {result.design.load_unit}"
    held = "has come to rest"
    if asked.speed_rad_s:
        held = f"turns at a command of {out.per('s').of(asked.speed_rad_s)}{acting(result.before[0].rest)}"
    if swing is not None:
        held = f"{_unsteady(result)}, {worded(result.design, swing, *command_unit(result.design))},"
    stop = f"the stop is {out.of(asked.stop_rad, 4)} away" if asked.stop_rad < inf else "no stop is stated"
    intro = (
        f"Each failure is simulated from a drive that {held} under {load} (positive pushes forward). "
        f"Deflection counts from where the output was; {stop}, and "
        f"detection takes {1e3 * asked.detection_s:.4g} ms. The {push} is "
    )
    rigid = (
        "what this rigid train passes to the output, to its inertia and load or, jammed, what "
        "the motor presses with, less dry friction and gear losses, without an impact"
    )
    intro += f"{rigid if result.design.coupling is None else 'that in the coupling'}."
    left = [f"{NAMES[name]}: not for this drive, as {why}." for name, why in result.left_out.items()]
    own = requirements.table(result.requirements)
    blocks = [_table(result, out), *own, _figure(result, out), *map(doc.text, left)]
    status = severity = "info" if result.verdict is None else doc.severity(result.verdict)
    if status == "info" and verdict_of(result.design, swing) is not Verdict.MET:
        severity = "warn"
    words, title = summary(result), "Failure cases"
    return doc.section("failures", title, blocks, result=words, intro=intro, status=status, severity=severity)


def _turns(result: Failures) -> bool:
    """Whether the drive fails as it turns: then its speed is what to look at."""
    return result.design.controller.outermost == "velocity"


def _unsteady(result: Failures) -> str:
    return f"does not {'become steady' if _turns(result) else 'come to rest'}"


def summary(result: Failures) -> str:
    out, detection = output_unit(result.design.axis), result.asked.detection_s
    stopped = {case.name: case.to_stop_s for case in result.cases if case.to_stop_s is not None}
    soonest = {case.name: min(stopped.get(case.name, inf), detection) for case in result.cases}
    worst = min(result.cases, key=lambda case: (soonest[case.name], -case.at_detection_rad))
    when, reached = seconds(detection), stopped.get(worst.name)
    if reached is not None and reached <= detection:
        words = f"reaches the stop first, {seconds(reached)} after it occurs; detection takes {when}"
    else:
        size = f"{short(out.scale * worst.at_detection_rad, 3)} {out.unit}"
        words = f"moves the output most until it is detected: {size} in {when}"
        words += "" if reached is None else f"; it reaches the stop after {seconds(reached)}"
    if _turns(result):
        fastest = max(result.cases, key=lambda case: case.peak_speed_rad_s)
        top = out.per("s").of(fastest.peak_speed_rad_s)
        words += f"; the fastest is {NAMES[fastest.name].lower()}, {top}"
    swing = noticed(result.design, result.before)
    if swing is not None and verdict_of(result.design, swing) is not Verdict.MET:
        does = f"{_unsteady(result)} under {result.asked.load_Nm:g} {result.design.load_unit}"
        words += f"; before it the drive {does}: {worded(result.design, swing, *command_unit(result.design))}"
    return f"{NAMES[worst.name]} {words}. {requirements.result(result.requirements)}".rstrip()


def _table(result: Failures, out: Unit) -> doc.Block:
    time, asked = Unit(1e3, "ms").column("ms:3"), result.asked
    times = []
    if asked.deflection_rad < inf:
        times.append(doc.of("to_deflection_s", "near", f"To {out.of(asked.deflection_rad, 4)}", **time))
    if asked.stop_rad < inf:
        times.append(doc.of("to_stop_s", "stop", "To the stop", **time))
    most: dict[str, Any] = {"format": "sig:3", "better": -1}
    push, load = push_words(result.design), result.design.load_unit
    current = "peak_current_A" if result.design.motor.has_electrical_dynamics else lambda _case: None
    columns = [
        doc.of(lambda case: NAMES[case.name], "case", "Failure"),
        *times,
        doc.of("at_detection_rad", "seen", "Until detected", **out.column(better=-1)),
        doc.of("peak_speed_rad_s", "speed", "Peak speed", **out.per("s").column(better=-1)),
        doc.of(current, "current", "Peak current", "A", **most),
        doc.of("peak_moment_Nm", "moment", f"Peak {push}", load, **most),
        doc.of("protected_s", "protected", "I²t acts at", **time),
        doc.of("words", "words", "What happens"),
    ]
    note = f"No value: not within the {result.asked.watched_s:g} s watched."
    return doc.listing("Failure cases", result.cases, columns, note)


def _figure(result: Failures, out: Unit) -> doc.Block:
    asked = result.asked
    stops = [case.to_stop_s for case in result.cases if case.to_stop_s is not None]
    last = min(asked.watched_s, 1.2 * max([2.0 * asked.detection_s, *stops]))
    shown = [case for case in result.cases if case.name != "oscillatory-command"]  # a band of ink
    counts = [int(np.searchsorted(case.time_s, last)) for case in shown]
    last = max(float(case.time_s[count - 1]) for case, count in zip(shown, counts, strict=True))
    chart, (top, bottom) = style.stack(460.0, 1.2, 1.0, legend=True)
    per_s = style.time_axis(bottom, last)
    for k, (case, count) in enumerate(zip(shown, counts, strict=True)):
        keep = np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).astype(int))
        time = case.time_s[keep] * per_s
        motion = case.speed_rad_s if _turns(result) else case.deflection_rad
        top.curve(time, out.scale * motion[keep], NAMES[case.name], **style.series(k))
        bottom.curve(time, case.moment_Nm[keep], NAMES[case.name], **style.series(k))
    if asked.stop_rad < inf and not _turns(result):
        top.rule_y(out.scale * asked.stop_rad, "stop", seen=True, colour=style.RED, dash=1)
    for panel in (top, bottom):
        panel.rule_x(asked.detection_s * per_s, "detected" if panel is top else "")
    push = push_words(result.design)
    top.y.label, bottom.y.label = f"deflection, {out.unit}", f"{push}, {result.design.load_unit}"
    bottom.x.limits(0.0, last * per_s)
    both = f"Deflection of the output and {push}"
    if _turns(result):
        top.y.label, both = f"speed, {out.per('s').unit}", f"Speed of the output and {push}"
    return doc.figure("failures", chart, f"{both} in the train after each failure but the oscillation.")
