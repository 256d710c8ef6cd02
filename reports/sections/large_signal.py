"""Large signals: the map, the amplitude Bode, the sawtooth."""

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
from reports.sections.names import Unit, figure_column, output_unit
from reports.verdict_summary import tally


def section(result: LargeSignals) -> doc.Section:
    design, bode = result.design, result.bode
    out = output_unit(design.axis)
    items = _sawtooth_verdicts(result.sawtooth)
    blocks = [doc.verdicts(items, what="checks")] if items else []
    blocks.append(_map_figure(result, out))
    blocks.append(doc.details("How the map is read", [doc.text(CAUSE_RULE), doc.text(CRITERIA)]))
    if result.shift is not None:
        blocks.append(doc.details("The linear limit in numbers", [_shift_table(result.shift, design, out)]))
    blocks.append(_bode_figure(bode, out, design.validation.full_deflection_rad))
    blocks += [_bode_table(bode, out, design), _sawtooth(result.sawtooth, out, design.load_unit)]
    intro = (
        "Each point of the map is one sine command, simulated until steady. Below the lines the linear "
        "model holds. Above them the limit that is reached first determines the output."
    )
    return doc.section(
        "large-signal", "Large signals", blocks, result=_result(bode, out, _linear(design)), intro=intro,
        status=tally(items).role if items else "info", severity="info",
    )  # fmt: skip


def _linear(design: Design) -> str:
    """Which linear response the map is beside: friction by load that changes sign with the motion is out.

    A map of friction has a slope of its own at every speed.
    """
    if design.friction.points:
        return "linear, on the validation's operating motion"
    by_load = design.friction.load_coefficient > 0.0 and bool(design.coupling or design.load.acting())
    return "linear, without friction by load" if by_load else "linear"


def _result(of: AmplitudeBode, out: Unit, model: str = "linear") -> str:
    pairs = zip(of.amplitude_rad, of.fractions, strict=True)
    largest, fraction = max(pairs, default=(math.nan, 0.0))
    place = int(np.argmin(np.abs(of.all_amplitude_rad - largest)))
    part = "full deflection" if fraction == 1.0 else f"{100.0 * fraction:.0f} % of full deflection"
    size, linear = f"{part} ({out.of(largest)})", of.linear_minus3db_hz
    if linear is None or not math.isfinite(linear):
        return "The linear loop has no −3 dB bandwidth in the range of the map."
    value = of.minus3db_hz[place]
    found, falls = f"{value:.3g} Hz", value < linear
    if not math.isfinite(value):
        found, falls = _between(of, place), of.below_from_start[place]
        if not falls:
            return f"The −3 dB bandwidth is {linear:.3g} Hz ({model}); at {size} it is {found}."
    if found == f"{linear:.3g} Hz":
        return f"The −3 dB bandwidth stays at {linear:.3g} Hz up to {size}."
    does = "falls" if falls else "rises"
    return f"The −3 dB bandwidth {does} from {linear:.3g} Hz ({model}) to {found} at {size}."


def _between(of: AmplitudeBode, place: int) -> str:
    low, high = of.minus3db_range_hz[place]
    if of.below_from_start[place]:
        return f"below {high:.3g} Hz"
    if low == 0.0:
        return f"not known: no point {'below it ' if math.isfinite(high) else ''}is steady"
    if not math.isfinite(high):
        return f"above {low:.3g} Hz"
    between = np.any((of.frequency_hz > low) & (of.frequency_hz < high))
    return f"between {low:.3g} and {high:.3g} Hz" + ", the points between are not steady" * bool(between)


def _sawtooth_verdicts(sawtooth: Sawtooth) -> list[doc.VerdictItem]:
    if not (sawtooth.runs and sawtooth.applicable):
        return []
    gain, lag = (max(abs(getattr(r, of)) for r in sawtooth.runs) for of in ("gain_error", "lag_error_deg"))
    items = []
    for key, label, error, limit, of in (
        ("gain", "fundamental from 4/(πx)", gain, GAIN_TOLERANCE, Unit(100.0, "%")),
        ("lag", "lag from arccos(π/2x)", lag, LAG_TOLERANCE_DEG, Unit(1.0, "deg")),
    ):
        found: dict[str, Any] = {"value": of.scale * error, "limit": of.scale * limit, "unit": of.unit}
        id, words = f"validation-sawtooth-{key}", f"Sawtooth: difference of the {label}"
        items.append(doc.verdict(id, words, passed=error <= limit, comparison="<=", **found))
    return items


def _map_figure(result: LargeSignals, out: Unit) -> doc.Block:
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
    return doc.figure("map", map_chart(result, out), caption, alt=alt)


def _shift_table(shift: LimitShift, design: Design, out: Unit) -> doc.Block:
    def percent(k: int) -> float | None:
        same = shift.linear_limiter[k] == shift.simulated_limiter[k]
        return 100.0 * (shift.ratio[k] - 1.0) if same else None

    small = out.column("sig:4")
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
    note += " Its runs take much work: fewer frequencies." * shift.coarser
    note += " Amplitudes behind the profile and filter of the command." * (design.command != Command())
    places = range(len(shift.frequency_hz))
    return doc.listing("Amplitude at which a limit is first reached", places, columns, note)


def _bode_figure(of: AmplitudeBode, out: Unit, full: float) -> doc.Block:
    chart = style.Chart(width=style.WIDE, height=440.0)
    gain, phase = chart.column(1.0, 1.0, width=1.45, title="Output over command")
    for panel, linear, values in ((gain, of.linear_db, of.gain_db), (phase, of.linear_deg, of.phase_deg)):
        panel.curve(of.frequency_hz, linear, "linear", colour=style.MUTED, width=4.2, opacity=0.45)
        for k, (fraction, amplitude) in enumerate(zip(of.fractions, of.amplitude_rad, strict=True)):
            look = {**style.series(k), **style.marked(k, 4.4), "every": 6}
            panel.curve(of.frequency_hz, values[k], f"{100.0 * fraction:g} % ({out.of(amplitude)})", **look)
    style.bound(gain, np.ravel(of.gain_db), span=45.0, top_room=0.12)
    phases = style.known([*np.ravel(of.phase_deg), *of.linear_deg])
    style.phase_axis(phase, [max(v, -360.0) for v in phases])
    gain.rule_y(of.level_db, dash=1)
    phase.rule_y(-90.0, dash=1)
    style.frequency(phase, of.frequency_hz)
    gain.y.label, phase.y.label = "gain of the fundamental, dB", "phase, deg"
    size = f"command amplitude, {out.unit} (dotted: full deflection)"
    panel = chart.panel(size, "frequency, Hz", "xy", title="Bandwidth against amplitude")
    for values, level, label, colour, marker, dash in (
        (of.minus3db_hz, of.linear_minus3db_hz, "−3 dB", style.GREEN, "o", 0),
        (of.minus90deg_hz, of.linear_minus90deg_hz, "−90°", style.PURPLE, "D", 1),
    ):
        look = {"colour": colour, "marker": marker, "size": 5.0, "dash": dash}
        panel.curve(out.scale * of.all_amplitude_rad, values, label, **look)
        if level is not None and math.isfinite(level):
            panel.rule_y(level, f"linear {style.hertz(level)}", seen=True, colour=colour, dash=2)
    panel.rule_x(full * out.scale, dash=2)
    caption = (
        "Fundamental of the output relative to the command at several amplitudes, simulated at no load with "
        "friction and limits. Right: frequencies of −3 dB and −90° against amplitude. Gaps: not steady."
    )
    return doc.figure("amplitude_bode", chart, caption)


def _bode_table(of: AmplitudeBode, out: Unit, design: Design) -> doc.Block:
    columns = [
        doc.column("fraction", "of full deflection", "%", format="sig:3"),
        doc.column("amplitude", "Amplitude", out.unit, format="sig:3"),
        figure_column("bandwidth", "gain", format="sig:3"),
        figure_column("bandwidth_90deg", "phase", format="sig:3"),
        doc.column("note", "Note"),
    ]
    rows: list[tuple[object, ...]] = []
    for fraction, amplitude in zip(of.fractions, of.amplitude_rad, strict=True):
        k = int(np.argmin(np.abs(of.all_amplitude_rad - amplitude)))
        note = "" if math.isfinite(of.minus3db_hz[k]) else f"−3 dB {_between(of, k)}"
        if of.below_from_start[k]:
            note = f"below −3 dB at {of.frequency_hz[0]:.3g} Hz and above"
        rows.append((100.0 * fraction, out.scale * amplitude, of.minus3db_hz[k], of.minus90deg_hz[k], note))
    rows.append((None, None, of.linear_minus3db_hz, of.linear_minus90deg_hz, _linear(design)))
    left_out = sorted({*design.validation.amplitude_fractions} - {*of.fractions})
    shares = ", ".join(f"{100.0 * fraction:g} %" for fraction in left_out)
    note = f"Not on the coarser grid of the map: {shares}." if left_out else ""
    return doc.table("Bandwidth against amplitude", columns, rows, note)


def _sawtooth(sawtooth: Sawtooth, out: Unit, load: str) -> doc.Block:
    if not sawtooth.runs:
        return doc.text(f"Sawtooth: not applicable, {sawtooth.reason}.")
    scale, rate = out.scale, out.per("s")
    limit, rows = scale * sawtooth.rate_limit_rad_s, 3 if sawtooth.has_current else 2
    title = "Sawtooth: a sine faster than the rate limit"
    chart = style.Chart(width=style.WIDE, height=160.0 + 130.0 * rows, title=title)
    highest = 1.15 * scale * max(float(np.abs(run.reference_rad).max()) for run in sawtooth.runs)
    current = max(float(np.abs(run.current_A).max()) for run in sawtooth.runs)
    for run in sawtooth.runs:
        panels = chart.column(1.5, *(1.0,) * (rows - 1), title=f"load {run.load_Nm:g} {load}")
        _sawtooth_column(panels, run, out)
        panels[1].rule_y(limit, colour=style.RED, width=1.1, dash=1)
        words = "rate limit" if run is sawtooth.runs[0] else ""
        panels[1].rule_y(-limit, words, colour=style.RED, width=1.1, dash=1)
        for panel, end in zip(panels, (highest, 1.5 * limit, 1.08 * current), strict=False):
            panel.y.limits(-end, end)
        panels[0].y.limits(high=2.6 * highest)  # room for the words
    turns = sawtooth.reversal_deg < 180.0
    becomes = "the output becomes a sawtooth" if turns else "no sawtooth, as it reverses too slowly"
    caption = (
        f"A sine of {out.of(sawtooth.amplitude_rad)} at {sawtooth.frequency_hz:.3g} Hz, three times "
        f"faster than the rate limit of {short(limit)} {rate.unit}, behind any profile: {becomes}. "
        "Simulated values; in brackets those of an ideal rate limit: peak πR/2w, gain 4/(πx), lag "
        "arccos(π/2x)."
    )
    if moving := [f"{run.load_Nm:g}" for run in sawtooth.runs if not run.steady]:
        caption += f" Not steady at a load of {', '.join(moving)} {load}: still changing by over 1 %."
    if sawtooth.droops:
        slowest = significant(scale * sawtooth.slowest_rad_s)
        caption += f" Not checked: under load the P velocity loop droops to {slowest} {rate.unit}."
    elif not sawtooth.applicable:
        caption += (
            f" Not checked: they need Kv/w ≥ {FAST:g} (here {sawtooth.gain_over_frequency:.3g}) and a "
            f"reversal within {REVERSAL_DEG:g}° of the period (here {sawtooth.reversal_deg:.3g}°)."
        )
    return doc.figure("sawtooth", chart, caption)


def _sawtooth_column(panels: list[style.Panel], run: SawtoothRun, out: Unit) -> None:
    formula, time, scale = run.formula, run.time_s, out.scale
    peak = "–" if formula.peak is None else out.of(formula.peak)
    impure = f"distortion {100.0 * run.distortion:.1f} % (12.1 %)"
    note = (
        f"peak {out.of(run.peak_rad)} ({peak}) · gain {run.gain:.3f} ({formula.gain:.3f})\n"
        f"lag {run.lag_deg:.1f}° ({formula.lag_deg:.1f}°) · {impure}"
    )
    panels[0].curve(time, scale * run.reference_rad, "command", colour=style.MUTED, dash=1)
    panels[0].curve(time, scale * run.output_rad, "output", colour=style.BLUE)
    panels[0].note(note, corner="top left")
    panels[1].curve(time, scale * run.speed_command_rad_s, "speed command", colour=style.MUTED, dash=1)
    panels[1].curve(time, scale * run.output_rate_rad_s, "output rate", colour=style.GREEN)
    panels[0].y.label, panels[1].y.label = f"position, {out.unit}", f"rate, {out.unit}/s"
    if len(panels) > 2:
        panels[2].curve(time, run.current_A, "motor current", colour=style.ORANGE)
        panels[2].y.label = "motor current, A"
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(time[0], time[-1])
