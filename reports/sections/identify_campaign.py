"""The identification of a campaign: coefficients, runs, residuals, contributions, what to measure next."""

from collections.abc import Callable, Sequence
from itertools import combinations, groupby

import numpy as np

from analyses.identification.campaign import CampaignResult
from analyses.identification.campaign_design import CampaignSuggestion
from analyses.identification.richer import LawScore, RicherLaws
from analyses.identification.run import CampaignAnswer
from analyses.identification.surface import NAMES, SurfaceFit
from analyses.records.record import Record
from reports import document as doc
from reports.charts import style
from reports.sections import identified


def section(answer: CampaignAnswer) -> doc.Section:
    result, fit = answer.result, answer.result.fit
    blocks = [coefficient_table(fit), contribution_table(answer), surface_figure(fit)]
    blocks += [region_figure(fit)] if len(fit.determined) > 1 else []
    blocks += [residual_figure(fit), *window_figures(result), shared_table(fit)]
    blocks += [law_table(result.laws)] if result.laws is not None else []
    blocks += suggestion_blocks(answer.suggestion) if answer.suggestion is not None else []
    blocks += [*account_blocks(result), identified.input_table("Inputs of all runs", result.inputs)]
    blocks.append(doc.details("Every run", [run_table(result)]))
    intro = (
        f"{len(fit.points)} of {result.runs_listed} runs, {result.rows_in} rows in, {result.rows_out} out. "
        f"M = kM i with kM = {result.torque_constant_Nm_A:g} N m/A, averaged over the steady part of each "
        f"run ({result.criterion}), then M = C0 + Cv w + CM |M_ext| with errors in all variables."
    )
    found = ", ".join(f"{name} = {identified.value_words(fit, name)}" for name in NAMES)
    words = f"{found}{identified.constant_words(fit)}, from {len(fit.points)} runs."
    id, title = "identification", "Identified friction"
    return identified.judged(id, title, answer, blocks, result=words, intro=intro)


def coefficient_table(fit: SurfaceFit) -> doc.Block:
    random = np.diag(fit.random_covariance) / np.maximum(np.diag(fit.covariance), 1e-300)
    scatter = dict(zip(NAMES, (100.0 * random).tolist(), strict=True))
    more = [doc.of(scatter.get, "scatter", "Share of scatter", "%", format="fix:0")]
    for j, (key, name) in enumerate((("c0", "C0"), ("cv", "Cv"))):
        both = {
            NAMES[k]: float(fit.correlation[k, j]) for k in fit.determined if j < k and j in fit.determined
        }
        more.append(doc.of(both.get, key, f"r with {name}", format="fix:2"))
    note = (
        "Intervals by propagated distributions (GUM Supplement 1): Student for the scatter of the runs, "
        "uniform for the instruments' shared errors."
    )
    return identified.parameter_table("Friction coefficients", fit, note, more=more)


def contribution_table(answer: CampaignAnswer) -> doc.Block:
    """Table 1 of the paper."""
    terms = {"C0": "C0", "Cv": "Cv w", "CM": "CM |M_ext|"}
    columns = [
        doc.of(lambda one: terms[one.name], "name", "Term"),
        doc.of("torque_Nm", "torque", "Torque", "mN m", scale=1e3, format="sig:4"),
        doc.of("share", "share", "Share", "%", scale=100.0, format="fix:1"),
        doc.of("share_std", "std", "Standard error", "%", scale=100.0, format="fix:2"),
    ]
    caption = f"Contributions at {answer.load_Nm:g} N m and {answer.speed_rad_s:g} rad/s"
    return doc.listing(caption, answer.shares, columns)


def shared_table(fit: SurfaceFit) -> doc.Block:
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


def law_table(laws: RicherLaws) -> doc.Block:

    def verdict(one: LawScore) -> str:
        no = "no, not determined by these runs" if hopeless(one) else "no"
        return "–" if one.name == "plain" else "yes" if one.warranted else one.reason or no

    def hopeless(one: LawScore) -> bool:
        """More than a hundred times the plain law's squared error."""
        return one.gain is not None and one.gain < -100.0

    def gain(name: str) -> Callable[[LawScore], float | None]:
        return lambda one: None if hopeless(one) else getattr(one, name)

    columns = [
        doc.of("name", "name", "Law"),
        doc.of("formula", "formula", "Terms"),
        doc.of("error_Nm", "error", "Error, unseen runs", "µN m", scale=1e6, format="sig:3"),
        doc.of(gain("gain"), "gain", "Squared error less by", "%", scale=100.0, format="fix:1"),
        doc.of(gain("gain_std"), "std", "± standard error", "%", scale=100.0, format="fix:1"),
        doc.of(verdict, "verdict", "Warranted"),
    ]
    note = (
        f"Cross-validation over {laws.folds} folds of runs; a law is warranted where it predicts runs it has "
        f"not seen better by twice the standard error and 5 %. Chosen: {laws.best}."
    )
    return doc.listing("Is a richer law warranted?", laws.scores, columns, note)


def suggestion_blocks(suggestion: CampaignSuggestion) -> list[doc.Block]:
    columns = [
        doc.column("order", "Run"),
        doc.column("speed", "Speed", "rad/s", format="fix:1"),
        doc.column("load", "Load", "N m", format="fix:2"),
        doc.column("remaining", "Random variance remaining", "%", format="fix:1"),
    ]
    rows: list[Sequence[object]] = []
    for point, runs in groupby(suggestion.runs, key=lambda run: (run.speed_rad_s, run.load_Nm)):
        same = list(runs)  # the same point several times is one row
        ends = dict.fromkeys(str(run.order) for run in (same[0], same[-1]))
        rows.append((" to ".join(ends), *point, 100.0 * same[-1].remaining))
    goal = "the margins'" if suggestion.criterion == "margins" else "the coefficients'"
    blocks = [doc.table(f"Runs that would shrink {goal} uncertainty most", columns, rows)]
    note = (
        f"{100.0 * suggestion.shared_part:.0f} % of the margins' variance comes from errors that all "
        f"runs share and no further run reduces; the largest is the {suggestion.largest_shared}."
    )
    blocks += [] if suggestion.largest_shared is None else [doc.text(note)]
    margins = [
        doc.of("label", "label", "Margin"),
        doc.of("value", "value", "Value", format="sig:4"),
        doc.of("std", "std", "Standard deviation", format="sig:2"),
        doc.of("floor_std", "floor", "Systematic part", format="sig:2"),
        doc.of("unit", "unit", "Unit"),
    ]
    title = "Margins and their uncertainty from the friction, slow motion"
    return [*blocks, doc.listing(title, suggestion.margins, margins)]


def account_blocks(result: CampaignResult) -> list[doc.Block]:
    outlier = [
        doc.of("run", "run", "Outlier, run"),
        doc.of("standardised", "size", "Residual, standard deviations", format="fix:1"),
        doc.of("limit", "limit", "Limit", format="fix:1"),
        doc.of(lambda one: "set aside" if one.set_aside else "kept", "state", "Treatment"),
    ]
    aside = [doc.of("id", "run", "Run"), doc.of("reason", "reason", "Reason")]
    outliers, gone = result.fit.outliers, result.set_aside
    kept, none = doc.text("No run is an outlier."), doc.text("No run was set aside.")
    return [
        doc.listing("Outliers", outliers, outlier) if outliers else kept,
        doc.listing("Runs set aside", gone, aside, status=lambda _: "warn") if gone else none,
    ]


def run_table(result: CampaignResult) -> doc.Block:
    records = {run.id: run.record for run in result.imported.runs}
    fit = result.fit
    found = zip(fit.points, fit.residuals_Nm, fit.residual_stds_Nm, strict=True)
    residuals = {p.run: (r, s) for p, r, s in found}
    columns = [
        doc.of("run", "run", "Run"),
        doc.of(lambda p: p.direction * p.speed_rad_s, "speed", "Speed", "rad/s", format="fix:2"),
        doc.of("load_Nm", "load", "Load", "N m", format="fix:3"),
        doc.of("torque_Nm", "torque", "Torque", "mN m", scale=1e3, format="fix:4"),
        doc.of(lambda p: residuals[p.run][0], "residual", "Residual", "µN m", scale=1e6, format="fix:2"),
        doc.of(lambda p: residuals[p.run][1], "std", "σ", "µN m", scale=1e6, format="fix:2"),
        doc.of("window.start_s", "start", "Steady from", "s", format="fix:2"),
        doc.of("window.stop_s", "stop", "to", "s", format="fix:2"),
        doc.of(lambda p: str(records[p.run].counts), "rows", "Rows in, out"),
        doc.of(lambda p: "; ".join(records[p.run].notes) or "one recorder", "clock", "Clock of the sensor"),
    ]
    return doc.listing("Runs", fit.points, columns)


def surface_figure(fit: SurfaceFit) -> doc.Block:
    """Runs and fitted lines over speed, a line for each load; runs that were left out are ringed."""
    chart, panel = style.plot(380.0, "motor speed, rad/s", "friction torque at the motor, mN m", legend=True)
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
    for point in (one for one in fit.points if one.run in named):
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
    for i, j in combinations(fit.determined, 2):
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
    values, vectors = np.linalg.eigh(covariance[np.ix_([i, j], [i, j])] * np.outer(scale, scale))
    x, y = radius * (vectors * np.sqrt(np.maximum(values, 0.0))) @ (style.TURN.real, style.TURN.imag)
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
    chart, panels = style.stack(60.0 + 120.0 * len(shown), *(1.0 for _ in shown))
    for k, (panel, name) in enumerate(zip(panels, shown, strict=True)):
        panel.curve(record.time_s[rows], record[name][rows], colour=style.SERIES[k % 7], width=1.1)
        panel.band_x(start_s, stop_s, colour=style.RED, opacity=0.1)
        for edge in (start_s, stop_s):
            panel.rule_x(edge, colour=style.RED, width=1.2, dash=1)
        panel.y.label = labels[name]
    panels[-1].x.label = "time, s"
    panels[-1].x.limits(record.time_s[rows][0], record.time_s[rows][-1])
    return chart
