"""The identification of a campaign: coefficients, runs, residuals, contributions, what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from reports import document as doc
from reports.document_schema import Block, Row, Section, Status
from reports.numbers import show
from reports.sections.identification_figures import (
    NAMES,
    region_figure,
    residual_figure,
    surface_figure,
    window_figures,
)
from reports.sections.identification_inputs import campaign_table, verdict_block, verdict_words

if TYPE_CHECKING:
    from analyses.campaign_design import CampaignSuggestion
    from analyses.identification.campaign import CampaignResult
    from analyses.identification.contributions import Contribution
    from analyses.identification.richer import RicherLaws
    from analyses.identification.surface_fit import SurfaceFit
    from analyses.identification.verdict import Item

SHOWN = (("mN m", 1e3), ("µN m s/rad", 1e6), ("mN m/(N m)", 1e3))
MEANING = ("static", "viscous", "load")


def section(
    result: CampaignResult,
    shares: Sequence[Contribution],
    suggestion: CampaignSuggestion | None = None,
    items: Sequence[Item] = (),
    *,
    load_Nm: float,
    speed_rad_s: float,
) -> Section:
    """Make the section of a campaign's result."""
    fit = result.fit
    blocks = [
        *([verdict_block(items)] if items else []),
        coefficient_table(fit),
        contribution_table(shares, load_Nm, speed_rad_s),
        surface_figure(fit),
        *([region_figure(fit)] if len(fit.told) > 1 else []),
        residual_figure(fit),
        *window_figures(result),
        shared_table(fit),
    ]
    if result.laws is not None:
        blocks.append(law_table(result.laws))
    if suggestion is not None:
        blocks += suggestion_blocks(suggestion)
    blocks += [*account_blocks(result), campaign_table(result)]
    blocks.append(doc.details("Every run", [run_table(result)]))
    status: Status = "fail" if any(item.passed is False for item in items) else "info"
    words = verdict_words(items, _result(fit))
    return doc.section(
        "identification", "Identified friction", blocks, result=words, intro=_intro(result), status=status
    )


def _result(fit: SurfaceFit) -> str:
    parts = []
    for k, (unit, scale) in enumerate(SHOWN):
        value = show(float(fit.values[k]) * scale, "sig:4")
        std = show(float(fit.standard_errors[k]) * scale, "sig:2")
        told = f"{value} {unit} (fixed)" if NAMES[k] in fit.held else f"{value} ± {std} {unit}"
        parts.append(f"{NAMES[k]} = {told}")
    return f"{', '.join(parts)}, from {len(fit.points)} runs."


def _intro(result: CampaignResult) -> str:
    fit = result.fit
    return (
        f"{len(fit.points)} of {result.runs_listed} runs, "
        f"{result.imported.rows_in} rows in, {result.imported.rows_out} out. "
        f"M = kM i with kM = {result.torque_constant_Nm_A:g} N m/A, averaged over the steady part of each "
        "run "
        f"({result.criterion}), then M = C0 + Cv w + CM |M_ext| with errors in all variables."
        + "".join(f" {name} is not fitted: {why}." for name, why in fit.held.items())
    )


def coefficient_table(fit: SurfaceFit) -> Block:
    """Values, standard errors and 95 % intervals."""
    columns = [
        doc.column("name", "Coefficient"),
        doc.column("value", "Value", format="sig:5"),
        doc.column("std", "Standard error", format="sig:2"),
        doc.column("low", "95 % from", format="sig:5"),
        doc.column("high", "to", format="sig:5"),
        doc.column("unit", "Unit"),
        doc.column("scatter", "Share of scatter", "%", format="fix:0"),
        doc.column("c0", "r with C0", format="fix:2"),
        doc.column("cv", "r with Cv", format="fix:2"),
    ]
    rows = []
    whole = np.diag(fit.covariance)
    random = np.diag(fit.random_covariance) / np.where(whole > 0.0, whole, 1.0)
    for k, (unit, scale) in enumerate(SHOWN):
        row: Row = {
            "name": f"{NAMES[k]}, {MEANING[k]}",
            "value": fit.values[k] * scale,
            "std": fit.standard_errors[k] * scale,
            "low": fit.intervals[k, 0] * scale,
            "high": fit.intervals[k, 1] * scale,
            "unit": unit,
            "scatter": 100.0 * random[k],
        }
        if NAMES[k] in fit.held:
            row |= {"std": None, "low": None, "high": None, "scatter": None}
            row["name"] = f"{row['name']}, not fitted"
        row |= {
            key: fit.correlation[k, j]
            for j, key in enumerate(("c0", "cv"))
            if j < k and {k, j} <= set(fit.told)
        }
        rows.append(row)
    note = (
        "Intervals by propagated distributions (GUM Supplement 1): Student for the scatter of the runs, "
        "uniform for the "
        "instruments' shared errors."
    )
    return doc.table("Friction coefficients", columns, rows, note)


def contribution_table(shares: Sequence[Contribution], load_Nm: float, speed_rad_s: float) -> Block:
    """Table 1 of the paper."""
    columns = [
        doc.column("name", "Term"),
        doc.column("torque", "Torque", "mN m", format="sig:4"),
        doc.column("share", "Share", "%", format="fix:1"),
        doc.column("std", "Standard error", "%", format="fix:2"),
    ]
    terms = ("C0", "Cv w", "CM |M_ext|")
    rows = [
        {"name": term, "torque": 1e3 * s.torque_Nm, "share": 100.0 * s.share, "std": 100.0 * s.share_std}
        for term, s in zip(terms, shares, strict=True)
    ]
    return doc.table(f"Contributions at {load_Nm:g} N m and {speed_rad_s:g} rad/s", columns, rows)


def shared_table(fit: SurfaceFit) -> Block:
    """What the bound of each shared error does to each coefficient."""
    columns = [doc.column("name", "Systematic error, at its bound")]
    columns += [doc.column(name, name, "%", format="fix:3") for name in NAMES]
    rows = [
        {"name": name, **{n: 100.0 * s / v for n, s, v in zip(NAMES, shift, fit.values, strict=True) if v}}
        for name, shift in fit.shared_shifts.items()
    ]
    note = (
        f"Scatter between runs beyond their own noise: {1e6 * fit.run_scatter_Nm:.2g} µN m; "
        f"Birge ratio without it {fit.birge_ratio:.2f} (1: the noise explains the residuals)."
    )
    return doc.table("Systematic errors", columns, rows, note)


def law_table(laws: RicherLaws) -> Block:
    """Richer laws by cross-validation."""
    columns = [
        doc.column("name", "Law"),
        doc.column("formula", "Terms"),
        doc.column("error", "Error, unseen runs", "µN m", format="sig:3"),
        doc.column("gain", "Squared error less by", "%", format="fix:1"),
        doc.column("std", "± standard error", "%", format="fix:1"),
        doc.column("verdict", "Warranted"),
    ]
    rows = []
    for score in laws.scores:
        verdict = "–" if score.name == "plain" else "yes" if score.warranted else score.reason or "no"
        row: Row = {"name": score.name, "formula": score.formula, "verdict": verdict}
        if score.possible:
            row |= {
                "error": 1e6 * score.error_Nm,
                "gain": 100.0 * score.gain,
                "std": 100.0 * score.gain_std,
            }
        rows.append(row)
    note = (
        f"Cross-validation over {laws.folds} folds of runs; a law is warranted where it predicts runs it "
        "has not "
        f"seen better by twice the standard error and 5 %. Chosen: {laws.best}."
    )
    return doc.table("Is a richer law warranted?", columns, rows, note)


def suggestion_blocks(suggestion: CampaignSuggestion) -> list[Block]:
    """What to measure next, and for which margins."""
    columns = [
        doc.column("order", "Run"),
        doc.column("speed", "Speed", "rad/s", format="fix:1"),
        doc.column("load", "Load", "N m", format="fix:2"),
        doc.column("remaining", "Random variance remaining", "%", format="fix:1"),
    ]
    rows = _grouped(suggestion)
    note = ""
    if suggestion.largest_shared is not None:
        note = (
            f"{100.0 * suggestion.shared_part:.0f} % of the margins' variance comes from errors that all "
            "runs share "
            f"and no further run reduces; the largest is the {suggestion.largest_shared}."
        )
    margins = [
        doc.column("label", "Margin"),
        doc.column("value", "Value", format="sig:4"),
        doc.column("std", "Standard deviation", format="sig:2"),
        doc.column("floor", "Systematic part", format="sig:2"),
        doc.column("unit", "Unit"),
    ]
    spread = [
        {"label": m.label, "value": m.value, "std": m.std, "floor": m.floor_std, "unit": m.unit}
        for m in suggestion.margins
    ]
    goal = "the margins'" if suggestion.criterion == "margins" else "the coefficients'"
    return [
        doc.table(f"Runs that would shrink {goal} uncertainty most", columns, rows),
        *([doc.text(note)] if note else []),
        doc.table("Margins and their uncertainty from the friction, slow motion", margins, spread),
    ]


def _grouped(suggestion: CampaignSuggestion) -> list[Row]:
    """Suggested runs, the same point several times in one row."""
    rows: list[Row] = []
    for point, runs in groupby(suggestion.runs, key=lambda run: (run.speed_rad_s, run.load_Nm)):
        same = list(runs)
        first, last = same[0].order, same[-1].order
        order = str(first) if first == last else f"{first} to {last}"
        rows.append(
            {"order": order, "speed": point[0], "load": point[1], "remaining": 100.0 * same[-1].remaining}
        )
    return rows


def account_blocks(result: CampaignResult) -> list[Block]:
    """Outliers and runs set aside, by name."""
    blocks = []
    if result.fit.outliers:
        columns = [
            doc.column("run", "Outlier, run"),
            doc.column("size", "Residual, standard deviations", format="fix:1"),
            doc.column("limit", "Limit", format="fix:1"),
            doc.column("state", "Treatment"),
        ]
        rows = [
            {
                "run": o.run,
                "size": o.standardised,
                "limit": o.limit,
                "state": "set aside" if o.set_aside else "kept",
            }
            for o in result.fit.outliers
        ]
        blocks.append(doc.table("Outliers", columns, rows))
    else:
        blocks.append(doc.text("No run is an outlier."))
    if result.set_aside:
        columns = [doc.column("run", "Run"), doc.column("reason", "Reason")]
        aside = [{"run": run.id, "reason": run.reason, "_status": "warn"} for run in result.set_aside]
        blocks.append(doc.table("Runs set aside", columns, aside))
    else:
        blocks.append(doc.text("No run was set aside."))
    return blocks


def run_table(result: CampaignResult) -> Block:
    """One row a run: means, window, rows, clock."""
    columns = [
        doc.column("run", "Run"),
        doc.column("speed", "Speed", "rad/s", format="fix:2"),
        doc.column("load", "Load", "N m", format="fix:3"),
        doc.column("torque", "Torque", "mN m", format="fix:4"),
        doc.column("residual", "Residual", "µN m", format="fix:2"),
        doc.column("std", "σ", "µN m", format="fix:2"),
        doc.column("start", "Steady from", "s", format="fix:2"),
        doc.column("stop", "to", "s", format="fix:2"),
        doc.column("rows", "Rows in, out"),
        doc.column("clock", "Clock of the sensor"),
    ]
    runs = {run.id: run for run in result.imported.runs}
    rows = []
    residuals = zip(result.fit.residuals_Nm, result.fit.residual_stds_Nm, strict=True)
    for point, (residual, std) in zip(result.fit.points, residuals, strict=True):
        run = runs[point.run]
        rows.append(
            {
                "run": point.run,
                "speed": point.direction * point.speed_rad_s,
                "load": point.load_Nm,
                "torque": 1e3 * point.torque_Nm,
                "residual": 1e6 * residual,
                "std": 1e6 * std,
                "start": point.window.start_s,
                "stop": point.window.stop_s,
                "rows": str(run.record.counts),
                "clock": "; ".join(run.record.notes) or "one recorder",
            }
        )
    return doc.table("Runs", columns, rows)
