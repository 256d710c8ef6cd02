"""The loops at every operating point of the friction."""

from __future__ import annotations

from collections.abc import Sequence

from actuator_lti.design.model import Design
from analyses.linear.loop_survey import OperatingPointFigures
from reports import document as doc
from reports.document_schema import Row, Section
from reports.sections.margins import evidence_notes, margin_row, response_row
from reports.sections.names import figure_column, load_unit


def section(points: Sequence[OperatingPointFigures], design: Design) -> Section:
    """Make the section; one line an operating point, three figures a loop."""
    names = list(dict.fromkeys(name for point in points for name in point.figures))
    linear = design.axis == "linear"
    columns = [
        doc.column("point", "Operating point"),
        doc.column("load", "Load", load_unit(design), format="short:3"),
        doc.column("slope", "Friction slope", "N s/m" if linear else "mN m s/rad", format="sig:3"),
    ]
    for name in names:
        label = name.capitalize()
        columns += [
            figure_column("phase_margin", f"{name}_phase", label=f"{label} PM", format="fix:1"),
            figure_column("gain_margin", f"{name}_gain", label=f"{label} GM", format="fix:1"),
            figure_column(
                "bandwidth", f"{name}_band", label=f"{label} −3\N{NO-BREAK SPACE}dB", format="sig:3"
            ),
        ]
    rows = [_row(point, 1.0 if linear else 1e3) for point in points]
    note = (
        "Sliding: the dry part is a constant torque and leaves no trace in the loops, whatever the load. "
        "At rest: slope Cv + Tc/w_s of the smoothed law. Speed amplitude W: describing function, "
        "slope Cv + 4 Tc/(π W); Tc = C0 + CM |load|."
    )
    loops = [(f"{point.label}, {name} loop", f) for point in points for name, f in point.figures.items()]
    reasons = list(dict.fromkeys(reason for one in loops for reason in evidence_notes(dict([one]))))
    note += " All margins are certified" + (" but those named below." if reasons else ".")
    blocks = [doc.table("PM: phase margin, GM: gain margin, −3 dB: closed loop", columns, rows, note)]
    blocks += [doc.text(reason) for reason in reasons]
    intro = "The effect of friction on small motions depends on speed and load."
    return doc.section("operating-points", "Operating points", blocks, result=_result(points), intro=intro)


def _result(points: Sequence[OperatingPointFigures]) -> str:
    """Say the smallest phase margin over all operating points."""
    unstable = [_where(point) for point in points if any(f.sound is False for f in point.figures.values())]
    if unstable:
        return f"Unstable at {len(unstable)} of {len(points)} operating points: {'; '.join(unstable)}."
    unknown = [_where(point) for point in points if any(f.sound is None for f in point.figures.values())]
    if unknown:
        count = f"{len(unknown)} of {len(points)} operating points"
        return f"Stability is not known at {count}: {'; '.join(unknown)}."
    result = [
        (row["phase_margin_deg"], name, _where(point))
        for point in points
        for name, figures in point.figures.items()
        if (row := margin_row(figures))["phase_margin_deg"] is not None
    ]
    if not result:
        return f"Stable at all {len(points)} operating points."
    deg, name, label = min(result, key=lambda each: float(each[0]))
    return (
        f"Stable at all {len(points)} operating points; the smallest phase margin is {deg:.1f} deg "
        f"({name} loop, {label})."
    )


def _where(point: OperatingPointFigures) -> str:
    return point.place or point.label


def _row(point: OperatingPointFigures, scale: float) -> Row:
    row: Row = {"point": point.label, "slope": point.slope_Nms_rad * scale}
    row["load"] = "any" if point.load_Nm is None else point.load_Nm
    for name, result in point.figures.items():
        margins, response = margin_row(result), response_row(result)
        row[f"{name}_phase"] = margins["phase_margin_deg"] if result.stable else result.margins.verdict
        row[f"{name}_gain"] = margins["gain_margin_db"]
        row[f"{name}_band"] = response["minus3db_hz"] or None
    if any(result.sound is False for result in point.figures.values()):
        row["_status"] = "fail"
    return row
