"""The figure of a motion: every limit that acts is shaded where it acts."""

import pytest

from actuator_lti import load_design
from actuator_lti.drive.signals import LIMITERS
from nonlinear import Trajectory, commands, simulate
from reports.charts.chart import Band
from reports.sections.simulate import chart_of


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(load_design("ilr33-amber"), commands.step(0.35), 0.3)


@pytest.mark.parametrize("name", ["speed", "acceleration", "current", "voltage"])
def test_a_limit_is_shaded_where_it_acts(run: Trajectory, name: str) -> None:
    items = [one for column in chart_of(run).columns for panel in column.panels for one in panel.items]
    shaded = f"{LIMITERS[name].words} acts"
    bands = [one for one in items if isinstance(one, Band) and one.label == shaded]
    rows = run.limit_active(name)
    assert bool(bands) == bool(rows.any())
    seen = 1e3 * run.time_s[rows]  # the axis is in ms
    assert all(any(one.low <= at <= one.high for one in bands) for at in seen)
    assert rows.any() or name != "acceleration"
