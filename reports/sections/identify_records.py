"""The identification from records of a motion: parameters, refinement by simulation, laws, inputs."""

from collections.abc import Sequence

import numpy as np

from analyses.estimation.parameters import default_value, parameter
from analyses.identification.bench import BenchResult
from analyses.identification.design_values import DesignValue, given_constant
from analyses.identification.inverse import SIGNED
from analyses.identification.joint_model import JointModel, LawChoice, RecordFit
from analyses.identification.residuals import ResidualTest
from analyses.records.finding import left_out_of
from reports import document as doc
from reports.charts import style
from reports.numbers import capital, show
from reports.sections import identified
from reports.sections.names import speed_unit


def section(result: BenchResult) -> doc.Section:
    axis, model = result.design.axis, result.model
    blocks = [_parameters(model, axis)]
    blocks += [_against_design(result)] if result.design_values else []
    if result.refined is not None:
        refined = result.refined
        note = (
            "Simulation with each record's own command: the relative error of the signal that is fitted "
            f"falls from {100 * refined.error_before:.3f} % to {100 * refined.error_after:.3f} % in "
            f"{refined.iterations} iterations. These values are the design's."
        )
        ended = "ended at a bound of its key: these records do not tell it."
        note += "".join(f" {key} {ended}" for key in refined.at_bound)
        if (kept := given_constant(model)) is not None:
            note += f" {parameter(kept, axis).label}, fixed: {model.fixed[kept].reason}."
        blocks.append(identified.parameter_table("Refined by simulation", refined, note, axis=axis))
    if result.electrical is not None:
        found = result.electrical
        note = f"u = R i + kE w + L di/dt; relative residual {100.0 * found.relative_residual:.3g} %."
        more = [doc.of(dict(found.bias).get, "bias", "Bias removed", format="sig:2")] if found.bias else []
        blocks.append(identified.parameter_table("Voltage equation", found, note, more=more))
    blocks += [law_table(result, axis)] if result.laws else []
    blocks += [scatter_table(model, axis)] if model.between else []
    for part, record in zip(model.records, result.records, strict=True):
        blocks += [
            identified.input_table(f"Inputs: {record.name}", result.inputs[record.name]),
            identified.finding_table(record.name, result.findings[record.name]),
            *[doc.text(f"{part.name}: {note}") for note in (str(record.counts), *part.notes)],
        ]
    blocks += [identified.finding_table(one.name, result.findings[one.name]) for one in result.validation]
    blocks += residual_blocks(model, result.residual_tests, axis)
    return identified.judged(
        "dynamic-identification", "Dynamic identification", result, blocks,
        result=_result(result, axis), intro=_intro(result),
    )  # fmt: skip


def _result(result: BenchResult, axis: str) -> str:
    """The values that matter with their standard errors, and how the written design meets its records."""
    model = result.model
    main = [n for n in model.names if n.partition("_")[0] in ("inertia", "dry", "viscous") or n == "map_0"]
    labels = {name: parameter(name, axis).label.partition(",")[0].lower() for name in main[:3]}
    parts = [f"{label} {identified.value_words(model, name, axis)}" for name, label in labels.items()]
    if result.refined is not None:  # these are the design's
        found = result.refined
        parts = [f"{key} {identified.value_words(found, key, axis)}" for key in found.names[:3]]
        parts[0] = f"refined by simulation: {parts[0]}"
    values = ", ".join(parts) or "the records tell neither inertia nor friction"
    words = f"{capital(values)}{identified.constant_words(model, axis)}."
    if result.unmade:
        return " ".join([*left_out_of(result.findings), words, "No design comes of it."])
    worst = max(result.resimulated, key=lambda one: one.beyond_noise)
    met = "its records" if len(result.resimulated) > 1 else worst.record
    written = "The written design" if result.passed or result.accepted else "A design of what is found"
    words = f"{words} {written} meets {met} within {100.0 * worst.beyond_noise:.3g} % ({worst.how})."
    return " ".join([*left_out_of(result.findings), words])


def _intro(result: BenchResult) -> str:
    model, recipe = result.model, result.model.recipe
    many = f"{len(result.records)} records, " if len(result.records) > 1 else ""
    rest = sum(record.rows_at_rest for record in model.records)
    ends = any(recipe.part(len(record)).stop < len(record) for record in result.records)
    last = f" and last {recipe.skip_end_samples}" if ends else ""
    filtered = "Position and torques" if recipe.both_sides else "Position"
    how = (
        f"{filtered} filtered at {recipe.cutoff_hz:g} "
        f"Hz (Butterworth of order {recipe.filter_order}, forward and backward), differentiated twice, the "
        f"first {recipe.skip_samples}{last} samples dropped, decimated by "
        f"{recipe.decimation}{f', {rest} rows at rest left out' if rest else ''}; inverse dynamic model by "
        "least squares"
    )
    if all(part.answer for part in model.records):
        how = "A run-down: the decay by viscous and dry friction over time, by least squares"
    return (
        f"{many}{model.rows_in} rows in, {model.rows_used} used. {how}. "
        f"Relative residual {100.0 * model.relative_residual:.4f} %, fit "
        f"{min(part.fit_percent for part in model.records):.2f} % (100 (1 - |y - yhat| / |y - mean(y)|)"
        f"{', the lowest' if many else ''})."
    )


def _parameters(model: JointModel, axis: str) -> doc.Block:
    """Values, their standard errors as published recipes give them, and as the record really tells."""
    white = dict(zip(model.names, model.white_errors.tolist(), strict=True))
    more = [doc.of(white.get, "white", "Error if white", format="sig:3")]
    more += [doc.of(dict(model.bias).get, "bias", "Bias removed", format="sig:2")] if model.bias else []
    note = (
        "White residuals: ordinary least squares, as is usually published. Standard error: of "
        "residuals that are correlated and not alike everywhere, and the scatter between records where there "
        "are several; this one goes into the design."
        + (f" Bias of the fit: {model.bias_note}." if model.bias_note else "")
    )
    return identified.parameter_table("Identified parameters", model, note, axis=axis, more=more)


def _against_design(result: BenchResult) -> doc.Block:
    """Each number beside what the records say of it; those that the design keeps at the end."""
    model, axis, values = result.model, result.design.axis, result.design_values

    def own_share(one: DesignValue) -> str:
        return show(100.0 * one.allowed, "sig:2") + " assumed" * one.assumed

    columns = [
        doc.of(lambda one: parameter(one.name, axis).label, "name", "Number"),
        doc.of("design", "design", "Design", format="sig:4"),
        doc.of("found", "found", "Records", format="sig:4"),
        doc.of(lambda one: parameter(one.name, axis).unit, "unit", "Unit"),
        doc.of("ratio", "ratio", "Records over design", format="sig:4"),
        doc.of("error", "error", "Standard error", format="sig:2"),
        doc.of(own_share, "allowed", "Design's own uncertainty", "%"),
        doc.of(lambda one: "yes" if one.agrees else "no", "agrees", "Agrees"),
    ]
    note = (
        "A number agrees where chance, with both errors, explains the difference (level 0.1 %). Kept: the "
        "records do not tell it, or it came out at zero within its error; the design has its own."
    )
    block = doc.listing(
        "The design's numbers against the records", values, columns, note,
        status=lambda one: "pass" if one.agrees else "warn",
    )  # fmt: skip
    assert block["kind"] == "table"
    none = [name for name in model.names if model[name] <= 0.0 and name not in SIGNED]
    own = {name: default_value(result.design, name) for name in none}
    own |= {name: one.value for name, one in model.fixed.items()}
    kept = [(parameter(name, axis), value) for name, value in own.items() if value]
    rows: list[doc.Row] = [
        {"name": one.label, "design": value, "unit": one.unit, "agrees": "kept"} for one, value in kept
    ]
    return {**block, "rows": [*block["rows"], *rows]}


def law_table(result: BenchResult, axis: str) -> doc.Block:
    def breaks(one: LawChoice) -> str:
        return ", ".join(f"{speed:.4g}" for speed in one.breaks_rad_s) or "–"

    columns = [
        doc.of("name", "name", "Law"),
        doc.of(breaks, "breaks", f"Break points, {speed_unit(axis)}"),
        doc.of("parameters", "parameters", "Parameters", format="short:3"),
        doc.of("relative_residual", "residual", "Relative residual", "%", scale=100.0, format="sig:4"),
        doc.of("criterion", "criterion", "BIC difference", format="fix:1"),
        doc.of("taken", "taken", "Chosen", format="yesno"),
    ]
    note = (
        "BIC (Bayesian information criterion): n ln(mean square residual) + p ln n, n the effective number "
        "of independent rows; the difference is to the plain law. A map is chosen where it is below -6."
    )
    return doc.listing("Friction laws", result.laws, columns, note)


def scatter_table(model: JointModel, axis: str) -> doc.Block:
    columns = [doc.column("name", "Parameter")]
    count = min(len(model.alone), 6)
    columns += [doc.column(f"r{k}", f"record {k + 1} alone", format="sig:5") for k in range(count)]
    columns += [doc.column("between", "Scatter between records", format="sig:3"), doc.column("unit", "Unit")]
    rows = []
    for name in model.names:
        one = parameter(name, axis)
        own = {f"r{k}": value for k, value in enumerate(model.singles.get(name, ())[:6])}
        rows.append({"name": one.label, "between": model.between[name], "unit": one.unit, **own})
    note = (
        "Scatter: standard deviation between records beyond the error of each. A parameter that one record "
        "does not determine is fixed at its joint value there."
    )
    return doc.table("Fits of single records", columns, rows, note)


def residual_blocks(model: JointModel, tests: Sequence[ResidualTest], axis: str) -> list[doc.Block]:
    """The tests of all records, and three pictures of each; those of further records on demand."""
    first, *others = (_figures(part, tests, axis) for part in model.records)
    more = [figure for each in others for figure in each]
    folded = [doc.details("Residuals of the other records", more)] if more else []
    return [_residual_table(tests), *first, *folded]


def _residual_table(tests: Sequence[ResidualTest]) -> doc.Block:
    columns = [
        doc.of("record", "record", "Record"),
        doc.of("name", "name", "Test"),
        doc.of("input", "input", "Input"),
        doc.of("largest", "largest", "Largest correlation", format="fix:3"),
        doc.of("lag", "lag", "at lag", "rows", format="int"),
        doc.of("bound", "bound", "Bound (99 %)", format="fix:3"),
        doc.of("within", "within", "Within", format="yesno"),
    ]
    note = (
        "Whiteness: autocorrelation of the innovations (the residual through its autoregressive model); "
        "independence: their cross-correlation with an input that passed the same filter. Beyond the bound "
        "something is not modelled, and the truth need not lie in the intervals. What the simulated record "
        "leaves too is taken off first."
    )
    listed = ("Residual tests", tests, columns, note)
    return doc.listing(*listed, status=lambda one: "pass" if one.within else "warn")


def _figures(part: RecordFit, tests: Sequence[ResidualTest], axis: str) -> list[doc.Block]:
    own, unit = [test for test in tests if test.record == part.name], "N" if axis == "linear" else "N m"
    drawn = (
        ("time", _over_time(part, unit), "residual over time, and its spectrum"),
        ("correlation", _correlation(own), "correlations of the residual, with bounds"),
        ("friction", _friction(part, unit, speed_unit(axis)), "friction over speed, rows and model"),
    )
    return [doc.figure(f"residual_{name}", chart, f"{part.name}: {words}") for name, chart, words in drawn]


def _over_time(part: RecordFit, unit: str) -> style.Chart:
    from scipy.signal import welch

    chart, left = style.plot(300.0, "time, s; rows left out are gaps", f"residual, {unit}")
    right = chart.panel("frequency, Hz", f"{unit}/√Hz", "xy")
    whole = np.full(len(part.keep), np.nan)
    whole[part.keep] = part.residual
    rows = style.kept_rows([np.nan_to_num(whole)])
    left.rule_y(0.0)
    left.curve(part.step_s * rows, whole[rows], "residual", colour=style.BLUE, width=1.1)
    hertz, power = welch(part.residual, 1.0 / part.step_s, nperseg=min(256, len(part.residual)))
    right.curve(hertz[1:], np.sqrt(power[1:]), "amplitude density of the residual", colour=style.BLUE)
    return chart


def _correlation(tests: Sequence[ResidualTest]) -> style.Chart:
    chart = style.Chart(width=style.WIDE, height=130.0 * max(len(tests), 1))
    for panel, test in zip(chart.column(*(1.0 for _ in tests)) if tests else (), tests, strict=True):
        reach = 1.2 * max(test.bound, abs(test.largest))
        panel.y.limits(-reach, reach)
        panel.band_y(-test.bound, test.bound)
        panel.rule_y(0.0)
        panel.points(test.lags, test.correlation, size=4.0, colour=style.BLUE)
        panel.y.label = test.input or test.name
        panel.x.label = "lag, rows"
    return chart


def _friction(part: RecordFit, unit: str, rate: str) -> style.Chart:
    chart, panel = style.plot(320.0, f"speed, {rate}", f"friction, {unit}", by_point=True)
    few = slice(None, None, max(1, len(part.speed) // 1500))
    order = np.argsort(part.speed)
    line = order[style.kept_rows([(part.friction - part.residual)[order]])]
    panel.points(part.speed[few], part.friction[few], "rows of the record", size=3.0, colour=style.BLUE)
    model = (part.friction - part.residual)[line]  # no function of the speed alone: in points as well
    panel.points(part.speed[line], model, "model", size=2.0, colour=style.ORANGE)
    return chart
