"""How far a figure may move by itself: as the registry of quantities declares it, in the figure's unit."""

from __future__ import annotations

import pytest

from actuator_lti.asked.quantities import LOOP_QUANTITIES, QUANTITIES
from reports.nightly.figures import Figure
from reports.nightly.tolerance import Tolerances, read_tolerances
from reports.sections.margins import MARGIN_COLUMNS, RESPONSE_COLUMNS


@pytest.mark.parametrize("quantity", [q for q in QUANTITIES.values() if q.heading], ids=lambda q: q.name)
def test_every_heading_is_a_column_of_the_report_with_its_tolerance(quantity) -> None:
    (column,) = [c for c in (*MARGIN_COLUMNS, *RESPONSE_COLUMNS) if c["label"] == quantity.heading]
    unit = column.get("unit") or ""
    figure = Figure(name=f"margins / A table / Current loop / {column['label']}", value=1.0, unit=unit)
    absolute, relative = Tolerances().pair(figure)
    factor = {"ms": 1e3}.get(unit, 1.0)
    assert absolute == pytest.approx(quantity.tolerance * factor, rel=1e-12)
    assert relative == 1e-3


def test_quantities_of_loops_have_a_column_and_one_tolerance_a_unit() -> None:
    assert all(q.heading for q in LOOP_QUANTITIES.values())
    by_unit: dict[str, set[float]] = {}
    for quantity in LOOP_QUANTITIES.values():
        by_unit.setdefault(quantity.unit, set()).add(quantity.tolerance)
    assert all(len(result) == 1 for result in by_unit.values()), by_unit


@pytest.mark.parametrize(
    ("unit", "absolute"),
    [("dB", 0.01), ("deg", 0.05), ("%", 0.05), ("s", 1e-7), ("samples", 0.01), ("A", 1e-9)],
)
def test_a_figure_of_another_name_has_the_tolerance_of_its_unit(unit: str, absolute: float) -> None:
    figure = Figure(name="drive / something else", value=1.0, unit=unit)
    assert Tolerances().pair(figure) == (absolute, 1e-3)
    assert Tolerances().of(figure, 1e6) == pytest.approx(1e3)


def test_a_rule_of_the_study_comes_first() -> None:
    figure = Figure(name="margins / A table / Current loop / Gain margin", value=1.0, unit="dB")
    assert read_tolerances({"*gain margin": "0.5 dB"}, "study.toml").pair(figure) == (0.5, 0.0)
    assert Tolerances().pair(Figure(name="x: met", value=1.0, kind="verdict")) == (0.5, 0.0)
