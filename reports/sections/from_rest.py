"""Command to output from rest, where dry friction has no small-signal gain."""

from __future__ import annotations

import numpy as np

from analyses.large_signal.at_rest import RestSweep
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Section
from reports.sections.names import output_unit


def sections(sweep: RestSweep, axis: str) -> list[Section]:
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


def _chart(sweep: RestSweep) -> Chart:
    """Draw magnitude, phase, and how far each line lies from the simulation."""
    chart = Chart(width=style.WIDE, height=500.0)
    top, bottom, off = chart.column(3, 3, 2)
    moves = np.abs(sweep.measured) > 0.0
    points: style.Style = {"colour": style.BLUE, "marker": "o", "size": 6.0, "hollow": True, "line": False}
    lines = {
        "simulated from rest": sweep.measured,
        "sliding loop": sweep.sliding,
        "describing function of dry friction": sweep.described,
    }
    phases = []
    for k, (label, values) in enumerate(lines.items()):
        look = points if k == 0 else style.series(k)
        size = np.abs(values)
        decibel = 20.0 * np.log10(np.where(size > 0.0, size, np.nan))
        phase = np.degrees(np.unwrap(np.angle(values)))
        phases += phase[np.isfinite(phase)].tolist()
        top.curve(sweep.frequency_hz, decibel, label, **look)
        bottom.curve(sweep.frequency_hz, phase, label, **look)
        if k:
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
    return (
        f"The describing function at the simulated speed amplitude differs from the simulation by up to "
        f"{gain:.2g} dB and {phase:.2g} deg."
    )
