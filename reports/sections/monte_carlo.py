"""Odds, distributions and worst cases of a Monte Carlo study, for the page."""

import math
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

from actuator_lti.asked.quantities import shown_unit, with_unit
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from analyses.finite import finite
from analyses.monte_carlo.result import ColumnStatistics, Driver, MonteCarloResult, Odds, samples_needed
from reports import document as doc
from reports.charts import style
from reports.charts.axis import linear_ticks
from reports.numbers import or_none
from reports.sections.names import in_shown
from reports.sections.requirements import label, limit_words
from reports.terminal import Brief
from reports.verdict_summary import why

_SHOWN = (1, 5, 50, 95, 99)  # per cent
_MET_WITHIN = ": met within the tolerances"
UNRESOLVED = "not resolved in double precision"
NAMED = 3  # requirements that a note on the terminal names; of more it says how many


def section(result: MonteCarloResult) -> doc.Section:
    items = _verdicts(result)
    blocks: list[doc.Block] = [doc.verdicts(items, what="odds")] if items else []
    blocks += [_odds_table(result), *_figures(result)] if result.odds else []
    blocks += [_driver_table(result)] if result.drivers else []
    blocks.append(_figure_table(result.columns.values(), result.load_unit))
    blocks += [doc.details("Parameters of the worst cases", [_worst_table(result)])] if result.worst else []
    blocks += map(doc.remark, result.notes)
    blocks.append(doc.facts([doc.fact("Samples", result.samples), doc.fact("Seed", result.seed)]))
    blocks.append(doc.remark(f"Parameters that vary: {', '.join(result.paths)}."))
    intro = (
        f"{result.samples} designs drawn from the tolerances; sampled loops. An optimiser seeks the worst "
        "case in the whole tolerance box, as sampling alone does not find it."
    )
    words, status = _result(result), result.tally.role
    status = "fail" if result.verdict is Verdict.NOT_MET else status
    return doc.section("monte-carlo", "Tolerances", blocks, result=words, intro=intro, status=status)


def brief(result: MonteCarloResult) -> Brief:
    kept = ("label", "verdict", "probability", "low", "nominal", "worst", "unit")
    tables = [doc.with_columns(_odds_table(result), kept)] if result.odds else []
    if stepped := [one for one in result.columns.values() if one.name.startswith("nonlinear.")]:
        shown = ("figure", "unit", "minimum", "q50", "maximum", "missing")
        tables.append(doc.with_columns(_figure_table(stepped, result.load_unit, "Nonlinear step"), shown))
    reasons: dict[str, list[str]] = {}
    for one in _verdicts(result):
        if one["verdict"] != Verdict.MET:
            reasons.setdefault(why(one), []).append(one["label"].removesuffix(_MET_WITHIN))
    notes = [f"{_some(names)}: {reason}" for reason, names in reasons.items()]
    notes += [*result.notes, f"samples and worst designs: {result.folder}"]
    return Brief(_result(result), tables, notes)


def _some(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= NAMED else f"{len(names)} requirements"


def text(result: MonteCarloResult | Design) -> str | None:
    return write_design(result).rstrip("\n") if isinstance(result, Design) else None


def _result(result: MonteCarloResult) -> str:
    words = f"{result.tally.words('requirements')} under tolerances"
    each = {odds.id: odds for odds in result.odds}
    if (every := each.pop("all", None)) is None:
        said = words if result.left_out else "The design states no requirement"
        return f"{said}; {result.samples} samples were drawn.{_lost(result)}"
    words += f"; {every.passed} of {every.count} samples meet every one"
    words += " that is sampled" * bool(result.left_out)
    weakest = min(each.values(), key=lambda odds: odds.probability, default=None)
    if weakest is not None and weakest.probability < 1.0:
        share = f"{100.0 * weakest.probability:.3g} % meet it"
        words += f"; the one missed most often is {weakest.label} ({share})"
    return f"{words}.{_lost(result)}"


def _lost(result: MonteCarloResult) -> str:
    doubts = {"The drive is not stable": result.unstable, f"Its stability is {UNRESOLVED}": result.unresolved}
    return "".join(
        f" {words} in {100.0 * share:.3g} % of the samples." for words, share in doubts.items() if share
    )


def _verdicts(result: MonteCarloResult) -> list[doc.VerdictItem]:
    items = [_verdict(result, odds) for odds in result.odds if odds.id != "all"]
    for one in result.left_out:  # not sampled
        id, words = f"tolerance/{one.id}", f"{label(one)}{_MET_WITHIN}"
        items.append(doc.verdict(id, words, passed=one.verdict, reason=one.reason, waiver=one.waiver))
    return items


def _verdict(result: MonteCarloResult, odds: Odds) -> doc.VerdictItem:
    wanted = 1.0 if result.at_least is None else result.at_least
    share = odds.probability if result.at_least is None else odds.low
    verdict = result.judged(odds)
    return doc.verdict(
        f"tolerance/{odds.id}", f"{odds.label}{_MET_WITHIN}", passed=verdict, comparison=">=",
        value=100.0 * odds.probability, limit=100.0 * wanted, distance=100.0 * (share - wanted), unit="%",
        reason=_why(result, odds), waiver=odds.waiver if verdict is Verdict.NOT_PROVEN else None,
    )  # fmt: skip


def _why(result: MonteCarloResult, odds: Odds) -> str:
    case, verdict = result.case(odds), result.judged(odds)
    if verdict is Verdict.NOT_PROVEN and (odds.unresolved or (case is not None and case.passed is None)):
        where = f"{odds.unresolved} of {odds.count} samples" if odds.unresolved else "the worst case"
        return f"stability is {UNRESOLVED} in {where}"
    if verdict is Verdict.NOT_PROVEN:
        needed = samples_needed(result.enough)
        most = "no number of samples" if math.isinf(needed) else f"at least {needed} samples, if all pass,"
        most = "more samples" if odds.count >= needed else most
        return (
            f"{odds.passed} of {odds.count} samples show {100 * odds.low:.3f} % with 95 % confidence; "
            f"{most} can show {100 * result.enough:g} %"
        )
    if result.at_least is not None:
        met = verdict is Verdict.MET
        bound = f"at least {100 * odds.low:.3f}" if met else f"at most {100 * odds.high:.3f}"
        return f"{bound} % with 95 % confidence"
    if odds.failed:
        return f"{odds.failed} of {odds.count} samples fail, worst is number {odds.worst_sample}"
    if case is None or verdict is Verdict.MET:
        return ""
    if case.value is None:
        return "every sample passes, but a loop is unstable in the worst case of the tolerance box"
    said = with_unit(case.value, case.unit, ".4g")
    return f"every sample passes, but the worst case of the tolerance box fails: {said}"


def _odds_table(result: MonteCarloResult) -> doc.Block:
    def worst_case(odds: Odds) -> float | None:
        return in_shown(getattr(result.case(odds), "value", None), odds.unit)

    share: dict[str, Any] = {"unit": "%", "scale": 100.0, "format": "fix:3"}
    columns = [
        doc.of("label", "label", "Requirement"),
        doc.of(limit_words, "limit", "Limit"),
        doc.of(lambda odds: "" if odds.id == "all" else result.judged(odds).value, "verdict", "Verdict"),
        doc.of("probability", "probability", "Probability met", **share, better=1),
        doc.of("low", "low", "95\u00a0% lower bound", **share),
        doc.of("high", "high", "95\u00a0% upper bound", **share),
        doc.of(lambda odds: in_shown(odds.nominal, odds.unit), "nominal", "Nominal", format="sig:4"),
        doc.of(lambda odds: in_shown(odds.worst, odds.unit), "sampled", "Worst sample", format="sig:4"),
        doc.of("worst_sample", "number", "No.", align="right"),
        doc.of(worst_case, "worst", "Worst case", format="sig:4"),
        doc.of(lambda odds: shown_unit(odds.unit)[0], "unit", "Unit"),
    ]
    note = "A dash in the worst case: not computed, or a loop is unstable there."
    return doc.listing(
        "Odds of meeting each requirement", result.odds, columns, note,
        lambda odds: "info" if odds.id == "all" else result.judged(odds).role(),
    )  # fmt: skip


def _figure_table(
    columns: Iterable[ColumnStatistics], load_unit: str, title: str = "Distribution of every figure"
) -> doc.Block:
    def quantile(percent: int, c: ColumnStatistics) -> float | None:
        return in_shown(dict(zip(c.shares, c.quantiles, strict=True)).get(percent / 100), c.unit)

    def of(name: str, label: str, format: str = "sig:4") -> doc.Shown:
        return doc.of(lambda c: in_shown(getattr(c, name), c.unit), name, label, format=format)

    shown = [
        doc.of(lambda c: _words(c.name, load_unit), "figure", "Figure"),
        doc.of(lambda c: shown_unit(c.unit)[0], "unit", "Unit"),
        of("minimum", "Min"),
        *(doc.of(partial(quantile, q), f"q{q:02d}", f"{q} %", format="sig:4") for q in _SHOWN),
        *(of("maximum", "Max"), of("mean", "Mean"), of("std", "Std", "sig:3")),
        doc.of("missing", "missing", "Missing", align="right"),
    ]
    note = (
        "Quantiles are values of samples. Missing: samples without such a figure (unstable, or not reached)."
    )
    return doc.listing(title, columns, shown, note)


def _words(name: str, load_unit: str) -> str:
    """Name a column for people.

    >>> _words("position.phase_margin", "N m"), _words("drive.output_rate@8", "N m")
    ('position loop: phase margin', 'drive: output rate at 8 N m')
    """
    where, _, what = name.partition(".")
    figure, _, load = what.replace("_", " ").partition("@")
    place = {"drive": "drive", "nonlinear": "nonlinear step"}.get(where, f"{where} loop")
    return f"{place}: {figure}" + (f" at {load} {load_unit}" if load else "")


def _figures(result: MonteCarloResult) -> list[doc.Block]:
    shown = [(odds, result.columns[n]) for odds in result.odds if odds.id != "all" for n in odds.columns]
    shown = [pair for pair in shown if len(pair[1].counts) >= 2]  # the same in every sample: nothing to draw
    blocks, rows = [], -(-len(shown) // 3)
    for row in range(rows):
        part = shown[row * len(shown) // rows : (row + 1) * len(shown) // rows]
        chart = style.Chart(width=style.WIDE, height=250.0, legend=True)
        for odds, column in part:
            _histogram(chart.panel(title=_words(column.name, result.load_unit)), result, odds, column)
        names = ", ".join(_words(column.name, result.load_unit) for _, column in part)
        blocks.append(doc.figure("distribution", chart, f"Distribution within the tolerances: {names}."))
    return blocks


def _histogram(panel: style.Panel, result: MonteCarloResult, odds: Odds, column: ColumnStatistics) -> None:
    """Fill the counts under a line; mark limits, nominal design and worst case, each with its own dash."""
    unit, scale = shown_unit(column.unit)
    edges, counts = [scale * e for e in column.edges if math.isfinite(e)], column.counts
    x = [edges[0], *(e for edge in edges[1:-1] for e in (edge, edge)), edges[-1]]
    y = [float(c) for count in counts for c in (count, count)]
    panel.shape([([x[0], *x, x[-1]], [0.0, *y, 0.0])], colour=style.SKY, opacity=0.45)
    panel.curve(x, y, colour=style.BLUE, width=1.3, read=False)
    panel.y.limits(0.0, 1.35 * max(counts))
    case, alone = result.case(odds), len(odds.columns) == 1
    nominal = in_shown(finite(result.nominal.get(column.name)), column.unit)
    worst = in_shown(finite(case.value), column.unit) if case is not None and alone else None
    for name, value, colour, dash in (("nominal", nominal, style.INK, 0), ("worst", worst, style.ORANGE, 1)):
        if value is not None:
            panel.rule_x(value, label=name, seen=True, colour=colour, dash=dash, width=1.7)
    known = [*edges, *style.known((nominal, worst))]
    low, high = min(known), max(known)
    width = max(high - low, 1e-3 * max(abs(high), 1e-9))
    for name, limit in (("minimum", odds.minimum), ("maximum", odds.maximum)):
        value = in_shown(limit, column.unit)
        if value is not None and low - 2 * width <= value <= high + 2 * width:
            panel.rule_x(value, label="limit", seen=True, colour=style.RED, dash=2, width=1.7)
        elif value is not None:
            panel.note(f"{name} {value:g} {unit}: off scale", corner="top left", colour=style.MUTED)
    panel.x.label, panel.y.label, panel.x.grid = unit, "samples", False
    panel.y.ticks = [tick for tick in linear_ticks(0.0, 1.35 * max(counts)) if tick[0].is_integer()]


def _driver_table(result: MonteCarloResult) -> doc.Block:
    """Say of each required figure which tolerances move it most, and between which values."""
    strongest: dict[str, list[Driver]] = {}
    for one in (each for each in result.drivers if each.swing != 0.0):
        strongest.setdefault(one.column, []).append(one)

    def driver(place: int, item: tuple[str, list[Driver]]) -> str:
        if place >= len(item[1]):
            return ""
        one, unit = item[1][place], result.columns[item[0]].unit
        ends = [in_shown(value, unit) for value in (one.low, one.high)]
        texts = ([or_none(value, digits) for value in ends] for digits in range(3, 7))
        return next((f"{one.path}: {low} to {high}" for low, high in texts if low != high), "")

    places = enumerate((("first", "Driven most by"), ("second", "then by"), ("third", "then by")))
    columns = [
        doc.of(lambda item: _words(item[0], result.load_unit), "figure", "Figure"),
        *(doc.of(partial(driver, k), key, label) for k, (key, label) in places),
        doc.of(lambda item: shown_unit(result.columns[item[0]].unit)[0], "unit", "Unit"),
    ]
    note = "The figure with that parameter alone at the low and the high end of its tolerance."
    return doc.listing("Which tolerance drives which figure", strongest.items(), columns, note)


def _worst_table(result: MonteCarloResult) -> doc.Block:
    columns = [doc.column("requirement", "Worst case for"), doc.column("file", "Design file")]
    columns += [doc.column(f"p{k}", path, format="sig:5") for k, path in enumerate(result.paths)]
    rows = []
    for case in result.worst:
        values = (case.parameters[path] for path in result.paths)
        rows.append((case.requirement, "" if case.file is None else case.file.name, *values))
    note = "Each is saved as a design that `report` opens."
    return doc.table("Worst designs, SI values", columns, rows, note)
