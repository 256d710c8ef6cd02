"""Figures of a comparison: overlaid Bode and step, tornado charts of what matters to the requirements."""

import math
from dataclasses import replace

import numpy as np

from actuator_lti.asked.quantities import ANALYSIS_QUANTITIES, drive_cases, shown_unit
from analyses.comparison.variants import Compared, Comparison
from analyses.linear.responses import curve, frequency_grid, response_curve
from analyses.specification.sensitivity import Sensitivity
from reports import document as doc
from reports.charts import style
from reports.sections.loop_charts import both
from reports.sections.names import LOOPS, in_shown
from reports.sections.requirements import nearer_limit

MOST_CURVES = 7
MOST_BARS = 10
MOST_CHARTS = 8


def overlays(comparison: Comparison) -> doc.Section:
    drawn = comparison.all[:MOST_CURVES]
    blocks: list[doc.Block] = []
    for name, title in LOOPS.items():
        if name in comparison.base.loops:
            blocks += _bode(name, title, drawn, closed=False) + _bode(name, title, drawn, closed=True)
            blocks += _step(name, title, drawn)
    left_out = len(comparison.everything.all) - len(drawn)
    intro = f"{left_out} more designs are in the tables only." if left_out else ""
    others = {name.group for name in comparison.names} - set(comparison.base.loops)
    lacking = " or ".join(title.lower() for name, title in LOOPS.items() if name in others)
    intro += f" The base has no {lacking}; those of others are in the tables only." * bool(lacking)
    result = f"Open loop, closed loop and step of {len(drawn)} designs; the base is black."
    return doc.section("overlays", "Responses of all designs", blocks, result=result, intro=intro)


def _bode(name: str, title: str, drawn: tuple[Compared, ...], closed: bool) -> list[doc.Block]:
    known = [(one, one.loops[name]) for one in drawn if name in one.loops]
    known = [(one, result) for one, result in known if result.stable or not closed]
    if not known:
        return []
    which = "closed loop" if closed else "open loop"
    lowest = min(frequency_grid(result, 140)[0] for _, result in known)
    curves = []
    for one, result in known:
        own = frequency_grid(result, 140)
        grid = np.unique(np.concatenate([np.geomspace(lowest, own[0], 20), own]))
        response = response_curve(result, grid) if closed else curve(result.loop.plain_open, grid)
        band = result.bandwidth if closed else None
        values = response.values / abs((band and band.dc_gain) or 1.0)  # in any unit it starts at 0 dB
        curves.append((one.variant.name[:60], replace(response, values=values)))
    chart = style.Chart(width=style.WIDE, height=410.0, title=f"{title}, {which}")
    whole = math.inf  # curves are cut nowhere: where two differ is what is looked for
    marks = [0.0]  # of both: that of the crossover, and where a closed loop starts
    both(curves, None, *chart.column(1.0, 1.0), span=whole, phase_span=whole, marks=marks, look=_look)
    return [doc.figure("overlay", chart, f"{title}, {which}: the base and its variants.")]


def _look(k: int) -> style.Style:
    colour = style.INK if k == 0 else style.SERIES[(k - 1) % 7]
    return {"colour": colour, "dash": k % 7, "width": 2.4 if k == 0 else 1.7}


def _step(name: str, title: str, drawn: tuple[Compared, ...]) -> list[doc.Block]:
    steps = [(one.variant.name[:60], one.loops[name].step) for one in drawn if name in one.loops]
    shown = [(label, step) for label, step in steps if step is not None]
    if not shown:
        return []
    chart, panel = style.plot(410.0, y="response to a unit step", title=f"{title}, step")
    scale = style.time_axis(panel, max(float(step.time_s[-1]) for _, step in shown))
    for k, (label, step) in enumerate(shown):
        time, response = np.asarray(step.time_s), np.asarray(step.response)
        keep = np.unique(np.linspace(0, len(time) - 1, min(len(time), 240)).astype(int))
        panel.curve(time[keep] * scale, response[keep] / step.final_value, label, **_look(k))
    panel.x.limits(0.0)
    return [doc.figure("overlay", chart, f"{title}, unit step: the base and its variants.")]


def tornadoes(comparison: Comparison) -> doc.Section:
    """Tornado charts of the figures that the requirements look at, then every slope in a table."""
    wanted = _wanted(comparison)
    known = [(key, comparison.sensitivities.tornado(key), limit) for key, limit in wanted.items()]
    shown = [(key, bars, limit) for key, bars, limit in known if bars][:MOST_CHARTS]
    blocks = [_tornado(comparison, key, bars[:MOST_BARS], limit) for key, bars, limit in shown]
    blocks.append(doc.details("Every sensitivity", [_slopes(comparison)]))
    intro = (
        "Each parameter alone at both ends of its tolerance, or ±10 % where it has none. Slopes are central "
        "differences of 0.1 % over the exact sampled loops; figures of the step are stairs, without a slope."
    )
    result = "No figure depends on a parameter with a tolerance."
    if shown:
        key, bars, _ = shown[0]
        name = next((n.label for n in comparison.names if n.key == key), key)
        place = LOOPS.get(key.partition(".")[0], "drive").lower()
        result = f"The {name} of the {place} depends most on {bars[0].path}."
    return doc.section("sensitivities", "Sensitivities", blocks, result=result, intro=intro)


def _wanted(comparison: Comparison) -> dict[str, float | None]:
    """Figures behind the requirements with their limit; without requirements the margins of each loop.

    Those that `analyses.specification.sensitivity` has: no stairs of a step, no response behind a mean.
    """
    result: dict[str, float | None] = {}
    for verdict in comparison.base.verdicts:
        r = verdict.requirement
        if r.quantity in ANALYSIS_QUANTITIES:
            continue  # of one design at a time
        place = verdict.loop or "drive"
        loads = dict(drive_cases([r.load_Nm or 0.0]))
        key = f"{place}.{r.quantity}" + (f"@{loads[r.quantity]:g}" if place == "drive" else "")
        if key in comparison.sensitivities.base and comparison.base.figures.get(key) is not None:
            result[key], _ = nearer_limit(verdict)
    if not result:
        margins = ("gain_margin", "phase_margin", "bandwidth")
        every = (f"{loop}.{q}" for loop in comparison.base.loops for q in margins)
        result = {key: None for key in every if key in comparison.sensitivities.base}
    order = sorted(result, key=lambda key: not key.startswith(("position", "drive")))
    return {key: result[key] for key in order}


def _tornado(
    comparison: Comparison, key: str, bars: tuple[Sensitivity, ...], limit: float | None
) -> doc.Block:
    name = next((n for n in comparison.names if n.key == key), None)
    words = f"{LOOPS.get(key.partition('.')[0], 'Drive')}: {name.label if name else key}"
    own = name.unit if name else ""
    unit, factor = shown_unit(own)
    base, limit = factor * comparison.sensitivities.base[key], in_shown(limit, own)
    bars = tuple(replace(bar, low=factor * bar.low, high=factor * bar.high) for bar in bars)
    ends = [v for bar in bars for v in (bar.low, bar.high)]
    low, high = min(ends), max(ends)
    near = limit is not None and low - 3 * abs(base - low) <= limit <= high + 3 * abs(high - base)
    chart, panel = style.plot(90.0 + 27.0 * len(bars), f"{words}, {unit}" if unit else words, legend=True)
    look: style.Style = {"colour": style.ORANGE, "fill": "none", "hatch": "//", "width": 1.2}
    for k, bar in enumerate(bars):
        panel.bar(float(k), base, bar.low, "parameter low", **look)
        panel.bar(float(k), base, bar.high, "parameter high", colour=style.BLUE)
    panel.rule_x(base, colour=style.INK, width=1.3)
    if limit is not None and near:
        panel.rule_x(limit, "limit", seen=True, colour=style.RED, width=1.4, dash=1)
    spans = [(bar.path, bar.low_value, bar.high_value) for bar in bars]
    widths = [(path, 100.0 * (b - a) / (abs(a + b) or math.inf)) for path, a, b in spans]
    style.rows(panel, [f"{path} ±{width:.3g} %" for path, width in widths])
    return doc.figure("tornado", chart, f"{words}: each parameter alone at both its ends.")


def _slopes(comparison: Comparison) -> doc.Block:
    known = comparison.sensitivities
    columns = [
        doc.of(lambda pair: pair[0], "figure", "Figure"),
        doc.of(lambda pair: pair[1].path, "path", "Parameter"),
        doc.of(lambda pair: pair[1].per_percent, "slope", "Change per +1 %", format="sig:3"),
        doc.of(lambda pair: pair[1].low, "low", "At its low end", format="sig:5"),
        doc.of(lambda pair: known.base[pair[0]], "base", "Nominal", format="sig:5"),
        doc.of(lambda pair: pair[1].high, "high", "At its high end", format="sig:5"),
    ]
    there = (key for key in known.base if comparison.base.figures.get(key) is not None)
    slopes = [(key, one) for key in there for one in known.tornado(key)[:MOST_BARS]]
    return doc.listing("Slopes and ranges, the ten strongest parameters of each figure", slopes, columns)
