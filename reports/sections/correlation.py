"""The model against records: figures of likeness, and pictures of both with the difference."""

from dataclasses import replace

from analyses.correlation.closed_loop import CorrelationResult
from analyses.correlation.compare import SignalComparison
from analyses.correlation.run import BESIDE, Correlation, SignalSummary, follows_model, worst_of
from analyses.records.finding import left_out_of
from analyses.records.naming import MEANINGS
from reports import document as doc
from reports.charts import style
from reports.numbers import show
from reports.sections.identified import finding_table, input_table

NAMES = {name: meaning.capitalize() for name, meaning in MEANINGS.items()}
NAMES |= {"voltage": "Voltage", "force": "Force"}


def _named(signal: str) -> str:
    return NAMES.get(signal, signal)


def _of_record(alone: Correlation, number: int) -> doc.Section:
    (result,) = alone.records
    active = [(name, 100.0 * share) for name, share in result.limits.items() if share > 0.0]
    limits = ", ".join(f"{name} {share:.1f} % of the time" for name, share in active) or "none"
    intro = f"Model {result.design} with the command of {result.record}; {result.counts}."
    blocks = [
        comparison_table(result),
        *map(signal_figure, result.signals.values()),
        input_table(f"Inputs: {result.record}", result.inputs),
        finding_table(result.record, result.findings),
        *map(doc.remark, result.notes),
    ]
    return doc.section(
        f"correlation-{number}", f"Model against {result.record}", blocks,
        result=words(alone), intro=f"{intro} Limits reached: {limits}.",
        status="pass" if alone.passed else "fail",
    )  # fmt: skip


def words(whole: Correlation) -> str:
    """One sentence: how far the motion is off, the signal furthest off, and what contradicts."""
    results, limit = whole.records, whole.limit
    wrong = [(r.record, f) for r in results for f in r.findings if f.passed is False]
    parts = left_out_of({one.record: one.findings for one in results})
    parts += [f"{record}: {outcome.subject}: {outcome.text}." for record, outcome in wrong[:2]]
    result, motion = worst_of(results)
    where = f" ({result.record})" if len(results) > 1 else ""
    beside = [result[name] for name in BESIDE if name in result.signals and name != motion.name]
    parts.append(
        f"{_named(motion.name)} of the model within {_share(motion)} of the measured motion "
        f"about its mean{where}, rms {show(motion.rms_error, 'sig:3')} {motion.unit}, largest "
        f"{show(motion.max_error, 'sig:3')} {motion.unit}"
        + "".join(f"; {_named(one.name).lower()} within {_share(one)}" for one in beside)
        + "."
    )
    apart = [one.record for one in results if not follows_model(one)]
    parts += [f"{record}: a fit below 0 %, the model moves otherwise." for record in apart]
    far = max((s for r in results for s in r.signals.values()), key=lambda s: s.share_beyond_noise)
    beyond = far.share_beyond_noise > limit
    side = "Above" if beyond else "Within"
    parts.append(f"{side} the limit of {100.0 * limit:g} %: {_named(far.name).lower()} {_beyond_noise(far)}.")
    if not (wrong or beyond or apart):
        parts.append("No record contradicts itself or the design.")
    return " ".join(parts)


def _share(signal: SignalComparison) -> str:
    return f"{show(100.0 * signal.share_of_motion, 'sig:3')} %"


def _beyond_noise(signal: SignalComparison) -> str:
    """What is held against the limit, and what was taken off."""
    if 100.0 * (signal.share_of_motion - signal.share_beyond_noise) < 0.1:
        return _share(signal)
    both = {"white noise of the record": signal.noise_rms, "ripple of an encoder's counts": signal.counts_rms}
    noise = " and the ".join(
        f"{of}, {show(rms, 'sig:3')} {signal.unit} rms" for of, rms in both.items() if rms
    )
    return f"{show(100.0 * signal.share_beyond_noise, 'sig:3')} % beyond the {noise}"


def _summary(whole: Correlation) -> doc.Section:
    results = whole.records
    rows: list[tuple[str, SignalComparison | SignalSummary]] = []
    for name, one in whole.summary.items():
        rows += [(result.record, result[name]) for result in results if name in result.signals]
        rows.append((f"all {one.records}; worst: {one.worst}", one))
    columns = [
        doc.of(lambda row: _named(row[1].name), "name", "Signal"),
        doc.of(lambda row: row[0], "record", "Record"),
        doc.of(lambda row: row[1].mean_error, "mean", "Mean |e|", format="sig:4"),
        doc.of(lambda row: row[1].rms_error, "rms", "rms", format="sig:4"),
        doc.of(lambda row: row[1].max_error, "largest", "Largest", format="sig:4"),
        doc.of(lambda row: row[1].unit, "unit", "Unit"),
        doc.of(lambda row: 100.0 * row[1].share_of_motion, "share", "Of the motion", "%", format="sig:4"),
        doc.of(lambda row: 100.0 * row[1].relative_error, "relative", "Relative error", "%", format="sig:4"),
    ]
    listed = ("All records", rows, columns)
    table = doc.listing(*listed, status=lambda row: "info" if row[0].startswith("all ") else None)
    result, signal = worst_of(results)
    parts = [table, signal_figure(signal, f"The worst record, {result.record}. ")]
    intro = f"{len(results)} records against {result.design}; the motion of {result.record} is furthest off."
    status: doc.Status = "pass" if whole.passed else "fail"
    return doc.section("correlation", "All records", parts, result=words(whole), intro=intro, status=status)


def comparison_table(result: CorrelationResult) -> doc.Block:
    columns = [
        doc.of(lambda s: _named(s.name), "name", "Signal"),
        doc.of("share_of_motion", "share", "Error of the motion", "%", scale=100.0, format="sig:4"),
        doc.of("relative_error", "relative", "Relative error", "%", scale=100.0, format="sig:4"),
        doc.of("fit_percent", "fit", "Fit", "%", format="fix:3"),
        doc.of("mean_error", "mean", "Mean |e|", format="sig:3"),
        doc.of("rms_error", "rms", "rms", format="sig:3"),
        doc.of("max_error", "largest", "Largest error", format="sig:3"),
        doc.of("unit", "unit", "Unit"),
        doc.of("max_error_time_s", "at", "at", "s", format="fix:3"),
        doc.of("delay_s", "delay", "Measured lags by", "ms", scale=1e3, format="fix:3"),
    ]
    note = (
        "Error of the motion: norm of the difference over that of the measured signal about its mean (a flat "
        "signal: over its norm); fit: 100 % less that. Relative error: over the norm of the measured signal."
    )
    return doc.listing(f"{result.design} against {result.record}", result.signals.values(), columns, note)


def signal_figure(signal: SignalComparison, first: str = "") -> doc.Block:
    difference = signal.modelled - signal.measured
    rows = style.kept_rows([signal.measured, signal.modelled, difference])
    name, time = _named(signal.name), signal.time_s[rows]
    chart, (upper, lower) = style.stack(380.0, 2.2, 1.0)
    upper.curve(time, signal.measured[rows], "measured", colour=style.BLUE)
    upper.curve(time, signal.modelled[rows], "model", colour=style.ORANGE, width=1.4, dash=1)
    upper.y.label = f"{name.lower()}, {signal.unit}"
    lower.rule_y(0.0)
    lower.curve(time, difference[rows], colour=style.RED, width=1.1)
    lower.y.label, lower.x.label = f"difference, {signal.unit}", "time, s"
    lower.x.limits(time[0], time[-1])
    caption = f"{first}{name}: measured and model, {_share(signal)} of the motion off"
    return doc.figure("correlation_signal", chart, caption)


def section(result: Correlation) -> list[doc.Section]:
    made = [_of_record(replace(result, records=(one,)), k) for k, one in enumerate(result.records, 1)]
    return [_summary(result), *made] if len(made) > 1 else made
