"""Residuals of an identification: tests named as in system identification, and their pictures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analyses.identification.joint_model import JointModel, RecordFit
from analyses.identification.residuals import ResidualTest
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block
from reports.sections.thinning import kept_rows


def blocks(model: JointModel, tests: Sequence[ResidualTest], axis: str) -> list[Block]:
    """The tests of all records, and four pictures of each; those of further records on demand."""
    made = [figure for part in model.records for figure in _figures(part, tests, axis)]
    each = len(made) // len(model.records)
    more = [doc.details("Residuals of the other records", made[each:])] if made[each:] else []
    return [_table(tests), *made[:each], *more]


def _table(tests: Sequence[ResidualTest]) -> Block:
    columns = [
        doc.of("record", "record", "Record"),
        doc.of("name", "name", "Test"),
        doc.of("input", "input", "Input"),
        doc.of("largest", "largest", "Largest correlation", format="fix:3"),
        doc.of("lag", "lag", "at lag", "rows", format="int"),
        doc.of("bound", "bound", "Bound (99 %)", format="fix:3"),
        doc.of("within", "within", "Within", format="yesno"),
    ]
    note = (
        "Whiteness: autocorrelation of the innovations (the residual through its autoregressive model); "
        "independence: their cross-correlation with an input that passed the same filter. Beyond the bound "
        "something is not modelled, and the truth need not lie in the intervals. What the simulated record "
        "leaves too is taken off first."
    )
    return doc.listing(
        "Residual tests", tests, columns, note, status=lambda one: "pass" if one.within else "warn"
    )


def _figures(part: RecordFit, tests: Sequence[ResidualTest], axis: str) -> list[Block]:
    own = [test for test in tests if test.record == part.name]
    unit, rate = ("N", "m/s") if axis == "linear" else ("N m", "rad/s")
    return [
        _figure("time", _over_time(part, unit), f"{part.name}: residual over time, and its spectrum"),
        _figure("correlation", _correlation(own), f"{part.name}: correlations of the residual, with bounds"),
        _figure("friction", _friction(part, unit, rate), f"{part.name}: friction over speed, rows and model"),
    ]


def _figure(name: str, chart: Chart, caption: str) -> Block:
    return doc.figure(f"residual_{name}", chart, caption)


def _over_time(part: RecordFit, unit: str) -> Chart:
    from scipy.signal import welch

    chart = Chart(width=style.WIDE, height=300.0)
    left = chart.panel("time in the rows used, s", f"residual, {unit}")
    right = chart.panel("frequency, Hz", f"{unit}/√Hz", "xy")
    time = part.step_s * np.flatnonzero(part.keep)
    rows = kept_rows([part.residual])
    left.rule_y(0.0)
    left.curve(time[rows], part.residual[rows], "residual", colour=style.BLUE, width=1.1)
    hertz, power = welch(part.residual, 1.0 / part.step_s, nperseg=min(256, len(part.residual)))
    right.curve(hertz[1:], np.sqrt(power[1:]), "amplitude density of the residual", colour=style.BLUE)
    return chart


def _correlation(tests: Sequence[ResidualTest]) -> Chart:
    chart = Chart(width=style.WIDE, height=130.0 * max(len(tests), 1))
    for panel, test in zip(chart.column(*(1.0 for _ in tests)) if tests else (), tests, strict=True):
        panel.band_y(-test.bound, test.bound)
        panel.rule_y(0.0)
        panel.points(test.lags, test.correlation, size=4.0, colour=style.BLUE)
        panel.y.label = test.input or test.name
        panel.x.label = "lag, rows"
    return chart


def _friction(part: RecordFit, unit: str, rate: str) -> Chart:
    chart = Chart(width=style.WIDE, height=320.0)
    panel = chart.panel(f"speed, {rate}", f"friction, {unit}", by_point=True)
    few = slice(None, None, max(1, len(part.speed) // 1500))
    order = np.argsort(part.speed)
    line = order[kept_rows([(part.friction - part.residual)[order]])]
    panel.points(part.speed[few], part.friction[few], "rows of the record", size=3.0, colour=style.BLUE)
    panel.curve(part.speed[line], (part.friction - part.residual)[line], "model", colour=style.ORANGE)
    return chart
