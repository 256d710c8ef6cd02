"""Odds, distributions and worst cases of a Monte Carlo study, for the page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from reports import document as doc
from reports.document_schema import Block, Section, Status, VerdictItem
from reports.sections.margins import finite

if TYPE_CHECKING:
    from analyses.monte_carlo import ColumnStatistics, MonteCarloResult, Odds, WorstCase
    from reports.figures import distribution as distribution_figure

ODDS_COLUMNS = [
    doc.column("label", "Requirement"),
    doc.column("limit", "Limit"),
    doc.column("probability", "Probability met", "%", format="fix:3", better=1),
    doc.column("low", "95 % lower bound", "%", format="fix:3"),
    doc.column("high", "95 % upper bound", "%", format="fix:3"),
    doc.column("nominal", "Nominal", format="sig:4"),
    doc.column("sampled", "Worst sample", format="sig:4"),
    doc.column("number", "No.", align="right"),
    doc.column("worst", "Worst case", format="sig:4"),
    doc.column("unit", "Unit"),
]
FIGURE_COLUMNS = [
    doc.column("figure", "Figure"),
    doc.column("unit", "Unit"),
    doc.column("minimum", "Min", format="sig:4"),
    doc.column("q01", "1 %", format="sig:4"),
    doc.column("q05", "5 %", format="sig:4"),
    doc.column("q50", "50 %", format="sig:4"),
    doc.column("q95", "95 %", format="sig:4"),
    doc.column("q99", "99 %", format="sig:4"),
    doc.column("maximum", "Max", format="sig:4"),
    doc.column("mean", "Mean", format="sig:4"),
    doc.column("std", "Std", format="sig:3"),
    doc.column("missing", "Missing", align="right"),
]
_SHOWN = {"q01": 0.01, "q05": 0.05, "q50": 0.5, "q95": 0.95, "q99": 0.99}


def section(result: MonteCarloResult, at_least: float | None = None) -> Section:
    """Make the section.

    Parameters
    ----------
    result : MonteCarloResult
    at_least : float, optional
        Probability to be met with 95 % confidence; without it every sample and the worst case must pass.
    """
    items = [_verdict(odds, _case(result, odds), at_least) for odds in result.odds if odds.id != "all"]
    blocks: list[Block] = [doc.verdicts(items, what="odds")] if items else []
    if result.odds:
        blocks.append(_odds_table(result))
        blocks += _figures(result)
    blocks.append(_figure_table(result.columns.values()))
    if result.worst:
        blocks.append(doc.details("Parameters of the worst cases", [_worst_table(result)]))
    blocks += [doc.remark(note) for note in result.notes]
    blocks.append(doc.facts([
        doc.fact("Samples", result.samples), doc.fact("Seed", result.seed),
        doc.fact("Parameters that vary", ", ".join(result.paths)),
    ]))  # fmt: skip
    failed = any(item["verdict"] == "not met" for item in items)
    intro = (
        f"{result.samples} designs drawn from the tolerances; sampled loops. An optimiser seeks the worst "
        "case in "
        "the whole tolerance box, as sampling alone does not find it."
    )
    status: Status = "fail" if failed else "info"
    return doc.section(
        "monte-carlo", "Tolerances", blocks, result=_result(result), intro=intro, status=status
    )


def _result(result: MonteCarloResult) -> str:
    """Say how many samples meet everything, and which requirement fails most often."""
    every = next((odds for odds in result.odds if odds.id == "all"), None)
    if every is None:
        return f"The design states no requirement; {result.samples} samples were drawn."
    words = f"{every.passed} of {every.count} samples meet every requirement"
    weakest = min(
        (odds for odds in result.odds if odds.id != "all"), key=lambda odds: odds.probability, default=None
    )
    if weakest is None or weakest.probability == 1.0:
        return f"{words}."
    return (
        f"{words}; the one missed most often is {weakest.label} ({100.0 * weakest.probability:.3g} % meet "
        "it)."
    )


def _case(result: MonteCarloResult, odds: Odds) -> WorstCase | None:
    return next((case for case in result.worst if case.requirement == odds.id), None)


def _verdict(odds: Odds, case: WorstCase | None, at_least: float | None) -> VerdictItem:
    """Judge one requirement by its odds."""
    wanted = 1.0 if at_least is None else at_least
    if at_least is None:
        passed = odds.passed == odds.count and (case is None or case.passed)
        reason = "" if passed else _why(odds, case)
    else:
        passed = odds.low >= at_least
        reason = f"{100 * odds.low:.3f} % with 95 % confidence"
    return doc.verdict(
        f"tolerance/{odds.id}",
        f"{odds.label}: met within the tolerances",
        value=100.0 * odds.probability,
        limit=100.0 * wanted,
        unit="%",
        distance=100.0 * ((odds.low if at_least is not None else odds.probability) - wanted),
        passed=passed,
        reason=reason,
        comparison=">=",
    )


def _why(odds: Odds, case: WorstCase | None) -> str:
    if odds.passed < odds.count:
        return f"{odds.count - odds.passed} of {odds.count} samples fail, worst is number {odds.worst_sample}"
    if case is None or case.value is None:
        return "every sample passes, but a loop is unstable in the worst case of the tolerance box"
    return f"every sample passes, but the worst case of the tolerance box fails: {case.value:.4g} {case.unit}"


def _limit(odds: Odds) -> str:
    parts = []
    if odds.minimum is not None:
        parts.append(f"≥ {odds.minimum:g} {odds.unit}")
    if odds.maximum is not None:
        parts.append(f"≤ {odds.maximum:g} {odds.unit}")
    return ", ".join(parts)


def _odds_table(result: MonteCarloResult) -> Block:
    rows = []
    for odds in result.odds:
        case = _case(result, odds)
        rows.append({
            "label": odds.label, "limit": _limit(odds), "probability": 100 * odds.probability,
            "low": 100 * odds.low, "high": 100 * odds.high, "nominal": finite(odds.nominal),
            "sampled": finite(odds.worst), "number": odds.worst_sample,
            "worst": None if case is None else finite(case.value), "unit": odds.unit,
            "_status": "pass" if odds.passed == odds.count and (case is None or case.passed) else "fail",
        })  # fmt: skip
    note = "A dash in the worst case: not computed, or a loop is unstable there."
    return doc.table("Odds of meeting each requirement", ODDS_COLUMNS, rows, note)


def _figure_table(columns: Iterable[ColumnStatistics]) -> Block:
    rows = []
    for c in columns:
        known = dict(zip(c.shares, c.quantiles, strict=True))
        rows.append({
            "figure": _words(c.name), "unit": "" if c.unit == "1" else c.unit, "minimum": finite(c.minimum),
            "maximum": finite(c.maximum), "mean": finite(c.mean), "std": finite(c.std), "missing": c.missing,
            **{key: finite(known.get(share)) for key, share in _SHOWN.items()},
        })  # fmt: skip
    note = (
        "Quantiles are values of samples. Missing: samples without such a figure (unstable, or not reached)."
    )
    return doc.table("Distribution of every figure", FIGURE_COLUMNS, rows, note)


def _words(name: str) -> str:
    """Name a column for people.

    Examples
    --------
    >>> _words("position.phase_margin"), _words("drive.output_rate@8")
    ('position loop: phase margin', 'drive: output rate at 8 N m')
    """
    where, _, what = name.partition(".")
    figure, _, load = what.replace("_", " ").partition("@")
    place = where if where in ("drive", "nonlinear") else f"{where} loop"
    return f"{'nonlinear step' if place == 'nonlinear' else place}: {figure}" + (
        f" at {load} N m" if load else ""
    )


def _figures(result: MonteCarloResult) -> list[Block]:
    """Draw the distribution behind every requirement, three a figure."""
    panels = [panel for odds in result.odds if odds.id != "all" for panel in _panels(result, odds)]
    blocks = []
    for first in range(0, len(panels), 3):
        part = panels[first : first + 3]
        names = ", ".join(panel["label"] for panel in part)
        blocks.append(
            doc.figure(
                "distribution", {"panels": part}, caption=f"Distribution within the tolerances: {names}.",
                alt=f"Histograms of {names} with nominal design, worst case and limit.",
            )
        )  # fmt: skip
    return blocks


def _panels(result: MonteCarloResult, odds: Odds) -> list[distribution_figure.Histogram]:
    """Give the columns that a requirement looks at."""
    case = _case(result, odds)
    panels: list[distribution_figure.Histogram] = []
    for name in odds.columns:
        column = result.columns[name]
        if len(column.counts) < 2:
            continue  # the same in every sample: nothing to draw
        alone = len(odds.columns) == 1
        panels.append({
            "label": _words(name), "unit": "" if column.unit == "1" else column.unit,
            "edges": [e for e in column.edges if math.isfinite(e)], "counts": list(column.counts),
            "nominal": finite(result.nominal.get(name)),
            "worst": finite(case.value) if case is not None and alone else None,
            "minimum": odds.minimum, "maximum": odds.maximum,
        })  # fmt: skip
    return panels


def _worst_table(result: MonteCarloResult) -> Block:
    columns = [doc.column("requirement", "Worst case for"), doc.column("file", "Design file")]
    columns += [doc.column(f"p{k}", path, format="sig:5") for k, path in enumerate(result.paths)]
    rows: list[Mapping[str, Any]] = [
        {
            "requirement": case.requirement,
            "file": "" if case.file is None else case.file.name,
            **{f"p{k}": case.parameters[path] for k, path in enumerate(result.paths)},
        }
        for case in result.worst
    ]
    return doc.table(
        "Worst designs, SI values", columns, rows, "Each is saved as a design that `report` opens."
    )
