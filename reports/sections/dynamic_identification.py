"""The dynamic identification of one record: parameters, residual, refinement by simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from reports import document as doc
from reports.document import rounded

if TYPE_CHECKING:
    from analyses.identification.dynamic import DynamicModel
    from analyses.identification.output_error import OutputErrorResult

LABELS = {
    "inertia": ("Inertia", "kg m²", "Mass", "kg"),
    "viscous": ("Viscous friction", "N m s/rad", "Viscous friction", "N s/m"),
    "dry": ("Dry friction", "N m", "Dry friction", "N"),
    "offset": ("Offset", "N m", "Offset", "N"),
    "viscous_forward": ("Viscous friction, forward", "N m s/rad", "Viscous friction, forward", "N s/m"),
    "dry_forward": ("Dry friction, forward", "N m", "Dry friction, forward", "N"),
    "viscous_reverse": ("Viscous friction, reverse", "N m s/rad", "Viscous friction, reverse", "N s/m"),
    "dry_reverse": ("Dry friction, reverse", "N m", "Dry friction, reverse", "N"),
}


def section(
    model: DynamicModel, axis: str, notes: tuple[str, ...], refined: OutputErrorResult | None = None
) -> dict[str, Any]:
    """Make the section of one record's identification."""
    blocks = [
        parameter_table(model, axis, refined),
        *[doc.text(note) for note in notes],
        _figure(model, axis),
    ]
    return doc.section("dynamic-identification", "Dynamic identification", blocks, intro=_intro(model))


def _intro(model: DynamicModel) -> str:
    recipe = model.recipe
    return (
        f"{model.rows_in} rows in, {model.rows_used} used. Position filtered at {recipe.cutoff_hz:g} Hz "
        "(Butterworth of "
        f"order {recipe.filter_order}, forward and backward), differentiated twice, the first "
        f"{recipe.skip_samples} "
        f"samples dropped, decimated by {recipe.decimation}; inverse dynamic model by least squares. "
        "Relative residual "
        f"{100.0 * model.relative_residual:.4f} %."
    )


def parameter_table(
    model: DynamicModel, axis: str, refined: OutputErrorResult | None = None
) -> dict[str, Any]:
    """Values with standard errors, and those refined by simulation where there are any."""
    columns = [
        doc.column("name", "Parameter"),
        doc.column("value", "Value", format="sig:7"),
        doc.column("std", "Standard error", format="sig:4"),
        doc.column("unit", "Unit"),
    ]
    rows: list[dict[str, Any]] = []
    side = 2 if axis == "linear" else 0
    for k, name in enumerate(model.names):
        label, unit = LABELS[name][side : side + 2]
        rows.append({"name": label, "value": model.values[k], "std": model.standard_errors[k], "unit": unit})
    note = ""
    if refined is not None:
        columns[3:3] = [
            doc.column("refined", "Refined by simulation", format="sig:6"),
            doc.column("refined_std", "Standard error", format="sig:3"),
        ]
        for row, path in zip(rows, refined.values, strict=True):
            row |= {"refined": refined.values[path], "refined_std": refined.standard_errors[path]}
        note = (
            "Closed-loop simulation: the relative error of the drive signal falls from "
            f"{100 * refined.error_before:.3f} % "
            f"to {100 * refined.error_after:.3f} % in {refined.iterations} iterations."
        )
    return doc.table("Identified parameters", columns, rows, note)


def _figure(model: DynamicModel, axis: str) -> dict[str, Any]:
    unit = "N" if axis == "linear" else "N m"
    rows = np.arange(len(model.residual), dtype=float)
    series = [{"label": "residual", "x": rounded(rows), "y": rounded(model.residual, 4)}]
    return doc.figure(
        "curves",
        {"series": series, "x_label": "row after decimation", "y_label": f"residual, {unit}"},
        caption="Residual of the inverse dynamic model",
        alt="Residual of the drive force over the record",
    )
