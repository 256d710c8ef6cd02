"""Predictions shown in time: the injected sweep, one small step, runs on either side of each margin."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from actuator_lti.asked.verdict import Verdict
from analyses.validation import Validation
from analyses.validation.bench_sweep import BenchSweep
from analyses.validation.in_time import MarginShown, StepShown
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Section, Status
from reports.findings import Finding
from reports.sections import by_amplitude
from reports.sections.names import LOOPS


def sections(validation: Validation) -> list[Section]:
    """Make the section of the sweep and that of steps and margins, as far as there are any."""
    made = []
    if validation.sweeps:
        made.append(_injection(list(validation.sweeps.values())))
    if validation.steps or validation.margins:
        made.append(_in_time(validation))
    return made


def _injection(sweeps: Sequence[BenchSweep]) -> Section:
    """What an analyser on the bench would see of every loop."""
    blocks = [_sweep(sweep) for sweep in sweeps]
    intro = (
        "A sine is added at the break point of the simulated drive, which starts in the steady state of that "
        "sine; fundamentals are correlated over whole periods."
    )
    words = f"Every open loop as an analyser sees it; simulated and linear agree to {_largest(sweeps):.1e}."
    return doc.section("injection", "Frequency response by injection", blocks, result=words, intro=intro)


def _sweep(sweep: BenchSweep) -> Block:
    chart = Chart(width=style.WIDE, height=400.0)
    top, bottom = chart.column(1.1, 1.0)
    phase = np.degrees(np.unwrap(np.angle(sweep.linear)))
    seen = phase + np.degrees(np.angle(sweep.open_loop / sweep.linear))
    for panel, linear, found in (
        (top, 20.0 * np.log10(np.abs(sweep.linear)), 20.0 * np.log10(np.abs(sweep.open_loop))),
        (bottom, phase, seen),
    ):
        panel.curve(sweep.frequency_hz, linear, "linear loop", colour=style.BLUE)
        panel.points(sweep.frequency_hz, found, "simulated", size=5.0, hollow=True, colour=style.ORANGE)
    style.phase_axis(bottom, phase.tolist())
    style.frequency(bottom)
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    caption = f"{LOOPS[sweep.loop]}, open: linear (line), simulated (circles)"
    caption += f"; largest difference {_largest([sweep]):.1e}."
    return doc.figure("injected_sweep", chart, caption)


def _largest(sweeps: Sequence[BenchSweep]) -> float:
    """Largest relative difference of simulated and linear."""
    return float(max(np.nanmax(np.abs(one.open_loop / one.linear - 1.0)) for one in sweeps))


def _in_time(validation: Validation) -> Section:
    """Steps, runs beside the margins, margins by amplitude."""
    blocks: list[Block] = []
    for name in validation.figures:
        if name in validation.steps:
            blocks.append(_step(validation.steps[name]))
        if name in validation.margins:
            blocks.append(_margin(validation.margins[name]))
    blocks += by_amplitude.blocks(validation.amplitude_margins)
    findings = [
        Finding(severity="warn", text=words, where="confirmation")
        for words in by_amplitude.remarks(validation.amplitude_margins)
    ]
    rows = [shown.row for shown in validation.steps.values()]
    rows += [row for shown in validation.margins.values() for row in shown.rows]
    met = sum(row.verdict is Verdict.MET for row in rows)
    status: Status = "pass" if met == len(rows) else "fail"
    intro = (
        "On the operating motion: one small step, sample by sample, and the drive started on its critical "
        "mode 1 % inside and 1 % outside of the gain margin, where it dies out or grows by the predicted "
        "factor."
    )
    result = " ".join([f"{met} of {len(rows)} runs go as predicted.", *(one.text for one in findings[:1])])
    return doc.section(
        "confirmation", "Predictions in time", blocks, result=result, intro=intro, status=status,
        findings=findings,
    )  # fmt: skip


def _step(shown: StepShown) -> Block:
    chart = Chart(width=style.HALF, height=240.0)
    panel = chart.panel(y="response to a unit step")
    scale = style.time_axis(panel, float(shown.time_s[-1]))
    some = slice(None, None, max(1, shown.time_s.size // 400))
    few = slice(None, None, max(1, shown.time_s.size // 40))
    panel.curve(scale * shown.time_s[some], shown.linear[some], "linear", colour=style.BLUE)
    look: style.Style = {"size": 4.5, "hollow": True, "colour": style.ORANGE}
    panel.points(scale * shown.time_s[few], shown.simulated[few], "simulated", **look)
    caption = (
        f"{LOOPS[shown.place]}: small step on the operating motion; largest difference {shown.row.error:.1e} "
        f"of its height, {shown.row.because.split(', of ')[-1]}."
    )
    return doc.figure("small_step", chart, caption, layout="half")


def _margin(shown: MarginShown) -> Block:
    chart = Chart(width=style.HALF, height=240.0)
    panel = chart.panel(y="amplitude of the critical mode")
    scale = style.time_axis(panel, max(float(run.time_s[-1]) for run in (shown.inside, shown.outside)))
    for run, words, k in ((shown.inside, "1 % inside", 0), (shown.outside, "1 % outside", 3)):
        look = style.series(k)
        panel.curve(scale * run.time_s, run.factor ** (run.time_s / run.time_s[-1]), words, **look)
        panel.points(scale * run.time_s, run.amplitude, f"{words}, simulated", **look | {"size": 4.0})
    decibel = 20.0 * math.log10(shown.ratio)
    caption = (
        f"{LOOPS[shown.place]}: gain margin on the operating motion {decibel:.2f} dB at "
        f"{shown.frequency_hz:.4g} Hz. The run inside dies out, the run outside grows (circles), each by the "
        "predicted factor (lines)."
    )
    return doc.figure("margin_runs", chart, caption, layout="half")
