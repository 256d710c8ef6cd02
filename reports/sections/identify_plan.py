"""Motions that tell a drive's values as closely as asked, and the intervals to be expected."""

from __future__ import annotations

from itertools import groupby

from analyses.estimation.parameters import parameter
from analyses.identification.plan import Plan
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Section, Status
from reports.sections.identified import parameter_table
from reports.sections.thinning import kept_rows

NEXT = "What the records at hand tell is counted; these motions are what to measure next."


def section(plan: Plan) -> Section:
    """Make the section of a plan."""
    axis = plan.design.axis
    unit, rate = ("m", "m/s") if axis == "linear" else ("rad", "rad/s")
    drive = "V" if plan.design.effective_motor.torque_constant_Nm_A is None else "A"
    groups = [(next(same), 1 + sum(1 for _ in same)) for _, same in groupby(plan.segments, key=id)]
    columns = [
        doc.of(lambda row: row[1], "times", "Times", format="int"),
        doc.of(lambda row: row[0].shape, "shape", "Motion of 4 s"),
        doc.of(lambda row: row[0].cycles / 4.0, "frequency", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda row: row[0].amplitude, "amplitude", "Amplitude, output", unit, format="sig:3"),
        doc.of(lambda row: row[0].speed, "speed", "Largest motor speed", rate, format="sig:3"),
        doc.of(lambda row: row[0].drive_rms, "rms", "Drive signal, rms", drive, format="sig:3"),
    ]
    share = doc.of(plan.half_widths.get, "share", "Half interval", "%", scale=100.0, format="sig:3")
    note = "Half interval: over the value; of the offset over the dry friction."
    lasts = len(plan.command) * 1e-3
    worst = max(plan.half_widths, key=lambda name: plan.half_widths[name])
    found = f"{100.0 * plan.half_widths[worst]:.3g} % of the {parameter(worst, axis).label.lower()}"
    words = (
        f"{lasts:g} s of motion are expected to tell every value within {100.0 * plan.within:g} % (95 %); "
        f"the least closely {found}."
        if plan.passed
        else f"{lasts:g} s of motion are not enough: {found} is told, {100.0 * plan.within:g} % asked."
    )
    expected = "Intervals to be expected, at the design's values"
    blocks = [
        parameter_table(expected, plan.expected, note, axis=axis, more=[share]),
        doc.listing("Motions, in this order", groups, columns),
    ]
    if plan.segments:
        rows = kept_rows([plan.command])
        chart = Chart(width=style.WIDE, height=260.0)
        panel = chart.panel("time, s", f"command at the output, {unit}")
        panel.curve(plan.time_s[rows], plan.command[rows], "command", colour=style.BLUE)
        caption = "Command of all motions, one after the other"
        blocks.append(doc.figure("plan", chart, caption))
    intro = (
        f"Motions from rest to rest, as large as the limits of {plan.design.name} allow in simulation, "
        f"chosen one by one (A-optimal); recorded at 1 kHz with white noise {plan.noise:g} {drive} rms. "
        f"The covariance is that of the fit itself. {NEXT if plan.measured else ''}"
    )
    status: Status = "pass" if plan.passed else "fail"
    return doc.section("plan", "Plan of motions", blocks, result=words, intro=intro.strip(), status=status)
