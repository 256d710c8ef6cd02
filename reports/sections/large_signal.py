"""Large signals: verdicts on the border, the map, the amplitude Bode, the sawtooth."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from reports import document as doc
from reports.document import abscissa, rounded
from reports.document_schema import Block, Section, Status, VerdictItem
from reports.findings import Finding
from reports.sections.limits import words_of
from reports.sections.names import figure_column

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.large_signal import LargeSignals
    from analyses.large_signal.bode import AmplitudeBode
    from analyses.large_signal.border import BorderCheck
    from analyses.large_signal.map import AmplitudeMap
    from analyses.large_signal.sawtooth import Sawtooth, SawtoothRun
    from reports.figures import amplitude_bode as amplitude_bode_figure
    from reports.figures import map as map_figure
    from reports.figures import sawtooth as sawtooth_figure


def section(result: LargeSignals) -> Section:
    """Make the section from `analyses.large_signal.large_signals`."""
    from analyses.large_signal.classify import CAUSE_RULE, CRITERIA

    design = result.design
    scale, unit = output_unit(design)
    items = [_border_verdict(result.border), *_sawtooth_verdicts(result.sawtooth)]
    rules = doc.details("How the map is read", [doc.text(words) for words in (CAUSE_RULE, CRITERIA)])
    blocks = [doc.verdicts(items, what="checks"), _map_figure(result, scale, unit), rules]
    if result.border is not None and np.isfinite(result.border.predicted_rad).any():
        blocks.append(doc.details("The border in numbers", [_border_table(result, scale, unit)]))
    blocks += [_bode_figure(result.bode, scale, unit, design.validation.full_deflection_rad)]
    blocks += [_bode_table(result.bode, scale, unit), *_sawtooth_blocks(result.sawtooth, design, scale, unit)]
    failed = any(item["passed"] is False for item in items)
    intro = (
        "Each point of the map is one sine command, simulated until steady. Below the lines the linear model "
        "holds. "
        "Above them the limit that is reached first determines the output."
    )
    words = _result(result.bode, scale, unit)
    findings = [Finding(severity="info", text=words, where="large-signal")]
    status: Status = "fail" if failed else "pass"
    return doc.section(
        "large-signal", "Large signals", blocks, result=words, intro=intro, status=status, findings=findings
    )


def _result(amplitude_bode: AmplitudeBode, scale: float, unit: str) -> str:
    """Say how far the bandwidth falls with the amplitude."""
    largest, fraction = max(
        zip(amplitude_bode.amplitude_rad, amplitude_bode.fractions, strict=True), default=(math.nan, 0.0)
    )
    place = int(np.argmin(np.abs(amplitude_bode.all_amplitude_rad - largest)))
    part = "full deflection" if fraction == 1.0 else f"{100.0 * fraction:.0f} % of full deflection"
    size, linear = f"{part} ({scale * largest:.3g} {unit})", amplitude_bode.linear_minus3db_hz
    if linear is None or not math.isfinite(linear):
        return "The linear loop has no −3 dB bandwidth in the range of the map."
    value = amplitude_bode.minus3db_hz[place]
    if not math.isfinite(value):
        found = _between(amplitude_bode, place)
        if amplitude_bode.below_from_start[place]:
            return f"The −3 dB bandwidth falls from {linear:.3g} Hz (linear) to {found} at {size}."
        return f"The −3 dB bandwidth is {linear:.3g} Hz (linear); at {size} it is {found}."
    if f"{value:.3g}" == f"{linear:.3g}":
        return f"The −3 dB bandwidth stays at {linear:.3g} Hz up to {size}."
    does = "falls" if value < linear else "rises"
    return f"The −3 dB bandwidth {does} from {linear:.3g} Hz (linear) to {value:.3g} Hz at {size}."


def _between(amplitude_bode: AmplitudeBode, place: int) -> str:
    """Say as much of a bandwidth as the steady points tell."""
    low, high = amplitude_bode.minus3db_range_hz[place]
    if amplitude_bode.below_from_start[place]:
        return f"below {high:.3g} Hz"
    if low == 0.0:
        return (
            "not known: no point below it is steady"
            if math.isfinite(high)
            else "not known: no point is steady"
        )
    hz = amplitude_bode.frequency_hz
    unsteady = ", the points between are not steady" if np.any((hz > low) & (hz < high)) else ""
    return f"between {low:.3g} and {high:.3g} Hz{unsteady}" if math.isfinite(high) else f"above {low:.3g} Hz"


def output_unit(design: Design) -> tuple[float, str]:
    """Scale and unit of an output position: degrees, or millimetres on a linear axis."""
    return (1e3, "mm") if design.axis == "linear" else (math.degrees(1.0), "deg")


def load_unit(design: Design) -> str:
    """Unit of the load at the output."""
    return "N" if design.axis == "linear" else "N m"


def _border_verdict(border: BorderCheck | None) -> VerdictItem:
    """Judge the simulated border against the smallest A_k."""
    from analyses.large_signal.border import TOLERANCE

    what = {
        "id": "validation-border",
        "label": "Onset of saturation: difference between simulation and linear model, friction off",
    }
    common: dict[str, Any] = {**what, "limit": 100.0 * TOLERANCE, "unit": "%", "comparison": "<="}
    if border is None:
        return doc.verdict(**common, value=None, distance=None, passed=None, reason="the loop is unstable")
    error = border.largest_error
    if error is None:
        reason = "the design has no limit"
        return doc.verdict(**common, value=None, distance=None, passed=None, reason=reason)
    same, count = sum(border.same_limiter), len(border.same_limiter)
    reason = f"largest of {count} frequencies; the predicted limiter acts at {same} of {count}"
    reason += f"; without {border.left_out}" if border.left_out else ""
    reason += f"; not judged: {border.reason}" if border.reason else ""
    distance = 100.0 * (TOLERANCE - error)
    return doc.verdict(**common, value=100.0 * error, distance=distance, passed=border.passed, reason=reason)


def _sawtooth_verdicts(sawtooth: Sawtooth) -> list[VerdictItem]:
    """Judge the rate-limit formulas, or say why they do not apply."""
    from analyses.large_signal.sawtooth import GAIN_TOLERANCE, LAG_TOLERANCE_DEG

    gain = max((abs(run.gain_error) for run in sawtooth.runs), default=None)
    lag = max((abs(run.lag_error_deg) for run in sawtooth.runs), default=None)
    reason = sawtooth.reason
    if sawtooth.runs and not sawtooth.applicable:
        reason = (
            f"the formulas need Kv/w >= 50 (here {sawtooth.gain_over_frequency:.3g}) and a reversal "
            f"within 1° of the period (here {sawtooth.reversal_deg:.3g}°); shown, not judged"
        )
    rows = (
        ("gain", "Sawtooth: difference of the fundamental from 4/(πx)", gain, GAIN_TOLERANCE, 100.0, "%"),
        ("lag", "Sawtooth: difference of the lag from arccos(π/2x)", lag, LAG_TOLERANCE_DEG, 1.0, "deg"),
    )
    return [
        doc.verdict(
            f"validation-sawtooth-{key}",
            label,
            value=None if error is None else scale * error,
            limit=scale * limit,
            unit=unit,
            comparison="<=",
            distance=None if error is None or not sawtooth.applicable else scale * (limit - error),
            passed=None if sawtooth.passed is None or error is None else error <= limit,
            reason=reason,
        )
        for key, label, error, limit, scale, unit in rows
    ]


def _map_figure(result: LargeSignals, scale: float, unit: str) -> Block:
    """Make the map with the linear onset lines and the simulated border."""
    from analyses.large_signal.classify import CAUSES, WAVEFORMS

    shown, design = result.map, result.design
    points: list[map_figure.Points] = [
        {
            "label": words,
            "frequency_hz": abscissa(check.frequency_hz),
            "amplitude": rounded(scale * check.simulated_rad),
        }
        for words, check in (
            ("simulated, friction off", result.border),
            ("simulated, friction on", result.border_with_friction),
        )
        if check is not None and np.isfinite(check.simulated_rad).any()
    ]
    onset: list[map_figure.Onset] = [
        {"name": name, "label": words_of(name), "amplitude": rounded(scale * np.asarray(values), 4)}
        for name, values in shown.onset_rad.items()
        if np.isfinite(values).any()
    ]
    full = design.validation.full_deflection_rad
    data: map_figure.Data = {
        "frequency_hz": abscissa(shown.frequency_hz),
        "amplitude": abscissa(scale * shown.amplitude_rad),
        "causes": list(CAUSES),
        "waveforms": list(WAVEFORMS),
        "cause": shown.cause.tolist(),
        "waveform": shown.waveform.tolist(),
        "onset": onset,
        "points": points,
        "marks": [{"amplitude": full * scale, "label": "full\ndeflection"}],
        "unit": unit,
    }
    caption = (
        "What limits a sine command, at no load, with friction. Colour: limit that acts longest. Marks: "
        "waveform "
        "of the output; a sine has none. Lines: amplitude at which the linear loop reaches each limit. "
        "Diamonds "
        "and triangles: where the simulation first reaches it."
    )
    if shown.coarser:
        points_shown = f"{shown.amplitude_rad.size} amplitudes by {shown.frequency_hz.size} frequencies"
        caption += f" The drive settles slowly: a coarser grid, {points_shown}."
    return doc.figure("map", data, caption=caption, alt=_map_words(shown))


def _map_words(amplitude_map: AmplitudeMap) -> str:
    """Say in words what the map shows."""
    from analyses.large_signal.classify import CAUSES

    shares = {name: amplitude_map.share((name,)) for name in CAUSES}
    parts = [f"{name} {share:.0%}" for name, share in shares.items() if share > 0.0]
    return "Map of amplitude and frequency; share of the points by what acts: " + ", ".join(parts)


def _border_table(result: LargeSignals, scale: float, unit: str) -> Block:
    """List the border frequency by frequency."""
    border, shifted = result.border, result.border_with_friction
    assert border is not None
    columns = [
        doc.column("hz", "Frequency", "Hz", format="sig:3"),
        doc.column("predicted", "Smallest A_k", unit, format="sig:4"),
        doc.column("simulated", "Simulated, friction off", unit, format="sig:4"),
        doc.column("error", "Difference", "%", format="fix:3"),
        doc.column("limiter", "Predicted limiter"),
        doc.column("acts", "Acting limiter"),
    ]
    if shifted is not None:
        columns.append(doc.column("shift", "Shift by friction", "%", format="fix:2"))
    rows = []
    for k, hz in enumerate(border.frequency_hz):
        row = {
            "hz": hz,
            "predicted": scale * border.predicted_rad[k],
            "simulated": scale * border.simulated_rad[k],
            "error": 100.0 * (border.ratio[k] - 1.0),
            "limiter": words_of(border.predicted_limiter[k]),
            "acts": words_of(border.simulated_limiter[k]),
        }
        if shifted is not None:
            row["shift"] = 100.0 * (shifted.ratio[k] - 1.0)
        rows.append(row)
    note = "The shift by friction is shown, not judged."
    return doc.table("Amplitude at which a limit is first reached", columns, rows, note)


def _bode_figure(amplitude_bode: AmplitudeBode, scale: float, unit: str, full: float) -> Block:
    """Make the amplitude Bode."""
    series: list[amplitude_bode_figure.Series] = [
        {
            "label": f"{100.0 * fraction:g} % ({scale * amplitude:.3g} {unit})",
            "gain_db": rounded(amplitude_bode.gain_db[k], 4),
            "phase_deg": rounded(amplitude_bode.phase_deg[k], 4),
        }
        for k, (fraction, amplitude) in enumerate(
            zip(amplitude_bode.fractions, amplitude_bode.amplitude_rad, strict=True)
        )
    ]
    data: amplitude_bode_figure.Data = {
        "frequency_hz": abscissa(amplitude_bode.frequency_hz),
        "series": series,
        "linear": {
            "gain_db": rounded(amplitude_bode.linear_db, 4),
            "phase_deg": rounded(amplitude_bode.linear_deg, 4),
        },
        "against": {
            "amplitude": abscissa(scale * amplitude_bode.all_amplitude_rad),
            "minus3db_hz": rounded(amplitude_bode.minus3db_hz),
            "minus90deg_hz": rounded(amplitude_bode.minus90deg_hz),
            "linear_minus3db_hz": amplitude_bode.linear_minus3db_hz,
            "linear_minus90deg_hz": amplitude_bode.linear_minus90deg_hz,
            "unit": unit,
            "full": full * scale,
        },
    }
    caption = (
        "Fundamental of the output relative to the command at several amplitudes, simulated at no load with "
        "friction "
        "and limits. Right: frequencies of −3 dB and −90° against amplitude. Gaps: not steady."
    )
    return doc.figure("amplitude_bode", data, caption=caption, alt=caption)


def _bode_table(amplitude_bode: AmplitudeBode, scale: float, unit: str) -> Block:
    """List both bandwidths at the design's amplitudes."""
    columns = [
        doc.column("fraction", "of full deflection", "%", format="sig:3"),
        doc.column("amplitude", "Amplitude", unit, format="sig:3"),
        figure_column("bandwidth", "gain", format="sig:3"),
        figure_column("bandwidth_90deg", "phase", format="sig:3"),
        doc.column("note", "Note"),
    ]
    rows = []
    for fraction, amplitude in zip(amplitude_bode.fractions, amplitude_bode.amplitude_rad, strict=True):
        k = int(np.argmin(np.abs(amplitude_bode.all_amplitude_rad - amplitude)))
        below, known = bool(amplitude_bode.below_from_start[k]), math.isfinite(amplitude_bode.minus3db_hz[k])
        note = f"below −3 dB at {amplitude_bode.frequency_hz[0]:.3g} Hz and above" if below else ""
        if not (below or known):
            note = f"−3 dB {_between(amplitude_bode, k)}"
        rows.append(
            {
                "fraction": 100.0 * fraction,
                "amplitude": scale * amplitude,
                "gain": amplitude_bode.minus3db_hz[k],
                "phase": amplitude_bode.minus90deg_hz[k],
                "note": note,
            }
        )
    rows.append(
        {
            "fraction": None,
            "amplitude": None,
            "gain": amplitude_bode.linear_minus3db_hz,
            "phase": amplitude_bode.linear_minus90deg_hz,
            "note": "linear loop, interpolated on the same grid",
        }
    )
    return doc.table("Bandwidth against amplitude", columns, rows)


def _sawtooth_blocks(sawtooth: Sawtooth, design: Design, scale: float, unit: str) -> list[Block]:
    """Make the sawtooth, or say why there is none."""
    if not sawtooth.runs:
        return [doc.text(f"Sawtooth: not applicable, {sawtooth.reason}.")]
    limit = scale * sawtooth.rate_limit_rad_s
    data: sawtooth_figure.Data = {
        "columns": [_sawtooth_column(run, sawtooth, scale, unit, load_unit(design)) for run in sawtooth.runs],
        "rate_limit": limit,
        "unit": unit,
        "rate_unit": f"{unit}/s",
    }
    caption = (
        f"A sine of {scale * sawtooth.amplitude_rad:.3g} {unit} at {sawtooth.frequency_hz:.3g} Hz, three "
        f"times faster than the rate limit of {limit:.3g} {unit}/s: the output becomes a sawtooth. Simulated "
        "values; in brackets those of an ideal rate limit: peak πR/2w, gain 4/(πx), lag arccos(π/2x)."
    )
    return [doc.figure("sawtooth", data, caption=caption, alt=caption)]


def _sawtooth_column(
    run: SawtoothRun, sawtooth: Sawtooth, scale: float, unit: str, load: str
) -> sawtooth_figure.Load:
    """Give the traces at one load."""
    formula = run.formula
    peak = "–" if formula.peak is None else f"{scale * formula.peak:.3g} {unit}"
    impure = f"distortion {100.0 * run.distortion:.1f} % (12.1 %)"
    note = (
        f"peak {scale * run.peak_rad:.3g} {unit} ({peak}) · gain {run.gain:.3f} ({formula.gain:.3f})\n"
        f"lag {run.lag_deg:.1f}° ({formula.lag_deg:.1f}°) · {impure}"
    )
    return {
        "title": f"load {run.load_Nm:g} {load}",
        "time_s": abscissa(run.time_s),
        "reference": abscissa(scale * run.reference_rad, 4),
        "output": rounded(scale * run.output_rad, 4),
        "rate": rounded(scale * run.output_rate_rad_s, 4),
        "command_rate": rounded(scale * run.speed_command_rad_s, 4),
        "current": rounded(run.current_A, 4) if sawtooth.has_current else None,
        "note": note,
    }
