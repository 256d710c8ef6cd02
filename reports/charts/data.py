"""A chart as plain data and back: what a document holds of a figure, checked when it is read.

A value that is the default is left out, numbers have the digits that a figure shows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Any, cast

import numpy as np
from pydantic import TypeAdapter, ValidationError

from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from reports.charts.axis import Axis
from reports.charts.chart import Chart, Column

DIGITS = 6


@cache
def _reader() -> TypeAdapter[Chart]:
    return TypeAdapter(Chart)


def chart_data(chart: Chart) -> Tree:
    """Give a chart as JSON knows it.

    >>> chart = Chart(width=300.0)
    >>> _ = chart.panel().curve([0.0, 1.0], [2.0, None], "y")
    >>> again = chart_of(chart_data(chart))
    >>> again.width, again.columns[0].panels[0].items[0].label
    (300.0, 'y')
    """
    return cast(Tree, _plain(chart))


def chart_of(data: Mapping[str, Any]) -> Chart:
    """Make the chart of such data; of what is none an InputError names the first place that is wrong."""
    try:
        chart = _reader().validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        words = first["msg"].removeprefix("Value error, ")
        raise InputError(f"{place}: {words[:1].lower()}{words[1:]}") from None
    if not chart.columns:
        raise InputError("columns: a chart has at least one")
    for column in chart.columns:
        for panel in column.panels:
            panel.x = column.panels[-1].x
    return chart


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        value = value.written() if isinstance(value, Axis | Column) else value
        return {each.name: _plain(getattr(value, each.name)) for each in fields(value) if _said(value, each)}
    if isinstance(value, np.ndarray):
        return [_number(item) for item in value.tolist()]
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value


def _said(owner: Any, each: Any) -> bool:
    value = getattr(owner, each.name)
    if each.name == "kind" or isinstance(value, np.ndarray):
        return True
    default = each.default if each.default_factory is MISSING else each.default_factory()
    return bool(value != default)


def _number(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
