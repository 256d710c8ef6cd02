"""The identification of a campaign: coefficients, runs, residuals, contributions, what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from reports import document as doc
from reports.document import rounded
from reports.sections.thinning import kept_rows

if TYPE_CHECKING:
    from analyses.campaign_design import CampaignSuggestion
    from analyses.identification.campaign import CampaignResult
    from analyses.identification.contributions import Contribution
    from analyses.identification.richer import RicherLaws
    from analyses.identification.surface import SurfaceFit

NAMES = ("C0", "Cv", "CM")
SHOWN = (("mN m", 1e3), ("µN m s/rad", 1e6), ("mN m/(N m)", 1e3))
MEANING = ("static", "viscous", "load")


def section(
    result: CampaignResult,
    shares: Sequence[Contribution],
    suggestion: CampaignSuggestion | None = None,
    *,
    load_Nm: float,
    speed_rad_s: float,
) -> dict[str, Any]:
    """Make the section of a campaign's result."""
    fit = result.fit
    blocks = [
        coefficient_table(fit),
        contribution_table(shares, load_Nm, speed_rad_s),
        _surface_figure(fit),
        _region_figure(fit),
        _residual_figure(fit),
        *_window_figures(result),
        shared_table(fit),
    ]
    if result.laws is not None:
        blocks.append(law_table(result.laws))
    if suggestion is not None:
        blocks += suggestion_blocks(suggestion)
    blocks += [*account_blocks(result), doc.details("Every run", [run_table(result)])]
    return doc.section("identification", "Identified friction", blocks, intro=_intro(result))


def _intro(result: CampaignResult) -> str:
    fit = result.fit
    return (
        f"{len(fit.points)} of {result.runs_listed} runs, "
        f"{result.imported.rows_in} rows in, {result.imported.rows_out} out. "
        f"M = kM i with kM = {result.torque_constant_Nm_A:g} N m/A, averaged over the steady part of each "
        "run "
        f"({result.criterion}), then M = C0 + Cv w + CM |M_ext| with errors in all variables."
    )


def coefficient_table(fit: SurfaceFit) -> dict[str, Any]:
    """Values, standard errors and 95 % intervals."""
    columns = [
        doc.column("name", "Coefficient"),
        doc.column("value", "Value", format="sig:5"),
        doc.column("std", "Standard error", format="sig:2"),
        doc.column("low", "95 % from", format="sig:5"),
        doc.column("high", "to", format="sig:5"),
        doc.column("unit", "Unit"),
        doc.column("scatter", "of it scatter", "%", format="fix:0"),
        doc.column("c0", "r with C0", format="fix:2"),
        doc.column("cv", "r with Cv", format="fix:2"),
    ]
    rows = []
    random = np.diag(fit.random_covariance) / np.diag(fit.covariance)
    for k, (unit, scale) in enumerate(SHOWN):
        row: dict[str, Any] = {
            "name": f"{NAMES[k]}, {MEANING[k]}",
            "value": fit.values[k] * scale,
            "std": fit.standard_errors[k] * scale,
            "low": fit.intervals[k, 0] * scale,
            "high": fit.intervals[k, 1] * scale,
            "unit": unit,
            "scatter": 100.0 * random[k],
        }
        row |= {key: fit.correlation[k, j] for j, key in enumerate(("c0", "cv")) if j < k}
        rows.append(row)
    note = (
        "Intervals by propagated distributions (GUM Supplement 1): Student for the scatter of the runs, "
        "uniform for the "
        "instruments' shared errors."
    )
    return doc.table("Friction coefficients", columns, rows, note)


def contribution_table(shares: Sequence[Contribution], load_Nm: float, speed_rad_s: float) -> dict[str, Any]:
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


def shared_table(fit: SurfaceFit) -> dict[str, Any]:
    """What the bound of each shared error does to each coefficient."""
    columns = [doc.column("name", "Shared error, at its bound")]
    columns += [doc.column(name, name, "%", format="fix:3") for name in NAMES]
    rows = [
        {"name": name, **{n: 100.0 * s / v for n, s, v in zip(NAMES, shift, fit.values, strict=True)}}
        for name, shift in fit.shared_shifts.items()
    ]
    note = (
        f"Scatter between runs beyond their own noise: {1e6 * fit.run_scatter_Nm:.2g} µN m; "
        f"Birge ratio without it {fit.birge_ratio:.2f} (1: the noise explains the residuals)."
    )
    return doc.table("Errors that all runs share", columns, rows, note)


def law_table(laws: RicherLaws) -> dict[str, Any]:
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
        row: dict[str, Any] = {"name": score.name, "formula": score.formula, "verdict": verdict}
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


def suggestion_blocks(suggestion: CampaignSuggestion) -> list[dict[str, Any]]:
    """What to measure next, and for which margins."""
    columns = [
        doc.column("order", "Run"),
        doc.column("speed", "Speed", "rad/s", format="fix:1"),
        doc.column("load", "Load", "N m", format="fix:2"),
        doc.column("remaining", "Random variance left", "%", format="fix:1"),
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
        doc.column("floor", "of it shared errors", format="sig:2"),
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


def _grouped(suggestion: CampaignSuggestion) -> list[dict[str, Any]]:
    """Suggested runs, the same point several times in one row."""
    rows: list[dict[str, Any]] = []
    for point, runs in groupby(suggestion.runs, key=lambda run: (run.speed_rad_s, run.load_Nm)):
        same = list(runs)
        first, last = same[0].order, same[-1].order
        order = str(first) if first == last else f"{first} to {last}"
        rows.append(
            {"order": order, "speed": point[0], "load": point[1], "remaining": 100.0 * same[-1].remaining}
        )
    return rows


def account_blocks(result: CampaignResult) -> list[dict[str, Any]]:
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


def run_table(result: CampaignResult) -> dict[str, Any]:
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


def _surface_figure(fit: SurfaceFit) -> dict[str, Any]:
    loads = np.array([p.load_Nm for p in fit.points])
    levels = []
    for centre in _levels(loads):
        here = [p for p in fit.points if abs(p.load_Nm - centre) <= 0.25]
        mean = float(np.mean([p.load_Nm for p in here]))
        line = np.linspace(0.0, max(p.speed_rad_s for p in fit.points), 2)
        levels.append(
            {
                "label": f"{mean:.2g} N m",
                "speed_rad_s": rounded([p.speed_rad_s for p in here]),
                "torque_mNm": rounded([1e3 * p.torque_Nm for p in here]),
                "line_speed_rad_s": rounded(line),
                "line_torque_mNm": rounded(1e3 * fit.predict_Nm(line, np.full(2, mean))),
            }
        )
    named = {o.run for o in fit.outliers}
    outliers = [
        {"run": p.run, "speed_rad_s": p.speed_rad_s, "torque_mNm": 1e3 * p.torque_Nm}
        for p in fit.points
        if p.run in named
    ]
    return doc.figure(
        "identification_surface",
        {"levels": levels, "outliers": outliers},
        caption="Friction torque of every run and the fitted surface, a line for each load",
        alt="Measured friction torque against motor speed at several loads, with straight fitted lines",
    )


def _levels(loads: np.ndarray) -> list[float]:
    """Loads that differ by more than 0.5 N m, up to ten."""
    found: list[float] = []
    for load in np.sort(loads):
        if not found or load - found[-1] > 0.5:
            found.append(float(load))
    return found[:10]


def _residual_figure(fit: SurfaceFit) -> dict[str, Any]:
    named = {o.run for o in fit.outliers}
    data = {
        "speed_rad_s": rounded([p.speed_rad_s for p in fit.points]),
        "load_Nm": rounded([p.load_Nm for p in fit.points]),
        "residual_uNm": rounded(1e6 * fit.own_residuals_Nm),
        "std_uNm": rounded(1e6 * fit.residual_stds_Nm),
        "outlier": [p.run in named for p in fit.points],
        "run": [p.run for p in fit.points],
    }
    return doc.figure(
        "identification_residuals",
        data,
        caption="Residuals of the runs less the most likely shared errors, with two standard deviations",
        alt="Residual torque of every run against speed and against load",
    )


def _region_figure(fit: SurfaceFit) -> dict[str, Any]:
    from scipy.stats import chi2

    radius = float(np.sqrt(chi2.ppf(0.95, 2)))
    pairs = []
    for i, j in ((0, 1), (0, 2), (1, 2)):
        scale = 100.0 / fit.values[[i, j]]
        pairs.append(
            {
                "x_label": f"{NAMES[i]}, % from its value",
                "y_label": f"{NAMES[j]}, %",
                "whole": _ellipse(fit.covariance, i, j, scale, radius),
                "random": _ellipse(fit.random_covariance, i, j, scale, radius),
                "interval": rounded(fit.half_widths[[i, j]] * scale),
            }
        )
    return doc.figure(
        "identification_region",
        {"pairs": pairs},
        caption="Joint 95 % regions of pairs of coefficients; dotted: the 95 % interval of each alone",
        alt="Ellipses of the uncertainty of pairs of friction coefficients, with and without shared errors",
    )


def _ellipse(covariance: np.ndarray, i: int, j: int, scale: np.ndarray, radius: float) -> dict[str, Any]:
    part = covariance[np.ix_([i, j], [i, j])] * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(part)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.vstack([np.cos(turn), np.sin(turn)])
    x, y = radius * (vectors * np.sqrt(np.maximum(values, 0.0))) @ circle
    return {"x": rounded(x, 4), "y": rounded(y, 4)}


def _window_figures(result: CampaignResult) -> list[dict[str, Any]]:
    """The first, the middle and the last run with their steady part marked; the others on demand."""
    runs = {run.id: run for run in result.imported.runs}
    points = result.fit.points
    chosen = dict.fromkeys((len(points) - 1, 0, len(points) // 2))
    figures = []
    for k in chosen:
        record, window = runs[points[k].run].record, points[k].window
        shown = [name for name in ("speed", "current", "torque") if name in record.signals]
        rows = kept_rows([record[name] for name in shown])
        labels = {"speed": "speed, rad/s", "current": "current, A", "torque": "torque, N m"}
        data = {
            "time_s": rounded(record.time_s[rows], 6),
            "panels": [{"label": labels[name], "values": rounded(record[name][rows])} for name in shown],
            "window": rounded([window.start_s, window.stop_s], 6),
        }
        caption = (
            f"Run {points[k].run}, the steady part marked: slope at most {window.limit_rad_s2:.3g} rad/s²"
        )
        alt = f"Speed, current and torque of run {points[k].run} over time with the steady part shaded"
        figures.append(doc.figure("identification_window", data, caption=caption, alt=alt))
    return (
        [figures[0], doc.details("The first and the middle run", figures[1:])]
        if len(figures) > 1
        else figures
    )
