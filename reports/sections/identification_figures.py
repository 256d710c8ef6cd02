"""The figures of an identified campaign, as data."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from reports import document as doc
from reports.document import abscissa, rounded
from reports.document_schema import Block
from reports.sections.thinning import kept_rows

if TYPE_CHECKING:
    from analyses.identification.campaign import CampaignResult
    from analyses.identification.surface_fit import SurfaceFit
    from reports.figures import identification_region as identification_region_figure
    from reports.figures import identification_residuals as identification_residuals_figure
    from reports.figures import identification_surface as identification_surface_figure
    from reports.figures import identification_window as identification_window_figure

NAMES = ("C0", "Cv", "CM")


def surface_figure(fit: SurfaceFit) -> Block:
    """Runs and fitted lines over speed."""
    loads = np.array([p.load_Nm for p in fit.points])
    levels: list[identification_surface_figure.Level] = []
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
    result: list[float] = []
    for load in np.sort(loads):
        if not result or load - result[-1] > 0.5:
            result.append(float(load))
    return result[:10]


def residual_figure(fit: SurfaceFit) -> Block:
    """Residuals over speed and load."""
    named = {o.run for o in fit.outliers}
    data: identification_residuals_figure.Data = {
        "speed_rad_s": abscissa([p.speed_rad_s for p in fit.points]),
        "load_Nm": abscissa([p.load_Nm for p in fit.points]),
        "residual_uNm": abscissa(1e6 * fit.own_residuals_Nm),
        "std_uNm": abscissa(1e6 * fit.residual_stds_Nm),
        "outlier": [p.run in named for p in fit.points],
        "run": [p.run for p in fit.points],
    }
    return doc.figure(
        "identification_residuals",
        data,
        caption="Residuals of the runs less the most likely shared errors, with two standard deviations",
        alt="Residual torque of every run against speed and against load",
    )


def region_figure(fit: SurfaceFit) -> Block:
    """Joint 95 % regions of pairs of coefficients."""
    from scipy.stats import chi2

    radius = float(np.sqrt(chi2.ppf(0.95, 2)))
    pairs: list[identification_region_figure.Pair] = []
    for i, j in combinations(fit.told, 2):
        scale = 100.0 / fit.values[[i, j]]
        pairs.append(
            {
                "x_label": f"{NAMES[i]}, % from its value",
                "y_label": f"{NAMES[j]}, %",
                "whole": _ellipse(fit.covariance, i, j, scale, radius),
                "random": _ellipse(fit.random_covariance, i, j, scale, radius),
                "interval": abscissa(fit.half_widths[[i, j]] * scale),
            }
        )
    return doc.figure(
        "identification_region",
        {"pairs": pairs},
        caption="Joint 95 % regions of pairs of coefficients; dotted: the 95 % interval of each alone",
        alt="Ellipses of the uncertainty of pairs of friction coefficients, with and without shared errors",
    )


def _ellipse(
    covariance: np.ndarray, i: int, j: int, scale: np.ndarray, radius: float
) -> identification_region_figure.Outline:
    part = covariance[np.ix_([i, j], [i, j])] * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(part)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.vstack([np.cos(turn), np.sin(turn)])
    x, y = radius * (vectors * np.sqrt(np.maximum(values, 0.0))) @ circle
    return {"x": abscissa(x, 4), "y": abscissa(y, 4)}


def window_figures(result: CampaignResult) -> list[Block]:
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
        data: identification_window_figure.Data = {
            "time_s": abscissa(record.time_s[rows], 6),
            "panels": [{"label": labels[name], "values": rounded(record[name][rows])} for name in shown],
            "window": abscissa([window.start_s, window.stop_s], 6),
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
