"""One loop: its figures over frequency, S and T, step."""

import math

import numpy as np

from actuator_lti.asked.quantities import AT_A_GLANCE, Quantity
from actuator_lti.design.model import Design
from actuator_lti.loops.commanded import sampled_step
from actuator_lti.step import StepFigures
from analyses.finite import finite
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.responses import frequency_grid, response_at
from analyses.specification.asked_figures import said_of
from reports import document as doc
from reports.charts import style
from reports.numbers import capital, fixed, gain_margin, seconds, to_minus
from reports.sections import loop_charts, margins
from reports.sections.names import LOOPS, hertz

STEP_POINTS = 300
Response = tuple[str, np.ndarray, np.ndarray]  # label, time in s, response


def section(name: str, design: Design, figures: LoopFigures) -> doc.Section:
    title, grid, locked = LOOPS[name], frequency_grid(figures), figures.locked
    blocks = [_facts(figures), loop_charts.open_bode(title, figures, grid, name=name)]
    blocks += [loop_charts.closed_bode(title, figures, grid, locked, name=name)] if figures.stable else []
    blocks.append(loop_charts.nyquist(title, figures, grid))
    blocks += [sensitivity(title, design, name, figures, grid)] if figures.peaks is not None else []
    blocks += [step(title, figures, locked, name=name)] if figures.step is not None else []
    blocks.append(doc.details("Nichols chart", [loop_charts.nichols(title, figures, grid)]))
    corner = figures.bandwidth.minus3db_hz if name == "position" and figures.bandwidth else None
    said, known = said_of(design, corner), {title: figures}
    notes = [*([said] if said else []), *margins.by_itself_notes(known), *margins.evidence_notes(known)]
    blocks += map(doc.remark, (*notes, *figures.margins.notes, *figures.notes))
    period, evidence = figures.loop.period_s, figures.margins.evidence
    rate = "" if period is None else f", every {seconds(period)}"
    inner = "no loop inside it" if name == "current" else "the loops inside it closed"
    place = "what its law gives" if figures.loop.at_law else "its error"
    intro = (
        f"Cut at {place} ({figures.loop.unit_in}){rate}, with {inner}. The margins are {evidence}: "
        f"{margins.MEANING[evidence]}."
    )
    words, status = result(figures), margins.worst_status([figures.is_stable])
    return doc.section(f"loop-{name}", title, blocks, result=words, intro=intro, status=status)


def _facts(figures: LoopFigures) -> doc.Block:
    def item(of: Quantity) -> doc.FactItem:
        value, unit = margins.shown(of, figures), of.shown[0]
        return doc.fact(of.label, value, unit, format=of.at_a_glance, better=of.direction)

    crossover = margins.margin_row(figures)["crossover_hz"]
    return doc.facts([*map(item, AT_A_GLANCE), doc.fact("Gain crossover", crossover, "Hz", format="sig:3")])


def result(figures: LoopFigures) -> str:
    row, bandwidth, words = margins.margin_row(figures), margins.response_row(figures)["minus3db_hz"], []
    for name, value, unit, hz, write in (
        ("gain margin", row["gain_margin_db"], "dB", row["gain_margin_hz"], gain_margin),
        ("phase margin", row["phase_margin_deg"], "deg", row["crossover_hz"], fixed),
    ):
        if value is not None:
            words.append(f"{name} {write(value, 1)} {unit}" + (f" at {style.hertz(hz)}" if hz else ""))
    if bandwidth is not None:
        to = " to the command" if figures.loop.name == "position" else ""
        words.append(f"bandwidth{to} {style.hertz(bandwidth)}")
    rotor = "Rotor free, " if figures.loop.name == "current" else ""
    verdict = f"{rotor}{figures.margins.verdict} ({figures.margins.evidence})"
    return to_minus(capital(f"{verdict}: {', '.join(words)}." if words else f"{verdict}."))


def sensitivity(title: str, design: Design, name: str, figures: LoopFigures, grid: np.ndarray) -> doc.Block:
    peaks = figures.peaks
    assert peaks is not None
    asked = [one for one in design.requirements if one.quantity == "sensitivity_peak"]
    limits = style.known(one.maximum for one in asked if one.loop in (name, "every", None))
    grid_hz, values = grid / (2.0 * np.pi), []
    chart, panel = style.plot(225.0, y="magnitude, dB", width=style.HALF, loop=name)
    drawn = (
        ("S", figures.loop.plain_sensitivity, peaks.sensitivity_rad_s, peaks.sensitivity_db, style.ORANGE),
        ("T", figures.loop.plain_closed, peaks.complementary_rad_s, peaks.complementary_db, style.BLUE),
    )
    for k, (letter, system, omega, peak, colour) in enumerate(drawn):
        at, db = finite(hertz(omega)), finite(peak)
        words = f"|{letter}|, no peak"
        if db is not None and at and db >= 0.005:
            words = f"|{letter}|, peak {db:.2f} dB at {style.hertz(at)}"
        values.append(style.decibels(response_at(system, grid)))
        panel.curve(grid_hz, values[k], words, colour=colour, dash=k)
        if db is not None and at and grid_hz[0] <= at <= grid_hz[-1] * 1.001:
            panel.points([at], [db], marker="^", colour=colour, size=7.0, read=False)
    panel.rule_y(0.0, colour=style.INK)
    style.frequency(panel, grid_hz)
    style.bound(panel, np.ravel(values), span=45.0, top_room=0.12)
    if limits:
        low, high = panel.y.span()
        limit = min(limits)
        panel.y.limits(high=max(high, limit + 0.2 * (limit - low)))
        panel.rule_y(limit, f"limit of |S|: {limit:g} dB", colour=style.INK, width=1.2, dash=1)
    caption = (
        f"{title}: sensitivity S = 1/(1 + L), peak {fixed(peaks.sensitivity_db, 2)} dB, "
        f"and closed loop T = L/(1 + L), peak {fixed(peaks.complementary_db, 2)} dB."
    )
    return doc.figure("sensitivity", chart, caption, layout="half")


def step(
    title: str, loop_figures: LoopFigures, locked: LoopFigures | None, *, name: str = "", small: bool = False
) -> doc.Block:
    figures, end = loop_figures.step, None
    assert figures is not None
    drawn = {"rotor free" if locked else "closed loop": loop_figures}
    if locked is not None and locked.step is not None:
        end = 4.0 * float(locked.step.settling_time_s)  # the motor's own motion goes on for much longer
        drawn["rotor locked"] = locked
    responses = [_response(label, one, end) for label, one in drawn.items()]
    width, height = (style.SMALL, 280.0) if small else (style.HALF, 225.0)
    chart, panel = style.plot(height, y="response to a unit step", width=width, loop=name)
    last, held = float(responses[0][1][-1]), loop_figures.loop.period_s is not None
    scale = style.time_axis(panel, last)
    for k, (label, time, response) in enumerate(responses):
        panel.curve(time * scale, response, label, stairs=held and len(time) < 80, **style.series(k))
    panel.x.limits(0.0, last * scale)
    lowest = min(style.known(y for _, _, response in responses for y in response), default=0.0)
    panel.y.limits(low=min(0.0, 1.05 * lowest))
    if math.isfinite(figures.final_value) and not margins.returns(loop_figures):
        step_figures(panel, figures, responses[0], scale, held and len(responses[0][1]) < 80)
    caption = f"{title}, response to a unit step of its command; the band is 2 % about the final value."
    if end is not None and float(figures.settling_time_s) > end:
        caption += " With the rotor free, back-EMF keeps it from settling within the time shown."
    return doc.figure("step", chart, caption=caption, alt=f"Step response. {caption}", layout="half")


def step_figures(
    panel: style.Panel, figures: StepFigures, drawn: Response, scale: float, stairs: bool
) -> None:
    """Draw the 2 % band, the 10-90 % rise on the curve as it is drawn, and the settling time."""
    final, words = float(figures.final_value), []
    _, time, response = drawn
    last = float(time[-1])
    panel.band_y(0.98 * final, 1.02 * final, colour=style.GREEN)
    panel.rule_y(final)
    part = np.asarray(figures.response) / final
    if (part >= 0.9).any():
        # both series are parts of the response, each thinned in its own way: the earlier is nearer
        found = ((figures.time_s, part), (time, np.asarray(response) / final))
        start = min(float(at[np.argmax(one >= 0.1)]) for at, one in found if (one >= 0.1).any())
        for t in (start, start + float(figures.rise_time_s)):
            if t <= last:
                there = response[np.searchsorted(time, t * (1.0 + 1e-12), side="right") - 1]
                level = there if stairs else np.interp(t, time, response)
                panel.points([t * scale], [float(level)], colour=style.GREEN, size=6.0, read=False)
        words.append(f"rise 10–90 %: {seconds(float(figures.rise_time_s))}")
    if math.isfinite(figures.overshoot_percent):
        words.append(f"overshoot: {figures.overshoot_percent:.1f} %")
    if math.isfinite(figures.settling_time_s):
        if figures.settling_time_s <= last:
            panel.rule_x(figures.settling_time_s * scale, colour=style.PURPLE, width=1.3, dash=1)
        words.append(f"settled to 2 %: {seconds(figures.settling_time_s)}")
    if words:
        panel.note("\n".join(words), corner="bottom right")


def _response(label: str, loop_figures: LoopFigures, end_s: float | None = None) -> Response:
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
