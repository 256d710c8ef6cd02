"""Limit cycles of play and quantisation: predicted by describing function, then sought by simulation."""

from actuator_lti.asked.verdict import Verdict
from analyses.limit_cycles.run import AS_PREDICTED, CYCLES_WATCHED, LimitCycles
from analyses.motion import settling
from reports import document as doc
from reports.sections.names import Unit, fine_unit

CAUSES = {
    "play": "play",
    "quantisation": "quantised output sensor",
    "motor-quantisation": "quantised motor encoder",
}


def section(result: LimitCycles) -> doc.Section:
    fine = fine_unit(result.design.axis)
    intro = (
        "Play acts for a sinusoidal twist as a softer coupling, a sensor's count for a small swing about its "
        "edge as a relay. A cycle is predicted where the sampled loop with that gain keeps an oscillation's "
        "size, then the simulator is started in its shape at many sizes. Cycles of dry friction alone stand "
        "under Dry friction at small signals."
    )
    causes = " or ".join(CAUSES[name] for name in result.looked_for) or "play or a quantised output sensor"
    none = doc.text(f"No limit cycle of {causes} is predicted.")
    predicted = _predicted(result, fine) if result.cycles else none
    grave, words = doc.severity(result.verdict), summary(result)
    blocks = [predicted, _rests(result, fine)]
    return doc.section("cycles", "Limit cycles", blocks, result=words, intro=intro, severity=grave)


def summary(result: LimitCycles) -> str:
    fine = fine_unit(result.design.axis)
    swing, count = result.hunting, len(result.cycles)
    seen = sum(one.verdict == "confirmed" for one in result.cycles)
    tail = "; no cycle is predicted"
    if count:
        tail = f"; {seen} of {count} predicted cycles confirmed" + ", the simulation decides" * (seen < count)
    if swing is None:
        left = [one for one in result.settlings if one.hunting]  # too small, or not long enough
        ends = [f"after {fine.of(one.amplitude_rad)} it {settling.words(one.rest, *fine)}" for one in left]
        faint = [one for one in result.settlings if not one.hunting and one.swing_rad]
        if faint:
            largest = max(faint, key=lambda one: one.swing_rad)
            ends.append(f"for {settling.faint_words(largest.rest, *fine)}")
        still = f", but {', '.join(ends)}" if ends else ""
        return f"The drive as it is comes to rest after every step{still}{tail}."
    does = {
        Verdict.MET: f"comes to rest as far as is asked ({settling.judged_by(result.design)})",
        Verdict.NOT_MET: "does not come to rest",
        Verdict.NOT_PROVEN: "is not known to come to rest",
    }[settling.verdict_of(result.design, swing)]
    at = f"{swing.load_Nm:g} {result.design.load_unit}"
    return f"The drive as it is {does}: {settling.words(swing.rest, *fine)} under {at}{tail}."


def _predicted(result: LimitCycles, fine: Unit) -> doc.Block:
    size = fine.column()
    columns = [
        doc.of(lambda one: CAUSES[one.cycle.cause], "cause", "Cause"),
        doc.of(lambda one: "in it" if one.cycle.with_friction else "left out", "friction", "Dry friction"),
        doc.of(lambda one: "stable" if one.cycle.stable else "unstable", "kind", "Kind"),
        doc.of("cycle.output_rad", "size", "Predicted, peak", **size, better=-1),
        doc.of("cycle.frequency_hz", "hz", "at", "Hz", format="sig:3"),
        doc.of(lambda one: one.ratio and one.ratio * one.cycle.output_rad, "seen", "Simulated", **size),
        doc.of("frequency_hz", "seen_hz", "at", "Hz", format="sig:3"),
        doc.of("verdict", "verdict", "Verdict"),
    ]
    note = (
        "Stable: motion near it ends in it. Unstable: smaller motion dies out, larger grows. Friction left "
        "out or by its own describing function, as the column says; no limit acts. Confirmed: amplitude and "
        f"frequency are both within a factor of {AS_PREDICTED:g} of the predicted."
    )
    if not all(one.tried for one in result.cycles):
        note += f" Not tried: {CYCLES_WATCHED} periods take more ticks than are simulated at once."
    return doc.listing("Predicted limit cycles, at the output", result.cycles, columns, note)


def _rests(result: LimitCycles, fine: Unit) -> doc.Block:
    def end(one: settling.Settling) -> str:
        stands = one.rest.verdict == "still moving" and not one.swing_rad
        words = "stands still, not known for how long" if stands else one.rest.verdict
        return words + settling.acting(one.rest)

    size = fine.column()
    columns = [
        doc.of("load_Nm", "load", "Load", result.design.load_unit, format="short:4"),
        doc.of("amplitude_rad", "step", "Step", **size),
        doc.of(end, "end", "Ends"),
        doc.of(lambda one: one.rest.amplitude or None, "size", "Output, peak", **size, better=-1),
        doc.of(lambda one: one.rest.motor_amplitude or None, "motor", "Motor, at the output", **size),
        doc.of("rest.frequency_hz", "hz", "at", "Hz", format="sig:3"),
    ]
    note = "The drive as it is: dry friction, play, quantisation and limits at work. "
    listed = ("What steps end in", result.settlings, columns, note + settling.FROM_THE_LARGEST)
    return doc.listing(*listed, status=lambda one: "warn" if one.hunting else None)
