"""Dry friction at small signals: threshold, lost motion, standing error, limit cycles."""

import math

import numpy as np

from actuator_lti.design.model import Command, Design
from actuator_lti.drive.steady import torque_gain_Nm_rad
from analyses.friction_effects.result import FrictionEffects, FrictionPoint
from analyses.limit_cycles.run import CycleResult
from analyses.motion.settling import FROM_THE_LARGEST, Settling, accepted_rad, noticed, verdict_of, worded
from analyses.motion.settling import words as end_words
from nonlinear.bench.operating_motion import quiet
from reports import document as doc
from reports.charts import style
from reports.sections.names import Unit, fine_unit
from reports.verdict_summary import tally

ROUNDING = 1e-9  # of the triangle's amplitude: a width that is none
LEFT = 1e-3  # of a step: an error that is spoken of


def section(result: FrictionEffects) -> doc.Section:
    id, title, design = "friction-effects", "Dry friction at small signals", result.design
    if not result.points:
        return doc.section(id, title, [], result=f"Not applicable: {result.reason}.")
    fine, load = fine_unit(design.axis), design.load_unit
    items = [_cycle_verdict(design, point, fine, load) for point in result.points]
    tables = [_threshold_table(result, fine, load), *_figure(result, fine, load)]
    blocks = [doc.verdicts(items, what="checks"), *tables, _settling_table(result, fine, load)]
    intro = (
        "Dry friction has no small-signal gain: below a threshold nothing moves, and reversals lose motion. "
        "Friction alone: counts and noise of the sensors are left out."
    )
    status, words = tally(items).role, _summary(result, fine)
    severity: doc.Severity = "info" if status == "pass" else status
    return doc.section(id, title, blocks, result=words, intro=intro, status=status, severity=severity)


def _cycle_verdict(design: Design, point: FrictionPoint, fine: Unit, load: str) -> doc.VerdictItem:
    cycles, swing = point.cycles, noticed(design, point.cycles.settlings)
    slip = "none"
    if (one := cycles.stick_slip) is not None:
        size, kind = fine.of(one.output_amplitude_rad), "" if one.stable else ", unstable"
        slip = f"±{size} at {one.frequency_hz:.3g} Hz{kind}"
    sizes = len(cycles.settlings)
    result = f"at rest after steps of {sizes} sizes" if sizes > 1 else "at rest after a step of one size"
    result = result if swing is None else worded(design, swing, *fine)
    alone = " without counts and noise" if swing is not None and quiet(design) != design else ""
    agree = "as predicted" if cycles.as_predicted else "not as predicted"
    if not cycles.described:
        agree += "; the describing function is refuted: a sinusoid spends no time at rest"
    predicted = "; ".join(_predicted(item, fine) for item in cycles.cycles) or "none"
    diverges = swing is not None and swing.rest.verdict == "diverging"  # of no size
    return doc.verdict(
        f"validation-hunting-{point.load_Nm:g}",
        f"No limit cycle of friction after steps at {point.load_Nm:g} {load}",
        value=None if diverges else 0.0 if swing is None else fine.scale * swing.swing_rad,
        limit=fine.scale * accepted_rad(design),
        unit=fine.unit,
        passed=verdict_of(design, swing),
        comparison="<=",
        reason=f"describing function of the whole loop: {predicted}; stick-slip analysis: {slip}; "
        f"simulated{alone}: {result}; {agree}",
    )


def _predicted(item: CycleResult, fine: Unit) -> str:
    one = item.cycle
    kind = "stable" if one.stable else "unstable, the limit of what friction damps"
    seen = "" if item.ratio is None else f", simulated at {item.ratio:.2f} of that"
    hz = "" if item.frequency_hz is None else f", {item.frequency_hz:.4g} Hz"
    return f"±{fine.of(one.output_rad)} at {one.frequency_hz:.4g} Hz ({kind}; {item.verdict}{seen}{hz})"


def _threshold_table(result: FrictionEffects, fine: Unit, load: str) -> doc.Block:
    torque = Unit(1e3, "mN m") if load == "N m" else Unit(1.0, "N")
    size, wait = fine.column(), Unit(1e3, "ms").column("ms:3")
    columns = [
        doc.of("load_Nm", "load", "Load", load, format="short:4"),
        doc.of("dry_torque_Nm", "dry", "Dry friction, motor", **torque.column()),
        doc.of("threshold.static.forward_rad", "threshold", "Step that starts the motor at once", **size),
        doc.of("threshold.simulated_rad", "simulated", "simulated", **size),
        doc.of(lambda point: _wait(point, "predicted_s"), "wait", "Wait at half of it", **wait),
        doc.of(lambda point: _wait(point, "simulated_s"), "waited", "simulated", **wait),
        doc.of(lambda point: _lost(point, "lost_motion_rad"), "width", "Lost at a reversal", **size),
        doc.of(lambda point: _lost(point, "predicted_rad"), "predicted", "predicted", **size),
        doc.of("hysteresis.largest_rad", "largest", f"Largest effect of {_cause(result)}", **size),
    ]
    note = f"{_integrates(result)}: a step below the threshold {_below(result)}"
    note += (
        f", and motion lost in front of its sensor is recovered in its time{_behind(result)}. The effect is "
        "largest just after a reversal."
        if result.integrator
        else f". Each reversal loses the torque that sliding takes, both ways, over the stiffness"
        f"{_behind(result)}."
    )
    if not any(point.threshold for point in result.points):
        note = _without(result.design)
    elif not all(point.threshold for point in result.points):
        note += " A load without figures gives a forward step no threshold."
    if any(point.threshold and not point.hysteresis for point in result.points):
        note += " Nothing is lost against the drive without friction, as that is not stable."
    if result.design.command != Command():
        note += " Steps as they come behind the profile and filter of the command."
    title = "Threshold of motion, and motion lost at a reversal of the command"
    return doc.listing(title, result.points, columns, note)


def _without(design: Design) -> str:
    """Why no load has a threshold."""
    if design.friction.law == "tanh":
        return "The smoothed law of friction creeps: it has no threshold, and holds no motion at a reversal."
    if not math.isfinite(torque_gain_Nm_rad(design)):
        return "A law of one's own that integrates has no threshold: every step moves the output in its time."
    return "No load gives a forward step a threshold."


def _integrates(result: FrictionEffects) -> str:
    return f"{f'The {result.integrator}' if result.integrator else 'No'} controller integrates"


def _below(result: FrictionEffects) -> str:
    kicks = result.design.controller.position_loop.kicks
    if not result.integrator:
        return "moves the output by its own kick or never" if kicks else "never moves the output"
    if kicks:
        return "moves the output at once by its own kick, or later"
    known = [point.threshold.static for point in result.points if point.threshold is not None]
    alone = all(static.outer_integral_time_s is None for static in known)
    return "moves the output later" + ", after Tn (A0/A − 1)" * alone


def _cause(result: FrictionEffects) -> str:
    coupling = result.design.coupling
    return "friction" if coupling is None or coupling.play_rad == 0.0 else "friction and play"


def _behind(result: FrictionEffects) -> str:
    design = result.design
    if design.coupling is None or design.controller.position_loop.sensor == "output":
        return ""
    play = " and its play are" if design.coupling.play_rad else " is"
    return f"; behind the motor's sensor the spring's twist under the load's dry friction{play} lost"


def _wait(point: FrictionPoint, name: str) -> float | None:
    """A time of the wait at half the threshold, where that was waited for."""
    waits = point.threshold.waiting if point.threshold else ()
    full = point.threshold.static.forward_rad if point.threshold else 1.0
    return next((getattr(w, name) for w in waits if abs(w.amplitude_rad / full - 0.5) < 0.01), None)


def _lost(point: FrictionPoint, name: str) -> float | None:
    """A width of the hysteresis, 0 where rounding leaves it."""
    loop = point.hysteresis
    if loop is None:
        return None
    width = float(getattr(loop, name))
    return width if abs(width) > ROUNDING * loop.amplitude_rad else 0.0


def _settling_table(result: FrictionEffects, fine: Unit, load: str) -> doc.Block:
    def error(one: Settling) -> float:
        return one.rest.error if abs(one.rest.error) > 1e-6 * one.amplitude_rad else 0.0

    columns = [
        doc.of(lambda pair: pair[0], "load", "Load", load, format="short:4"),
        doc.of(lambda pair: pair[1].amplitude_rad, "step", "Step", **fine.column()),
        doc.of(lambda pair: pair[1].rest.after_s, "wait", "Waited", "s", format="sig:2"),
        doc.of(lambda pair: error(pair[1]), "error", "Remaining error", **fine.column("sig:2")),
        doc.of(lambda pair: end_words(pair[1].rest, *fine), "end", "The drive"),
    ]
    ends = [(point.load_Nm, one) for point in result.points for one in point.cycles.settlings]
    note = (
        "At each load steps from small to full deflection; where stick and slip is predicted, one of its "
        f"size as well, from rest under the load. {FROM_THE_LARGEST} Errors below 10⁻⁶ of the step are "
        "shown as 0."
    )
    if quiet(result.design) != result.design:
        note += " Where the drive comes to rest with its counts, it is not simulated again without them."
    return doc.listing(
        "Steady-state error after a step", ends, columns, note,
        lambda pair: "warn" if pair[1].hunting else None,
    )  # fmt: skip


def _figure(result: FrictionEffects, fine: Unit, load: str) -> list[doc.Block]:
    points = [(f"load {point.load_Nm:g} {load}", point) for point in result.points]
    loops = [(label, one.hysteresis) for label, one in points if one.hysteresis is not None]
    waits = [(label, of.waiting) for label, one in points if (of := one.threshold) and of.waiting]
    if not loops:
        return []
    scale, small = fine
    chart = style.Chart(width=style.WIDE, height=330.0)
    title = "Position error over a slow triangle of the command"
    panel = chart.panel(f"command, {small}", f"output less command, {small}", title=title, by_point=True)
    for k, (label, loop) in enumerate(loops):
        x, y = scale * loop.command_rad, scale * (loop.output_rad - loop.command_rad)
        panel.curve(np.append(x, x[0]), np.append(y, y[0]), label, **style.series(k))
    panel.rule_y(0.0)
    lag = f"without {_cause(result)} only a small lag is left"
    caption = f"Position error over a slow triangular command; {lag}."
    if waits:
        title = "Wait before a small step moves the output"
        panel = chart.panel(f"step, {small}", "time to first motion, ms", "xy", title=title)
        caption += " Right: a step below the threshold waits until the speed integrator reaches breakaway."
    for k, (label, waiting) in enumerate(waits):
        sizes = [scale * one.amplitude_rad for one in waiting]
        seen = [None if one.simulated_s is None else 1e3 * one.simulated_s for one in waiting]
        wanted = [1e3 * one.predicted_s for one in waiting]
        panel.curve(sizes, wanted, f"{label}: predicted", **style.series(k))
        panel.points(sizes, seen, f"{label}: simulated", **style.marked(k))
    return [doc.figure("hysteresis", chart, caption)]


def _summary(result: FrictionEffects, fine: Unit) -> str:
    settlings = [one for point in result.points for one in point.cycles.settlings]
    if (swing := noticed(result.design, settlings)) is not None:
        why = worded(result.design, swing, *fine)
        alone = "Without counts and noise a" if quiet(result.design) != result.design else "A"
        return f"{alone} step does not come to rest: {why}."
    if any(abs(one.rest.error) > LEFT * one.amplitude_rad for one in settlings):
        most = max(settlings, key=lambda one: abs(one.rest.error))
        under = f", at a load of {most.load_Nm:g} {result.design.load_unit}" if most.load_Nm else ""
        size = fine.of(abs(most.rest.error))
        return f"{_integrates(result)}; an error of up to {size} is left at rest{under}."
    if not result.integrator:
        return f"{_integrates(result)}; the steps leave no error at rest."
    words = "After steps dry friction alone leaves no steady-state error and causes no hunting"
    return f"{words}: the {result.integrator} integrator removes the error."
