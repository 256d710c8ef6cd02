"""The identification from records of a motion: inputs, parameters, verdict, refinement by simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block, Row, Section, Status
from reports.numbers import show
from reports.sections.identification_inputs import (
    finding_table,
    input_table,
    verdict_block,
    verdict_words,
)

if TYPE_CHECKING:
    from analyses.identification.bench import BenchResult
    from analyses.identification.electrical import ElectricalFit
    from analyses.identification.joint_model import JointModel

LABELS = {
    "inertia": ("Inertia, all at the motor", "kg m²", "Mass", "kg"),
    "viscous": ("Viscous friction", "N m s/rad", "Viscous friction", "N s/m"),
    "dry": ("Dry friction", "N m", "Dry friction", "N"),
    "offset": ("Offset", "N m", "Offset", "N"),
    "viscous_forward": ("Viscous friction, forward", "N m s/rad", "Viscous friction, forward", "N s/m"),
    "dry_forward": ("Dry friction, forward", "N m", "Dry friction, forward", "N"),
    "viscous_reverse": ("Viscous friction, reverse", "N m s/rad", "Viscous friction, reverse", "N s/m"),
    "dry_reverse": ("Dry friction, reverse", "N m", "Dry friction, reverse", "N"),
    "load_coefficient": ("Load friction", "N m/(N m)", "Load friction", "N/N"),
    "gravity_sin": ("Gravity, m g l cos(offset)", "N m", "", ""),
    "gravity_cos": ("Gravity, m g l sin(offset)", "N m", "", ""),
}


def section(result: BenchResult, axis: str) -> Section:
    """Make the section of an identification."""
    blocks = [verdict_block(result.items), parameter_table(result, axis)]
    if result.refined is not None:
        blocks.append(refined_table(result))
    if result.electrical is not None:
        blocks.append(electrical_table(result.electrical))
    if result.laws:
        blocks.append(law_table(result, axis))
    blocks += fixed_blocks(result.model, axis)
    if len(result.records) > 1:
        blocks.append(scatter_table(result.model, axis))
    for part, record in zip(result.model.records, result.records, strict=True):
        blocks += [
            input_table(record, part.used),
            finding_table(record.name, result.findings[record.name]),
            *[doc.text(f"{part.name}: {note}") for note in (str(record.counts), *part.notes)],
        ]
    blocks += [finding_table(record.name, result.findings[record.name]) for record in result.validation]
    blocks.append(_figure(result.model, axis))
    status: Status = "pass" if result.passed else "fail"
    return doc.section(
        "dynamic-identification", "Dynamic identification", blocks,
        result=_result(result, axis), intro=_intro(result), status=status,
    )  # fmt: skip


def _result(result: BenchResult, axis: str) -> str:
    """The values that matter with their standard errors, and how the written design meets its records."""
    model = result.model
    main = [n for n in model.names if n.partition("_")[0] in ("inertia", "dry", "viscous") or n == "map_0"]
    parts = []
    for name in main[:3]:
        label, unit = _label(name, axis)
        std = float(np.sqrt(model.covariance[model.names.index(name), model.names.index(name)]))
        value = f"{show(model[name], 'sig:4')} ± {show(std, 'sig:2')} {unit}"
        parts.append(f"{label.partition(',')[0].lower()} {value}")
    worst = max(result.resimulated, key=lambda one: one.relative_error)
    met = "The written design meets "
    met += "its records" if len(result.resimulated) > 1 else worst.record
    words = f"{', '.join(parts)}. {met} within {100.0 * worst.relative_error:.3g} % ({worst.how})."
    return verdict_words(result.items, words[0].upper() + words[1:])


def _intro(result: BenchResult) -> str:
    model = result.model
    recipe = model.recipe
    many = f"{len(result.records)} records, " if len(result.records) > 1 else ""
    rest = sum(record.rows_at_rest for record in model.records)
    return (
        f"{many}{model.rows_in} rows in, {model.rows_used} used. Position filtered at "
        f"{recipe.cutoff_hz:g} Hz (Butterworth of order {recipe.filter_order}, forward and backward), "
        "differentiated twice, the first "
        f"{recipe.skip_samples} samples dropped, decimated by {recipe.decimation}"
        f"{f', {rest} rows at rest left out' if rest else ''}; inverse dynamic model by least squares. "
        "Relative residual "
        f"{100.0 * model.relative_residual:.4f} %."
    )


def _label(name: str, axis: str) -> tuple[str, str]:
    side = 2 if axis == "linear" else 0
    if name.startswith("map_"):
        return f"Friction map, point {int(name[4:]) + 1}", "N" if axis == "linear" else "N m"
    label, unit = LABELS[name][side : side + 2]
    return label, unit


def parameter_table(result: BenchResult, axis: str) -> Block:
    """Values, their standard errors as published recipes give them, and as the record really tells."""
    model = result.model
    columns = [
        doc.column("name", "Parameter"),
        doc.column("value", "Value", format="sig:7"),
        doc.column("white", "Standard error, white residuals", format="sig:4"),
        doc.column("std", "Standard error", format="sig:3"),
        *([doc.column("bias", "Bias removed", format="sig:3")] if model.bias else []),
        doc.column("unit", "Unit"),
    ]
    rows: list[Row] = []
    for k, name in enumerate(model.names):
        label, unit = _label(name, axis)
        rows.append(
            {
                "name": label,
                "value": model.values[k],
                "white": model.standard_errors[k],
                "std": float(np.sqrt(model.covariance[k, k])),
                "unit": unit,
                **({"bias": model.bias[name]} if model.bias else {}),
            }
        )
    note = (
        "White residuals: ordinary least squares, as is usually published. Standard error: with the "
        "autocorrelation of the residuals, and the scatter between records where there are several; this one "
        "goes into the design." + (f" Bias of the fit: {model.bias_told}." if model.bias_told else "")
    )
    return doc.table("Identified parameters", columns, rows, note)


def refined_table(result: BenchResult) -> Block:
    """The values refined by simulation, which are those of the design."""
    refined = result.refined
    assert refined is not None
    columns = [
        doc.column("name", "Key"),
        doc.column("value", "Refined by simulation", format="sig:6"),
        doc.column("std", "Standard error", format="sig:3"),
    ]
    rows = [
        {"name": path, "value": value, "std": refined.standard_errors[path]}
        for path, value in refined.values.items()
    ]
    note = (
        "Simulation with each record's own command: the relative error of the signal that is fitted falls "
        f"from {100 * refined.error_before:.3f} % to {100 * refined.error_after:.3f} % in "
        f"{refined.iterations} iterations. These values are the design's."
    )
    return doc.table("Refined by simulation", columns, rows, note)


def electrical_table(fit: ElectricalFit) -> Block:
    """R, kE and, where it is shown, L."""
    labels = {
        "resistance": ("Resistance R", "ohm"),
        "back_emf": ("Back-EMF constant kE (kM follows)", "V s/rad"),
        "inductance": ("Inductance L", "H"),
        "offset": ("Offset of the voltage", "V"),
    }
    columns = [
        doc.column("name", "Voltage equation"),
        doc.column("value", "Value", format="sig:5"),
        doc.column("std", "Standard error", format="sig:2"),
        doc.column("unit", "Unit"),
    ]
    rows = [
        {"name": labels[name][0], "value": fit[name], "std": fit.std(name), "unit": labels[name][1]}
        for name in fit.names
    ]
    rows += [{"name": f"{labels[name][0]}: {why}"} for name, why in fit.not_shown.items()]
    note = f"u = R i + kE w + L di/dt; relative residual {100.0 * fit.relative_residual:.3g} %."
    return doc.table("Voltage equation", columns, rows, note)


def law_table(result: BenchResult, axis: str) -> Block:
    """The friction laws that were tried, by the Bayesian criterion."""
    unit = "m/s" if axis == "linear" else "rad/s"
    columns = [
        doc.column("name", "Law"),
        doc.column("breaks", f"Break points, {unit}"),
        doc.column("parameters", "Parameters", format="short:3"),
        doc.column("residual", "Relative residual", "%", format="sig:4"),
        doc.column("criterion", "BIC difference", format="fix:1"),
        doc.column("taken", "Chosen"),
    ]
    rows = [
        {
            "name": law.name,
            "breaks": ", ".join(f"{speed:.4g}" for speed in law.breaks_rad_s) or "–",
            "parameters": law.parameters,
            "residual": 100.0 * law.relative_residual,
            "criterion": law.criterion,
            "taken": "yes" if law.taken else "no",
        }
        for law in result.laws
    ]
    note = (
        "BIC (Bayesian information criterion): n ln(mean square residual) + p ln n, n the effective number "
        "of independent rows; the difference is to the plain law. A map is chosen where it is below -6."
    )
    return doc.table("Friction laws", columns, rows, note)


def fixed_blocks(model: JointModel, axis: str) -> list[Block]:
    """What was not fitted, and why."""
    if not model.fixed:
        return []
    columns = [
        doc.column("name", "Parameter"),
        doc.column("value", "Fixed at", format="sig:5"),
        doc.column("unit", "Unit"),
        doc.column("why", "Reason"),
    ]
    rows = []
    for name, one in model.fixed.items():
        label, unit = _label(name, axis)
        rows.append({"name": label, "value": one.value, "unit": unit, "why": one.reason})
    return [doc.table("Fixed parameters", columns, rows)]


def scatter_table(model: JointModel, axis: str) -> Block:
    """Each record alone, and the scatter between them."""
    columns = [doc.column("name", "Parameter")]
    count = max((len(values) for values in model.singles.values()), default=0)
    columns += [doc.column(f"r{k}", f"record {k + 1} alone", format="sig:5") for k in range(min(count, 6))]
    columns += [
        doc.column("between", "Scatter between records", format="sig:3"),
        doc.column("unit", "Unit"),
    ]
    rows = []
    for name in model.names:
        label, unit = _label(name, axis)
        own = {f"r{k}": value for k, value in enumerate(model.singles.get(name, ())[:6])}
        rows.append({"name": label, "between": model.between[name], "unit": unit, **own})
    note = (
        "Scatter: standard deviation between records beyond the error of each. A parameter that one record "
        "does not determine is fixed at its joint value there."
    )
    return doc.table("Fits of single records", columns, rows, note)


def _figure(model: JointModel, axis: str) -> Block:
    unit = "N" if axis == "linear" else "N m"
    chart = Chart(width=style.WIDE, height=320.0)
    panel = chart.panel()
    panel.curve(np.arange(len(model.residual)), model.residual, "residual")
    panel.x.label, panel.y.label = "row after decimation", f"residual, {unit}"
    return doc.figure(
        "residual",
        chart,
        caption="Residual of the inverse dynamic model",
        alt="Residual of the drive force over the record",
    )
