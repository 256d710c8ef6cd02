"""The loops seen from other sides: in three forms, at break points and operating points, delay by delay."""

from collections.abc import Mapping, Sequence
from typing import Any

from actuator_lti.design.model import Design
from actuator_lti.files.reading import Tree
from actuator_lti.loops.delay_budget import DelayBudget
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.loop_survey import BreakPoint, OperatingPointFigures
from analyses.linear.responses import curve, frequency_grid
from reports import document as doc
from reports.charts import style
from reports.charts.pen import HATCH_PATHS
from reports.numbers import to_minus
from reports.sections.loop_charts import both, nyquist_hz
from reports.sections.margins import MARGIN_COLUMNS, evidence_notes, margin_row, response_row, worst_status
from reports.sections.names import FORMS, POINTS, figure_column, hertz, loop_words

COLUMNS = [
    doc.column("loop", "Loop"),
    doc.column("form", "Form"),
    doc.column("crossover_hz", "Crossover", "Hz", format="sig:4"),
    figure_column("phase_margin", "phase_margin_deg", format="fix:2"),
    doc.column("phase_cost_deg", "against ideal", "deg", format="fix:2"),
    figure_column("gain_margin", "gain_margin_db", format="gain:2"),
    figure_column("delay_margin", "delay_margin_ms", format="sig:3"),
    figure_column("sensitivity_peak", "s_peak_db", format="fix:2"),
    figure_column("bandwidth", "minus3db_hz", format="sig:4"),
    figure_column("bandwidth_90deg", "minus90deg_hz", format="sig:4"),
]


def section(forms: Mapping[str, Mapping[str, LoopFigures]], refused: Sequence[str] = ()) -> doc.Section:
    """Make the section from the figures by form and loop; ``refused`` says which are missing, and why."""
    pairs = [(name, form) for name in forms["sampled"] for form in forms if name in forms[form]]
    ideal = forms.get("ideal", {})
    rows: list[Tree] = [_row(name, form, forms[form][name], ideal.get(name)) for name, form in pairs]
    note = (
        "Sampled: exact. Continuous: PI in s with the exact delays of computing and hold. Ideal: the same "
        "without any delay. No form uses a Padé approximation."
    )
    named = {f"{FORMS[form]}, {name}": f for form, result in forms.items() for name, f in result.items()}
    reasons = evidence_notes(named)
    note += "" if reasons else " All margins are certified."
    table = doc.table("Margins and bandwidths in the three forms", COLUMNS, rows, note)
    notes = [*(f"Not found: {reason}." for reason in refused), *reasons]
    blocks = [_overlay(forms), table, *map(doc.text, notes)]
    words = "No phase margin is known in both the sampled and the ideal form."
    costs = [row for row in rows if row["form"] == FORMS["sampled"] and row["phase_cost_deg"] is not None]
    if costs:
        row = min(costs, key=lambda row: float(row["phase_cost_deg"]))
        change = to_minus(f"{row['phase_cost_deg']:+.1f}")
        loop = row["loop"].lower() + "," * ("," in row["loop"])
        words = f"Sampling and delay change the phase margin of the {loop} by {change} deg"
        words += ", the largest change of all loops" * (len(costs) > 1) + "; its crossover moves, too."
    intro = "The forms differ by sampling, hold and computing delay."
    return doc.section("forms", "Sampled, continuous, ideal", blocks, result=words, intro=intro)


def _row(name: str, form: str, figures: LoopFigures, ideal: LoopFigures | None) -> doc.Row:
    known = margin_row(figures) | response_row(figures)
    own, reference = known["phase_margin_deg"], margin_row(ideal)["phase_margin_deg"] if ideal else None
    cost = None if own is None or reference is None or form == "ideal" else own - reference
    row = {**known, "loop": loop_words(name), "form": FORMS[form], "phase_cost_deg": cost}
    return row | ({"_status": "fail"} if figures.is_stable is False else {})


def _overlay(forms: Mapping[str, Mapping[str, LoopFigures]]) -> doc.Block:
    chart = style.Chart(width=style.WIDE, height=400.0)
    for name, sampled in forms["sampled"].items():
        grid = frequency_grid(sampled, points=130)
        known = [(form, result[name]) for form, result in forms.items() if name in result]
        curves = [(FORMS[form], curve(one.loop.plain_open, grid)) for form, one in known]
        top, bottom = chart.column(1.0, 1.0, title=loop_words(name))
        both(curves, nyquist_hz(sampled), top, bottom, span=120.0, marks=[0.0])
        top.rule_y(0.0, colour=style.INK)
        bottom.rule_y(-180.0, colour=style.INK)
    caption = "Open loops in the three forms, each up to its Nyquist frequency (dotted line)."
    return doc.figure("forms", chart, caption)


BREAK_COLUMNS = [
    doc.column("point", "Cut at"),
    doc.column("others", "Other loops"),
    *(c for c in MARGIN_COLUMNS if c["key"] not in ("loop", "delay_margin_samples", "disk_margin")),
]
PERIODIC = (
    "A fast loop cut inside slower ones is periodically time-varying; the rows above describe its "
    "fundamental. The exact stability limits follow from the eigenvalues over one period."
)
EXACT = "Stability limits of periodic loops"
EXACT_NOTE = (
    "A dash: none within a factor of 10⁴. The delay is that of the computing, which acts at the voltage "
    "alone."
)
EXACT_COLUMNS = [
    doc.of(lambda pair: POINTS.get(pair[0], pair[0]), "point", "Cut at"),
    doc.of(lambda pair: pair[1].gain_upper, "gain_upper", "Gain may grow by", "×", format="sig:4"),
    doc.of(lambda pair: pair[1].gain_lower or None, "gain_lower", "and fall to", "×", format="sig:3"),
    doc.of(lambda pair: pair[1].delay_s, "delay_ms", "Delay may grow by", "ms", scale=1e3, format="ms:3"),
]


def break_points(points: Mapping[str, BreakPoint], stages: Mapping[str, LoopFigures]) -> doc.Section:
    """Make the section; ``stages`` are the loops with the outer ones open."""
    rows: list[doc.Row] = []
    for name, point in points.items():
        own = [("outer ones open", one) for one in stages.values() if one.loop.break_point == name]
        for others, one in (*own, ("all closed", point.figures)):
            found = margin_row(one) if one else {"stable": "see below"}
            rows.append({"point": POINTS.get(name, name), "others": others, **found})
    note = "The outermost loop has no other loop outside it, so its two lines agree."
    reasons = [f"{POINTS.get(name, name)}: {point.reason}." for name, point in points.items() if point.reason]
    there = {POINTS.get(name, name): one.figures for name, one in points.items() if one.figures is not None}
    blocks = [doc.table("Break-point matrix", BREAK_COLUMNS, rows, note)]
    blocks += map(doc.text, [*reasons, *evidence_notes(there)])
    exact = [(name, point.exact) for name, point in points.items() if point.exact is not None]
    if exact:
        blocks += [doc.text(PERIODIC), doc.listing(EXACT, exact, EXACT_COLUMNS, EXACT_NOTE)]
    intro = (
        "In the finished drive a gain error or a delay occurs at one point, with every other loop closed. "
        "The matrix shows what the drive tolerates at each point."
    )
    status, words = worst_status([point.stable for point in points.values()]), _most_sensitive(rows)
    return doc.section("break-points", "Break-point matrix", blocks, result=words, intro=intro, status=status)


def _most_sensitive(rows: Sequence[Mapping[str, Any]]) -> str:
    closed = [row for row in rows if row["others"] == "all closed" and row.get("s_peak_db") is not None]
    if not closed:
        return "No margin of the finished drive is known."
    row = max(closed, key=lambda row: float(row["s_peak_db"]))
    unknown = [row["point"] for row in rows if row["others"] == "all closed" and row not in closed]
    of = f" (the {' and the '.join(unknown)} left out)" if unknown else ""
    place = f"{row['point']}{of}: peak of S {row['s_peak_db']:.2f} dB"
    return f"With all loops closed the drive is most sensitive at the {place}."


def operating_points(points: Sequence[OperatingPointFigures], design: Design) -> doc.Section:
    names = list(dict.fromkeys(name for point in points for name in point.figures))
    linear = design.axis == "linear"
    columns = [
        doc.column("point", "Operating point"),
        doc.column("load", "Load", design.load_unit, format="short:3"),
        doc.column("slope", "Friction slope", "N s/m" if linear else "mN m s/rad", format="sig:3"),
    ]
    columns += [
        figure_column(quantity, f"{name}_{key}", label=f"{name.capitalize()} {label}", format=format)
        for name in names
        for quantity, key, label, format in (
            ("phase_margin", "phase", "PM", "fix:1"),
            ("gain_margin", "gain", "GM", "gain:1"),
            ("bandwidth", "band", "−3\N{NO-BREAK SPACE}dB", "sig:3"),
        )
    ]
    rows = [_operating_point(point, 1.0 if linear else 1e3) for point in points]
    note = (
        "Sliding: the dry part is a constant torque and leaves no trace in the loops, whatever the load. "
        "At rest: slope Cv + Tc/w_s of the law smoothed over friction.smoothing_speed, w_s: dry friction as "
        "such has none there. Speed amplitude W: describing function, "
        "slope Cv + 4 Tc/(π W); Tc = C0 + CM |load|."
    )
    loops = [(f"{point.label}, {name} loop", f) for point in points for name, f in point.figures.items()]
    reasons = list(dict.fromkeys(reason for one in loops for reason in evidence_notes(dict([one]))))
    note += " All margins are certified" + (" but those named below." if reasons else ".")
    caption = "PM: phase margin, GM: gain margin, −3 dB: bandwidth (position: to the command)"
    blocks = [doc.table(caption, columns, rows, note), *map(doc.text, reasons)]
    intro = "The effect of friction on small motions depends on speed and load"
    intro += ", that of cogging and gear error on the angle." if any(p.design for p in points) else "."
    return doc.section("operating-points", "Operating points", blocks, result=_spread(points), intro=intro)


def _spread(points: Sequence[OperatingPointFigures]) -> str:
    for one, words in ((False, "Unstable"), (None, "Stability is not known")):
        here = [p.place or p.label for p in points if any(f.is_stable is one for f in p.figures.values())]
        if here:
            return f"{words} at {len(here)} of {len(points)} operating points: {'; '.join(here)}."
    each = [(f"{n} loop, {p.place or p.label}", f.judged) for p in points for n, f in p.figures.items()]
    margins = [(margin_row(figures)["phase_margin_deg"], words) for words, figures in each]
    known = [pair for pair in margins if pair[0] is not None]
    deg, where = min(known, key=lambda pair: float(pair[0]), default=(None, ""))
    least = "" if deg is None else f"; the smallest phase margin is {deg:.1f} deg ({where})"
    return f"Stable at all {len(points)} operating points{least}."


def _operating_point(point: OperatingPointFigures, scale: float) -> doc.Row:
    load = "any" if point.load_Nm is None else point.load_Nm
    row: doc.Row = {"point": point.label, "slope": point.slope_Nms_rad * scale, "load": load}
    for name, result in point.figures.items():
        one = result.judged
        known = margin_row(one) | response_row(one)
        row[f"{name}_phase"] = known["phase_margin_deg"] if one.stable else one.margins.verdict
        row |= {f"{name}_gain": known["gain_margin_db"], f"{name}_band": known["minus3db_hz"] or None}
        row |= {"_status": "fail"} if result.is_stable is False else {}
    return row


DEG: dict[str, Any] = {"unit": "deg", "format": "fix:2"}
CAUSES = {
    "controller": "controller",
    "plant": "motor, inner loops",
    "measurement": "speed measurement",
    "hold": "hold",
    "computing delay": "computing delay",
    "sampling": "sampling",
}


def delay_budget(budgets: Mapping[str, DelayBudget]) -> doc.Section:
    def part(key: str, label: str) -> doc.Shown:
        return doc.of(lambda one: one[1].items.get(key, 0.0), key, label, **DEG)

    parts = _causes(budgets)
    columns = [
        doc.of(lambda one: loop_words(one[0], one[1].rotor), "loop", "Loop"),
        doc.of(lambda one: hertz(one[1].frequency_rad_s), "crossover_hz", "Crossover", "Hz", format="sig:4"),
        *(part(key, label.capitalize()) for key, label in parts.items()),
        doc.of(lambda one: one[1].total_deg, "total", "Phase in all", **DEG),
        doc.of(lambda one: 180.0 + one[1].total_deg, "margin", "Left to −180°", **DEG, better=1),
        doc.of(lambda one: one[1].one_more_sample_deg, "one_more", "One more sample", **DEG),
    ]
    note = (
        "The loop is built up cause by cause, so the parts add up to the phase of the exact sampled loop. "
        "One more sample: cost of one more period of computing delay, not included in the total."
    )
    caption = "Lag at the gain crossover of each loop, by cause. The rest to 180° is phase margin."
    blocks = [
        doc.figure("delay_budget", _budget_chart(budgets), caption),
        doc.listing("Phase at the gain crossover", budgets.items(), columns, note),
    ]
    digital = ("measurement", "hold", "computing delay", "sampling")
    lost = {name: -sum(budget.items[key] for key in digital) for name, budget in budgets.items()}
    name = max(lost, key=lambda key: lost[key])
    loop = loop_words(name, budgets[name].rotor).lower()
    words = (
        f"Speed measurement, hold, computing delay and sampling take {lost[name]:.1f} deg at the crossover "
        f"of the {loop}{', more than at any other' * (len(lost) > 1)}; "
        f"{180.0 + budgets[name].total_deg:.1f} deg are left."
    )
    intro = "The phase at the gain crossover of each loop, divided into its causes."
    return doc.section("delays", "Delay budget", blocks, result=words, intro=intro)


def _causes(budgets: Mapping[str, DelayBudget]) -> dict[str, str]:
    """Every item that occurs, with its words: the filters between the plant and the measurement."""
    filters = dict.fromkeys(name for budget in budgets.values() for name in budget.filters_deg)
    return {key: CAUSES[key] for key in ("controller", "plant")} | {name: name for name in filters} | CAUSES


def _budget_chart(budgets: Mapping[str, DelayBudget]) -> style.Chart:
    """Draw lag to the right and lead to the left of zero; what is left to 180 deg is phase margin."""
    made = style.Chart(width=style.WIDE, height=70.0 + 48.0 * len(budgets), legend=True)
    words = "lag at the gain crossover, deg (lead left of zero; at 180 deg no phase margin is left)"
    panel, parts = made.panel(words), _causes(budgets)
    bars = [
        {words: -one.items[key] for key, words in parts.items() if abs(one.items.get(key, 0.0)) > 0.05}
        for one in budgets.values()
    ]
    names, hatches = list(dict.fromkeys(name for bar in bars for name in bar)), ("", *HATCH_PATHS)
    for row, bar in enumerate(bars):
        ends = {1: 0.0, -1: 0.0}
        for name, deg in bar.items():
            side, k = (1 if deg >= 0 else -1), names.index(name)
            start, stop = ends[side], ends[side] + deg
            panel.bar(float(row), start, stop, name, colour=style.SERIES[k % 7], hatch=hatches[k % 7])
            if abs(deg) > 8:
                panel.note(style.to_minus(f"{deg:.0f}°"), ((start + stop) / 2, float(row)), pinned=True)
            ends[side] = stop
        panel.note(f"{sum(ends.values()):.1f}° in all", (ends[1], float(row)))
    panel.rule_x(180.0, colour=style.INK, width=1.2)
    panel.rule_x(0.0, colour=style.INK)
    style.rows(panel, list(budgets))
    low, high = panel.x.span()
    panel.x.limits(high=max(high * 1.13, 186.0))
    panel.x.ticks = style.multiples(30.0, low, panel.x.span()[1])
    return made
