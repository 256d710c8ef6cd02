"""One loop: open and closed loop over frequency, Nyquist, S and T, step."""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.asked.quantities import AT_A_GLANCE
from actuator_lti.design.model import Design
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.responses import (
    answer_curve,
    curve,
    frequency_grid,
    nyquist_curve,
    response_at,
    sampled_step,
)
from analyses.specification.command_limits import said_of
from reports import document as doc
from reports.document_schema import Block, Section
from reports.numbers import capital, fixed, seconds, to_minus
from reports.numbers import hertz as hertz_words
from reports.sections import loop_charts
from reports.sections.margins import (
    MEANING,
    by_itself_notes,
    evidence_notes,
    finite,
    margin_row,
    response_row,
    shown,
    worst_status,
)
from reports.sections.names import LOOPS, hertz

FRAME = 1.6
STEP_POINTS = 300


def section(name: str, design: Design, figures: LoopFigures) -> Section:
    """Make the section of one loop; of a current loop that with the rotor locked is drawn beside it."""
    locked = figures.locked
    grid = frequency_grid(figures)
    title, status = LOOPS[name], worst_status([figures.sound])
    blocks = [_facts(figures), open_bode(title, figures, grid, name=name)]
    if figures.stable:
        blocks.append(closed_bode(title, figures, grid, locked, name=name))
    blocks.append(nyquist(title, figures, grid))
    if figures.peaks is not None:
        blocks.append(sensitivity(title, design, name, figures, grid))
    if figures.step is not None:
        blocks.append(step(title, figures, locked, name=name))
    blocks.append(doc.details("Nichols chart", [nichols(title, figures, grid)]))
    corner = figures.bandwidth.minus3db_hz if name == "position" and figures.bandwidth else None
    notes = [
        *filter(None, [said_of(design, corner)]),
        *by_itself_notes({title: figures}),
        *evidence_notes({title: figures}),
        *figures.margins.notes,
        *figures.notes,
    ]
    blocks += [doc.remark(note) for note in notes]
    return doc.section(
        f"loop-{name}", title, blocks, result=result(figures), intro=_intro(name, figures), status=status
    )


def result(figures: LoopFigures) -> str:
    """Say in one sentence what the loop is like."""
    row, bandwidth = margin_row(figures), response_row(figures)["minus3db_hz"]
    parts = [
        ("gain margin", row["gain_margin_db"], "dB", row["gain_margin_hz"]),
        ("phase margin", row["phase_margin_deg"], "deg", row["crossover_hz"]),
    ]
    words = [
        f"{name} {value:.1f} {unit}" + (f" at {hertz_words(hz)}" if hz else "")
        for name, value, unit, hz in parts
        if value is not None
    ]
    if bandwidth is not None:
        words.append(f"bandwidth {hertz_words(bandwidth)}")
    rotor = "Rotor free, " if figures.loop.name == "current" else ""
    verdict = f"{rotor}{figures.margins.verdict} ({figures.margins.evidence})"
    return to_minus(capital(f"{verdict}: {', '.join(words)}." if words else f"{verdict}."))


def _intro(name: str, figures: LoopFigures) -> str:
    period = figures.loop.period_s
    rate = "" if period is None else f", every {seconds(period)}"
    inner = "no loop inside it" if name == "current" else "the loops inside it closed"
    words = f"Cut at its error ({figures.loop.unit_in}){rate}, with {inner}."
    return f"{words} The margins are {figures.margins.evidence}: {MEANING[figures.margins.evidence]}."


def _facts(figures: LoopFigures) -> Block:
    """Give the figures to remember of this loop."""
    chosen = [
        doc.fact(
            each.label, _short(shown(each, figures), each.at_a_glance), each.shown[0], better=each.direction
        )
        for each in AT_A_GLANCE
    ]
    crossover = _short(margin_row(figures)["crossover_hz"], "sig:3")
    return doc.facts([*chosen, doc.fact("Gain crossover", crossover, "Hz")])


def _short(value: float | None, format: str) -> float | None:
    """Cut a figure to what a reader remembers; the tables hold every digit."""
    if value is None:
        return None
    kind, _, places = format.partition(":")
    return round(value, int(places)) if kind == "fix" else float(f"{value:.{places}g}")


def open_bode(
    title: str, figures: LoopFigures, grid: np.ndarray, *, name: str = "", small: bool = False
) -> Block:
    """Make the open-loop Bode figure with every margin on it."""
    open_loop = [("open loop", curve(figures.loop.plain_open, grid))]
    chart = loop_charts.bode(open_loop, figures.margins, nyquist_hz(figures), name, small)
    caption = (
        f"{title}, open loop: gain margins at the phase crossovers (■), "
        "phase margins at the gain crossovers (●)."
    )
    return doc.figure("bode", chart, caption=caption, alt=_margin_words(title, figures), layout="half")


def closed_bode(
    title: str, figures: LoopFigures, grid: np.ndarray, locked: LoopFigures | None, *, name: str = ""
) -> Block:
    """Make the closed-loop Bode figure with the bandwidths."""
    other = figures.reference
    first = "rotor free" if locked else "to the command" if other else "closed loop"
    curves = [(first, answer_curve(figures, grid))]
    if other is not None:
        curves.append(("to the reference", answer_curve(other, grid)))
    if locked is not None and locked.stable:
        curves.append(("rotor locked", curve(locked.plain_response, grid)))
    band = figures.bandwidth
    chart = loop_charts.closed_bode(curves, band, nyquist_hz(figures), name)
    corner, lag = (_hz(band.minus3db_hz), _hz(band.minus90deg_hz)) if band else (_hz(None), _hz(None))
    words = f"{title}, closed loop: −3 dB at {corner}, −90° at {lag}."
    return doc.figure("closed_bode", chart, words, alt=f"Bode diagram. {words}", layout="half")


def nyquist(title: str, figures: LoopFigures, grid: np.ndarray) -> Block:
    """Make the Nyquist figure."""
    margins, system = figures.margins, figures.loop.plain_open
    omega, points = nyquist_curve(system, grid, FRAME)
    closest = margins.modulus_frequency_rad_s
    there = closest is not None and math.isfinite(closest) and closest > 0
    at = complex(response_at(system, np.array([closest]))[0]) if there else None
    phases = [m.frequency_rad_s for m in margins.phase_margins if m.frequency_rad_s > 0]
    on_circle = response_at(system, np.array(phases)) if phases else np.empty(0, dtype=complex)
    chart = loop_charts.nyquist(omega / (2.0 * np.pi), points, margins, at, on_circle, FRAME)
    modulus = "withheld" if margins.modulus_margin is None else f"{margins.modulus_margin:.3f}"
    caption = (
        f"{title}, Nyquist curve near −1: it keeps a distance of {modulus} "
        "(modulus margin, 1 over the peak of S)."
    )
    return doc.figure("nyquist", chart, caption=caption, alt=f"Nyquist diagram. {caption}", layout="tall")


def nichols(title: str, figures: LoopFigures, grid: np.ndarray) -> Block:
    """Make the Nichols chart."""
    one = curve(figures.loop.plain_open, grid)
    chart = loop_charts.nichols(one.frequency_hz, one.magnitude_db, one.phase_deg)
    caption = (
        f"{title}, Nichols chart: gain over phase. Inside the outlines about the critical points (+) the "
        "peak of S or of T exceeds 6 dB."
    )
    return doc.figure("nichols", chart, caption=caption, alt=f"{caption} {_margin_words(title, figures)}")


def sensitivity(title: str, design: Design, name: str, figures: LoopFigures, grid: np.ndarray) -> Block:
    """Make the figure of S and T."""
    peaks = figures.peaks
    assert peaks is not None
    limits = [
        item.maximum
        for item in design.requirements
        if item.quantity == "sensitivity_peak"
        and item.loop in (name, "every", None)
        and item.maximum is not None
    ]
    both = (figures.loop.plain_sensitivity, figures.loop.plain_closed)
    s_db, t_db = (_db(response_at(each, grid)) for each in both)
    found = (
        (finite(hertz(peaks.sensitivity_rad_s)), finite(peaks.sensitivity_db)),
        (finite(hertz(peaks.complementary_rad_s)), finite(peaks.complementary_db)),
    )
    chart = loop_charts.sensitivity(grid / (2 * np.pi), s_db, t_db, found, min(limits, default=None), name)
    caption = (
        f"{title}: sensitivity S = 1/(1 + L), peak {fixed(peaks.sensitivity_db, 2)} dB, "
        f"and closed loop T = L/(1 + L), peak {fixed(peaks.complementary_db, 2)} dB."
    )
    return doc.figure("sensitivity", chart, caption, layout="half")


def step(
    title: str, loop_figures: LoopFigures, locked: LoopFigures | None, *, name: str = "", small: bool = False
) -> Block:
    """Make the step figure."""
    figures = loop_figures.step
    assert figures is not None
    end = None
    if locked is not None and locked.step is not None:
        end = 4.0 * float(locked.step.settling_time_s)  # the motor's own motion goes on for much longer
    responses = [_response("rotor free" if locked else "closed loop", loop_figures, end)]
    if locked is not None and locked.step is not None:
        responses.append(_response("rotor locked", locked, end))
    chart = loop_charts.step(responses, figures, loop_figures.loop.period_s is not None, name, small)
    caption = f"{title}, response to a unit step of its command; the band is 2 % about the final value."
    if end is not None and float(figures.settling_time_s) > end:
        caption += " With the rotor free, back-EMF keeps it from settling within the time shown."
    return doc.figure("step", chart, caption=caption, alt=f"Step response. {caption}", layout="half")


def nyquist_hz(figures: LoopFigures) -> float | None:
    """Give the Nyquist frequency of a sampled loop."""
    return None if figures.loop.period_s is None else 0.5 / figures.loop.period_s


def _response(label: str, loop_figures: LoopFigures, end_s: float | None = None) -> loop_charts.Response:
    """Give a step response, cut where nothing happens any more and thinned."""
    figures = loop_figures.step
    assert figures is not None
    time, response = np.asarray(figures.time_s), np.asarray(figures.response)
    settled = figures.settling_time_s
    if end_s is None and settled is not None and math.isfinite(settled) and settled > 0:
        end_s = 2.2 * settled
    period = None if loop_figures.mean else loop_figures.loop.period_s
    if end_s is not None and period is not None and end_s / period < STEP_POINTS:
        response = sampled_step(loop_figures.plain_response, math.ceil(end_s / period) + 1)
        time = period * np.arange(len(response))
    if end_s is not None:
        keep = max(int(np.searchsorted(time, end_s, side="right")), 8)
        time, response = time[:keep], response[:keep]
    stride = max(1, math.ceil(len(time) / STEP_POINTS))
    time, response = time[::stride], response[::stride]
    if end_s is not None and time[-1] < end_s:
        time, response = np.append(time, end_s), np.append(response, response[-1])
    return label, time, response


def _db(values: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(values)))


def _hz(value: float | None) -> str:
    known = finite(value)
    return "no frequency in the band" if known is None else f"{known:.4g} Hz"


def _margin_words(title: str, figures: LoopFigures) -> str:
    row = margin_row(figures)
    gain = "none" if row["gain_margin_db"] is None else f"{row['gain_margin_db']:.1f} dB"
    phase = "none" if row["phase_margin_deg"] is None else f"{row['phase_margin_deg']:.1f} deg"
    name = title[:1].lower() + title[1:]
    return f"Open-loop Bode diagram of the {name}: gain margin {gain}, phase margin {phase}."
