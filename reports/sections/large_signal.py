"""Large signals: the map, the amplitude Bode, the sawtooth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from actuator_lti.design.model import Command, Design
from analyses.large_signal.classify import CAUSE_RULE, CAUSES, CRITERIA
from analyses.large_signal.map import AmplitudeBode
from analyses.large_signal.result import LargeSignals, LimitShift
from analyses.large_signal.sawtooth import (
    FAST,
    GAIN_TOLERANCE,
    LAG_TOLERANCE_DEG,
    REVERSAL_DEG,
    Sawtooth,
    SawtoothRun,
)
from reports import document as doc
from reports.charts import style
from reports.numbers import short, significant
from reports.sections.limits import map_chart, words_of
from reports.sections.names import figure_column, load_unit, output_unit
from reports.verdict_summary import tally


def section(result: LargeSignals) -> doc.Section:
    design = result.design
    scale, unit = output_unit(design.axis)
    items = _sawtooth_verdicts(result.sawtooth)
    blocks = [doc.verdicts(items, what="checks")] if items else []
    blocks.append(_map_figure(result, scale, unit))
    blocks.append(doc.details("How the map is read", [doc.text(CAUSE_RULE), doc.text(CRITERIA)]))
    if result.shift is not None:
        table = _shift_table(result.shift, design, scale, unit)
        blocks.append(doc.details("The linear limit in numbers", [table]))
    blocks.append(_bode_figure(result.bode, scale, unit, design.validation.full_deflection_rad))
    blocks.append(_bode_table(result.bode, scale, unit, design))
    blocks += _sawtooth_blocks(result.sawtooth, design, scale, unit)
    intro = (
        "Each point of the map is one sine command, simulated until steady. Below the lines the linear "
        "model holds. Above them the limit that is reached first determines the output."
    )
    return doc.section(
        "large-signal", "Large signals", blocks, result=_result(result.bode, scale, unit, _linear(design)),
        intro=intro, status=tally(items).role if items else "info", told="info",
    )  # fmt: skip


def _linear(design: Design) -> str:
    """Which linear response the map is beside: friction by load that changes sign with the motion is out.

    A map of friction has a slope of its own at every speed.
    """
    if design.friction.points:
        return "linear, on the validation's operating motion"
    by_load = design.friction.load_coefficient > 0.0 and bool(design.coupling or design.load.acting())
    return "linear, without friction by load" if by_load else "linear"


def _result(amplitude_bode: AmplitudeBode, scale: float, unit: str, model: str = "linear") -> str:
    largest, fraction = max(
        zip(amplitude_bode.amplitude_rad, amplitude_bode.fractions, strict=True), default=(math.nan, 0.0)
    )
    place = int(np.argmin(np.abs(amplitude_bode.all_amplitude_rad - largest)))
    part = "full deflection" if fraction == 1.0 else f"{100.0 * fraction:.0f} % of full deflection"
    size, linear = f"{part} ({scale * largest:.3g} {unit})", amplitude_bode.linear_minus3db_hz
    if linear is None or not math.isfinite(linear):
        return "The linear loop has no −3 dB bandwidth in the range of the map."
    value = amplitude_bode.minus3db_hz[place]
    found, falls = f"{value:.3g} Hz", value < linear
    if not math.isfinite(value):
        found, falls = _between(amplitude_bode, place), amplitude_bode.below_from_start[place]
        if not falls:
            return f"The −3 dB bandwidth is {linear:.3g} Hz ({model}); at {size} it is {found}."
    if found == f"{linear:.3g} Hz":
        return f"The −3 dB bandwidth stays at {linear:.3g} Hz up to {size}."
    does = "falls" if falls else "rises"
    return f"The −3 dB bandwidth {does} from {linear:.3g} Hz ({model}) to {found} at {size}."


def _between(amplitude_bode: AmplitudeBode, place: int) -> str:
    low, high = amplitude_bode.minus3db_range_hz[place]
    if amplitude_bode.below_from_start[place]:
        return f"below {high:.3g} Hz"
    if low == 0.0:
        return f"not known: no point {'below it ' if math.isfinite(high) else ''}is steady"
    hz = amplitude_bode.frequency_hz
    unsteady = ", the points between are not steady" if np.any((hz > low) & (hz < high)) else ""
    return f"between {low:.3g} and {high:.3g} Hz{unsteady}" if math.isfinite(high) else f"above {low:.3g} Hz"


def _sawtooth_verdicts(sawtooth: Sawtooth) -> list[doc.VerdictItem]:
    if not (sawtooth.runs and sawtooth.applicable):
        return []

    def judged(key: str, label: str, error: float, limit: float, unit: str) -> doc.VerdictItem:
        label, scale = f"Sawtooth: difference of the {label}", 100.0 if unit == "%" else 1.0
        return doc.verdict(
            f"validation-sawtooth-{key}", label, value=scale * error, limit=scale * limit, unit=unit,
            comparison="<=", passed=error <= limit,
        )  # fmt: skip

    gain = max(abs(run.gain_error) for run in sawtooth.runs)
    lag = max(abs(run.lag_error_deg) for run in sawtooth.runs)
    return [
        judged("gain", "fundamental from 4/(πx)", gain, GAIN_TOLERANCE, "%"),
        judged("lag", "lag from arccos(π/2x)", lag, LAG_TOLERANCE_DEG, "deg"),
    ]


def _map_figure(result: LargeSignals, scale: float, unit: str) -> doc.Block:
    caption = (
        "What limits a sine command, at no load, with friction. Colour: limit that acts longest. Marks: "
        "waveform of the output; a sine has none. Lines: amplitude at which the linear loop reaches each "
        "limit. Diamonds: where the simulation with friction first reaches one."
    )
    if result.design.command != Command():
        caption += " Simulated behind the profile and filter of the command, drawn in front of them."
    shown = result.map
    caption += f" {shown.amplitude_rad.size} amplitudes by {shown.frequency_hz.size} frequencies"
    caption += ": its runs take much work, a coarser grid." if shown.coarser else "."
    parts = [f"{name} {100 * share:.0f} %" for name in CAUSES if (share := shown.share(name)) > 0.0]
    alt = f"Map of amplitude and frequency; share of the points by what acts: {', '.join(parts)}"
    return doc.figure("map", map_chart(result, scale, unit), caption, alt=alt)


def _shift_table(shift: LimitShift, design: Design, scale: float, unit: str) -> doc.Block:
    """List the linear limit and what friction makes of it, frequency by frequency."""
    small: dict[str, Any] = {"unit": unit, "scale": scale, "format": "sig:4"}

    def percent(k: int) -> float | None:
        same = shift.linear_limiter[k] == shift.simulated_limiter[k]
        return 100.0 * (shift.ratio[k] - 1.0) if same else None

    columns = [
        doc.of(lambda k: shift.frequency_hz[k], "hz", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda k: shift.linear_rad[k], "linear", "Predicted", **small),
        doc.of(lambda k: shift.simulated_rad[k], "simulated", "Simulated, with friction", **small),
        doc.of(percent, "shift", "Shift by friction", "%", format="fix:2"),
        doc.of(lambda k: words_of(shift.linear_limiter[k]), "limiter", "Predicted limiter"),
        doc.of(lambda k: words_of(shift.simulated_limiter[k]), "acts", "Acting limiter"),
    ]
    note = "The shift by friction is shown, not judged; there is none where another limit acts first."
    if words_of("overload") in map(words_of, shift.linear_limiter):
        note += " The overload protection takes longer to act than these runs last."
    if shift.coarser:
        note += " Its runs take much work: fewer frequencies."
    if design.command != Command():
        note += " Amplitudes behind the profile and filter of the command."
    places = range(len(shift.frequency_hz))
    return doc.listing("Amplitude at which a limit is first reached", places, columns, note)


def _bode_figure(amplitude_bode: AmplitudeBode, scale: float, unit: str, full: float) -> doc.Block:
    chart = style.Chart(width=style.WIDE, height=440.0)
    gain, phase = chart.column(1.0, 1.0, width=1.45, title="Output over command")
    sizes = zip(amplitude_bode.fractions, amplitude_bode.amplitude_rad, strict=True)
    labels = [f"{100.0 * fraction:g} % ({scale * amplitude:.3g} {unit})" for fraction, amplitude in sizes]
    for panel, linear, values in (
        (gain, amplitude_bode.linear_db, amplitude_bode.gain_db),
        (phase, amplitude_bode.linear_deg, amplitude_bode.phase_deg),
    ):
        look: style.Style = {"colour": style.MUTED, "width": 4.2, "opacity": 0.45}
        panel.curve(amplitude_bode.frequency_hz, linear, "linear", **look)
        for k, label in enumerate(labels):
            look = {**style.series(k), **style.marked(k, 4.4), "every": 6}
            panel.curve(amplitude_bode.frequency_hz, values[k], label, **look)
    style.bound(gain, np.ravel(amplitude_bode.gain_db), span=45.0, top_room=0.12)
    phases = style.known([*np.ravel(amplitude_bode.phase_deg), *amplitude_bode.linear_deg])
    style.phase_axis(phase, [max(v, -360.0) for v in phases])
    gain.rule_y(amplitude_bode.level_db, dash=1)
    phase.rule_y(-90.0, dash=1)
    style.frequency(phase, amplitude_bode.frequency_hz)
    gain.y.label, phase.y.label = "gain of the fundamental, dB", "phase, deg"
    size = f"command amplitude, {unit} (dotted: full deflection)"
    panel = chart.panel(size, "frequency, Hz", "xy", title="Bandwidth against amplitude")
    _bandwidths(panel, amplitude_bode, scale, full)
    caption = (
        "Fundamental of the output relative to the command at several amplitudes, simulated at no load with "
        "friction and limits. Right: frequencies of −3 dB and −90° against amplitude. Gaps: not steady."
    )
    return doc.figure("amplitude_bode", chart, caption)


def _bandwidths(panel: style.Panel, result: AmplitudeBode, scale: float, full: float) -> None:
    for values, level, label, colour, marker, dash in (
        (result.minus3db_hz, result.linear_minus3db_hz, "−3 dB", style.GREEN, "o", 0),
        (result.minus90deg_hz, result.linear_minus90deg_hz, "−90°", style.PURPLE, "D", 1),
    ):
        sizes = scale * result.all_amplitude_rad
        panel.curve(sizes, values, label, colour=colour, marker=marker, size=5.0, dash=dash)
        if level is not None and math.isfinite(level):
            panel.rule_y(level, f"linear {style.hertz(level)}", seen=True, colour=colour, dash=2)
    panel.rule_x(full * scale, dash=2)


def _bode_table(amplitude_bode: AmplitudeBode, scale: float, unit: str, design: Design) -> doc.Block:
    columns = [
        doc.column("fraction", "of full deflection", "%", format="sig:3"),
        doc.column("amplitude", "Amplitude", unit, format="sig:3"),
        figure_column("bandwidth", "gain", format="sig:3"),
        figure_column("bandwidth_90deg", "phase", format="sig:3"),
        doc.column("note", "Note"),
    ]
    rows: list[tuple[object, ...]] = []
    of = amplitude_bode
    for fraction, amplitude in zip(of.fractions, of.amplitude_rad, strict=True):
        k = int(np.argmin(np.abs(of.all_amplitude_rad - amplitude)))
        note = "" if math.isfinite(of.minus3db_hz[k]) else f"−3 dB {_between(of, k)}"
        if of.below_from_start[k]:
            note = f"below −3 dB at {of.frequency_hz[0]:.3g} Hz and above"
        rows.append((100.0 * fraction, scale * amplitude, of.minus3db_hz[k], of.minus90deg_hz[k], note))
    rows.append((None, None, of.linear_minus3db_hz, of.linear_minus90deg_hz, _linear(design)))
    left_out = sorted({*design.validation.amplitude_fractions} - {*amplitude_bode.fractions})
    shares = ", ".join(f"{100.0 * fraction:g} %" for fraction in left_out)
    note = f"Not on the coarser grid of the map: {shares}." if left_out else ""
    return doc.table("Bandwidth against amplitude", columns, rows, note)


def _sawtooth_blocks(sawtooth: Sawtooth, design: Design, scale: float, unit: str) -> list[doc.Block]:
    if not sawtooth.runs:
        return [doc.text(f"Sawtooth: not applicable, {sawtooth.reason}.")]
    limit = scale * sawtooth.rate_limit_rad_s
    rows = 3 if sawtooth.has_current else 2
    title = "Sawtooth: a sine faster than the rate limit"
    chart = style.Chart(width=style.WIDE, height=160.0 + 130.0 * rows, title=title)
    highest = 1.15 * scale * max(float(np.abs(run.reference_rad).max()) for run in sawtooth.runs)
    current = max(float(np.abs(run.current_A).max()) for run in sawtooth.runs)
    for run in sawtooth.runs:
        head = f"load {run.load_Nm:g} {load_unit(design)}"
        panels = chart.column(1.5, *(1.0,) * (rows - 1), title=head)
        _sawtooth_column(panels, run, scale, unit)
        panels[1].rule_y(limit, colour=style.RED, width=1.1, dash=1)
        words = "rate limit" if run is sawtooth.runs[0] else ""
        panels[1].rule_y(-limit, words, colour=style.RED, width=1.1, dash=1)
        for panel, end in zip(panels, (highest, 1.5 * limit, 1.08 * current), strict=False):
            panel.y.limits(-end, end)
        panels[0].y.limits(high=2.6 * highest)  # room for the words
    caption = (
        f"A sine of {scale * sawtooth.amplitude_rad:.3g} {unit} at {sawtooth.frequency_hz:.3g} Hz, three "
        f"times faster than the rate limit of {short(limit)} {unit}/s: the output becomes a sawtooth. "
        "Simulated values; in brackets those of an ideal rate limit: peak πR/2w, gain 4/(πx), lag "
        "arccos(π/2x)."
    )
    if sawtooth.droops:
        slowest = significant(scale * sawtooth.slowest_rad_s)
        caption += f" Not checked: under load the P velocity loop droops to {slowest} {unit}/s."
    elif not sawtooth.applicable:
        caption += (
            f" Not checked: they need Kv/w ≥ {FAST:g} (here {sawtooth.gain_over_frequency:.3g}) and a "
            f"reversal within {REVERSAL_DEG:g}° of the period (here {sawtooth.reversal_deg:.3g}°)."
        )
    return [doc.figure("sawtooth", chart, caption)]


def _sawtooth_column(panels: list[style.Panel], run: SawtoothRun, scale: float, unit: str) -> None:
    """Draw the motion at one load, on panels of position, rate and (where there is one) current."""
    formula, time = run.formula, run.time_s
    peak = "–" if formula.peak is None else f"{scale * formula.peak:.3g} {unit}"
    impure = f"distortion {100.0 * run.distortion:.1f} % (12.1 %)"
    note = (
        f"peak {scale * run.peak_rad:.3g} {unit} ({peak}) · gain {run.gain:.3f} ({formula.gain:.3f})\n"
        f"lag {run.lag_deg:.1f}° ({formula.lag_deg:.1f}°) · {impure}"
    )
    panels[0].curve(time, scale * run.reference_rad, "command", colour=style.MUTED, dash=1)
    panels[0].curve(time, scale * run.output_rad, "output", colour=style.BLUE)
    panels[0].y.label = f"position, {unit}"
    panels[0].note(note, corner="top left")
    panels[1].curve(time, scale * run.speed_command_rad_s, "speed command", colour=style.MUTED, dash=1)
    panels[1].curve(time, scale * run.output_rate_rad_s, "output rate", colour=style.GREEN)
    panels[1].y.label = f"rate, {unit}/s"
    if len(panels) > 2:
        panels[2].curve(time, run.current_A, "motor current", colour=style.ORANGE)
        panels[2].y.label = "motor current, A"
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(time[0], time[-1])
