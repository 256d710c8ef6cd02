"""The figures of an identified campaign."""

from itertools import combinations

import numpy as np

from analyses.identification.campaign import CampaignResult
from analyses.identification.surface import NAMES, SurfaceFit
from analyses.records.record import Record
from reports import document as doc
from reports.charts import style


def surface_figure(fit: SurfaceFit) -> doc.Block:
    """Runs and fitted lines over speed, a line for each load; runs that were left out are ringed."""
    chart = style.Chart(width=style.WIDE, height=380.0, legend=True)
    panel = chart.panel("motor speed, rad/s", "friction torque at the motor, mN m")
    line = np.linspace(0.0, max(p.speed_rad_s for p in fit.points), 2)
    levels: list[float] = []  # loads that differ by more than 0.5 N m, up to ten
    for load in sorted(p.load_Nm for p in fit.points):
        levels += [load] if not levels or load - levels[-1] > 0.5 else []
    for k, centre in enumerate(levels[:10]):
        here = [p for p in fit.points if abs(p.load_Nm - centre) <= 0.25]
        mean = float(np.mean([p.load_Nm for p in here]))
        label = f"{mean:.2g} N m"
        panel.curve(line, 1e3 * fit.predict_Nm(line, np.full(2, mean)), label, **style.series(k))
        place = [p.speed_rad_s for p in here], [1e3 * p.torque_Nm for p in here]
        panel.points(*place, label, **style.marked(k))
    named = {o.run for o in fit.outliers}
    for point in fit.points:
        if point.run in named:
            _ring(panel, (point.speed_rad_s, 1e3 * point.torque_Nm), point.run, 14.0)
    panel.y.limits(low=0.0)
    caption = "Friction torque of every run and the fitted surface, a line for each load"
    return doc.figure("identification_surface", chart, caption)


def _ring(panel: style.Panel, at: tuple[float, float], words: str, size: float) -> None:
    panel.points([at[0]], [at[1]], size=size, hollow=True, colour=style.RED, read=False)
    panel.note(words, at)


def residual_figure(fit: SurfaceFit) -> doc.Block:
    chart = style.Chart(width=style.WIDE, height=310.0)
    named = {o.run for o in fit.outliers}
    y, std = 1e6 * fit.own_residuals_Nm, 1e6 * fit.residual_stds_Nm
    for quantity, label in (("speed_rad_s", "motor speed, rad/s"), ("load_Nm", "load torque, N m")):
        x = [getattr(point, quantity) for point in fit.points]
        if max(x) <= 0.0:  # nothing over no load
            continue
        panel = chart.panel(label, "residual, µN m")
        panel.rule_y(0.0)
        for at, middle, width in zip(x, y, std, strict=True):
            ends = [middle - 2.0 * width, middle + 2.0 * width]
            panel.curve([at, at], ends, colour=style.MUTED, width=0.9, read=False)
        panel.points(x, y, "runs, with 2 standard deviations", size=5.0)
        for at, value, point in zip(x, y, fit.points, strict=True):
            if point.run in named:
                _ring(panel, (at, float(value)), point.run, 13.0)
    caption = "Residuals of the runs less the most likely shared errors, with two standard deviations"
    return doc.figure("identification_residuals", chart, caption)


def region_figure(fit: SurfaceFit) -> doc.Block:
    """Joint 95 % regions of pairs of coefficients, in percent of their values."""
    radius = float(np.sqrt(-2.0 * np.log(0.05)))  # chi-squared of two degrees of freedom
    chart = style.Chart(width=style.WIDE, height=300.0)
    for i, j in combinations(fit.told, 2):
        scale = 100.0 / fit.values[[i, j]]
        panel = chart.panel(f"{NAMES[i]}, % from its value", f"{NAMES[j]}, %", by_point=True)
        whole = _ellipse(fit.covariance, i, j, scale, radius)
        random = _ellipse(fit.random_covariance, i, j, scale, radius)
        panel.shape([whole], colour=style.BLUE, opacity=0.15)
        panel.curve(*whole, "95 % region, all errors", colour=style.BLUE)
        panel.curve(*random, "scatter of the runs only", colour=style.ORANGE, dash=1)
        x, y = fit.half_widths[[i, j]] * scale
        for sign in (-1.0, 1.0):
            panel.rule_x(sign * x, dash=2)
            panel.rule_y(sign * y, dash=2)
        panel.points([0.0], [0.0], marker="+", size=10.0, colour=style.INK, read=False)
    caption = "Joint 95 % regions of pairs of coefficients; dotted: the 95 % interval of each alone"
    return doc.figure("identification_region", chart, caption)


def _ellipse(
    covariance: np.ndarray, i: int, j: int, scale: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    part = covariance[np.ix_([i, j], [i, j])] * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(part)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.vstack([np.cos(turn), np.sin(turn)])
    x, y = radius * (vectors * np.sqrt(np.maximum(values, 0.0))) @ circle
    return x, y


def window_figures(result: CampaignResult) -> list[doc.Block]:
    """The first, the middle and the last run with their steady part marked; the others on demand."""
    runs = {run.id: run for run in result.imported.runs}
    points, figures = result.fit.points, []
    for k in dict.fromkeys((len(points) - 1, 0, len(points) // 2)):
        run, window = points[k].run, points[k].window
        chart = _window(runs[run].record, window.start_s, window.stop_s)
        caption = f"Run {run}, the steady part marked: slope at most {window.limit_rad_s2:.3g} rad/s²"
        figures.append(doc.figure("identification_window", chart, caption))
    more = [doc.details("The first and the middle run", figures[1:])] if len(figures) > 1 else []
    return [*figures[:1], *more]


def _window(record: Record, start_s: float, stop_s: float) -> style.Chart:
    """Draw each signal in a panel of its own, the steady part shaded."""
    labels = {"speed": "speed, rad/s", "current": "current, A", "torque": "torque, N m"}
    shown = [name for name in labels if name in record.signals]
    rows = style.kept_rows([record[name] for name in shown])
    chart = style.Chart(width=style.WIDE, height=60.0 + 120.0 * len(shown))
    panels = chart.column(*(1.0 for _ in shown))
    for k, (panel, name) in enumerate(zip(panels, shown, strict=True)):
        panel.curve(record.time_s[rows], record[name][rows], colour=style.SERIES[k % 7], width=1.1)
        panel.band_x(start_s, stop_s, colour=style.RED, opacity=0.1)
        for edge in (start_s, stop_s):
            panel.rule_x(edge, colour=style.RED, width=1.2, dash=1)
        panel.y.label = labels[name]
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(record.time_s[rows][0], record.time_s[rows][-1])
    return chart
