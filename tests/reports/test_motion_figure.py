"""The figure of a motion: every limit that acts is shaded where it acts."""

from collections.abc import Iterator

import pytest

from actuator_lti import load_design
from actuator_lti.drive.signals import LIMITERS
from nonlinear import Trajectory, commands, simulate
from reports.charts.chart import Band
from reports.sections.simulate import chart_of


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(load_design("ilr33-amber"), commands.step(0.35), 0.3)


def _bands(run: Trajectory, words: str) -> Iterator[Band]:
    for column in chart_of(run).columns:
        for panel in column.panels:
            yield from (one for one in panel.items if isinstance(one, Band) and one.label == words)


@pytest.mark.parametrize("name", ["speed", "acceleration", "current", "voltage"])
def test_a_limit_is_shaded_where_it_acts(run: Trajectory, name: str) -> None:
    rows = run.limit_active(name)
    bands = list(_bands(run, f"{LIMITERS[name].words} acts"))
    assert bool(bands) == bool(rows.any())
    if bands:
        scale = 1e3  # the axis is in ms
        seen = run.time_s[rows] * scale
        assert all(any(one.low <= at <= one.high for one in bands) for at in seen)


def test_the_step_is_held_by_the_acceleration_limit(run: Trajectory) -> None:
    assert run.limit_active("acceleration").any()
