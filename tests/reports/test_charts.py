"""Charts: ticks that can be read alone, words off the curves, places that are where the values are."""

import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuator_lti import load_design
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.step import StepFigures
from nonlinear import Trajectory, commands, simulate
from reports.charts import style
from reports.charts.axis import Axis, linear_ticks, log_ticks
from reports.charts.chart import Band, Chart
from reports.charts.labels import Room
from reports.charts.style import phases
from reports.charts.svg import page_svg
from reports.sections.loop import step_figures
from reports.sections.loop_charts import critical_points, nichols_regions
from reports.sections.simulate import chart_of

finite = st.floats(-1e9, 1e9, allow_nan=False)


def value_of(words: str) -> float:
    """Read a tick label as a number."""
    plain = words.translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789"))
    scale, plain = {"k": 1e3, "M": 1e6}.get(plain[-1], 1.0), plain.rstrip("kM")
    if plain.startswith("10-") or (plain.startswith("10") and "⁰" in words):
        return 10.0 ** float(plain[2:]) * scale
    mantissa, _, power = plain.partition("×10")
    return float(mantissa) * 10.0 ** float(power or 0) * scale


@given(finite, st.floats(1e-6, 1e9), st.integers(2, 9))
def test_linear_ticks_lie_inside_and_say_their_value(low: float, span: float, room: int) -> None:
    high = low + span
    if not high - low > 1e-9 * max(abs(low), abs(high)):
        return
    ticks = linear_ticks(low, high, room)
    assert 1 <= len(ticks) <= room + 2 or len(ticks) == 0
    step = min((b - a for (a, _), (b, _) in itertools.pairwise(ticks)), default=span)
    for value, words in ticks:
        assert low - 1e-6 * span <= value <= high + 1e-6 * span
        assert "e" not in words
        # a number of four digits where a power of ten is needed, all digits of the step elsewhere
        assert value_of(words) == pytest.approx(value, abs=0.01 * step, rel=6e-4 if "×" in words else 1e-12)


@given(st.floats(-8, 8), st.floats(0.1, 12))
def test_log_ticks_lie_inside_and_say_their_value(power: float, decades: float) -> None:
    low, high = 10.0**power, 10.0 ** (power + decades)
    ticks = log_ticks(low, high)
    assert len(ticks) <= 9
    assert all(low * (1 - 1e-6) <= value <= high * (1 + 1e-6) for value, _ in ticks)


@given(st.floats(0.01, 1e4), st.floats(1.5, 1e6), st.floats(0.0, 1.0), st.booleans(), st.booleans())
def test_an_axis_places_its_ends_and_what_lies_between(low, ratio, part, log, reversed_):
    axis = Axis(log=log, reversed=reversed_)
    axis.limits(low, low * ratio)
    value = low * ratio**part if log else low + part * (low * ratio - low)
    (place,) = axis.place([value])
    assert place == pytest.approx(1.0 - part if reversed_ else part, abs=1e-9)


@pytest.mark.parametrize("before", [True, False])
def test_limits_follow_the_values_that_an_axis_has_a_place_for_whenever_its_kind_is_said(before) -> None:
    panel = Chart().panel()
    panel.curve([1.0, 1.0], [5.0, 5.0])
    for axis, value in ((panel.x, 1.0), (panel.y, 5.0)):
        assert axis.span()[0] < value < axis.span()[1]
    panel = Chart().panel()
    panel.y.log = before
    panel.curve([1.0, 2.0, 3.0, 4.0], [0.0, -1.0, 10.0, 1000.0])
    panel.y.log = True
    low, high = panel.y.span()
    assert 0.0 < low < 10.0 < 1000.0 < high
    assert low * high == pytest.approx(1e4)


def ends_of(svg: str) -> list[list[float]]:
    """Both axes of the first panel: low, high, and where on the picture these lie."""
    axes = (re.search(rf'data-{key}="\w+ ([^"]*)"', svg) for key in "xy")
    return [[float(word) for word in axis.group(1).split()] for axis in axes]


def test_gaps_break_a_line() -> None:
    chart = Chart()
    chart.panel().curve([0, 1, 2, 3, 4], [0.0, 1.0, None, 1.0, 0.0])
    path = re.search(r'class="curve" d="([^"]*)"', page_svg(chart, "f", ""))
    assert path.group(1).count("M") == 2


def test_the_points_of_a_curve_are_where_its_values_are() -> None:
    """Read pixels back by the axes in the picture: the values again, to a thousandth of the frame."""
    chart = Chart(width=400, height=300)
    panel, f = chart.panel(), np.geomspace(0.1, 1000.0, 50)
    panel.x.log = True
    panel.curve(f, -20.0 * np.log10(f))
    svg = page_svg(chart, "f", "")
    (low, high, a, b), (bottom, top, c, d) = ends_of(svg)
    path = re.search(r'class="curve" d="([^"]*)"', svg)
    steps = np.array(re.findall(r"[Ml]([-\d.]+) ([-\d.]+)", path.group(1)), float)
    for (x, y), hz in zip(np.cumsum(steps, axis=0), f, strict=True):
        seen_hz = low * (high / low) ** ((x - a) / (b - a))
        seen_db = bottom + (y - c) / (d - c) * (top - bottom)
        assert seen_hz == pytest.approx(hz, rel=5e-4)
        assert seen_db == pytest.approx(-20.0 * math.log10(hz), abs=2e-3)


def test_equal_axes_have_equal_units() -> None:
    chart = Chart(width=500, height=300)
    panel = chart.panel()
    panel.equal = True
    panel.x.limits(-2.0, 1.0)
    panel.y.limits(-1.0, 1.0)
    units = []
    for low, high, a, b in ends_of(page_svg(chart, "f", "")):
        assert low <= -1.0 < 1.0 <= high
        units.append(abs(b - a) / (high - low))
    assert units[0] == pytest.approx(units[1], rel=1e-3)


@given(st.integers(0, 10_000))
def test_words_keep_off_curves_and_each_other_where_there_is_room(seed: int) -> None:
    rng, room = np.random.default_rng(seed), Room((0.0, 0.0, 400.0, 300.0))
    x = np.linspace(0.0, 400.0, 40)
    y = 150.0 + 60.0 * np.sin(x / rng.uniform(30.0, 90.0) + rng.uniform(0.0, 6.0))
    room.add_line(x, y)
    boxes = [room.near((float(x[k]), float(y[k])), (60.0, 26.0)) for k in (8, 20, 33)]
    dense_x = np.linspace(0.0, 400.0, 4000)
    dense_y = np.interp(dense_x, x, y)
    for x0, y0, x1, y1 in boxes:
        assert (0.0 <= x0 < x1 <= 400.0, 0.0 <= y0 < y1 <= 300.0) == (True, True)
        assert not ((dense_x > x0) & (dense_x < x1) & (dense_y > y0) & (dense_y < y1)).any()
    for (x0, y0, x1, y1), (a0, b0, a1, b1) in itertools.combinations(boxes, 2):
        assert x1 <= a0 or a1 <= x0 or y1 <= b0 or b1 <= y0


@pytest.mark.parametrize("centre_deg", [-180.0, -540.0])
def test_every_point_of_an_outline_has_that_peak(centre_deg: float) -> None:
    panel = Chart().panel()
    nichols_regions(panel, centre_deg, named=False)
    _cross, *outlines = panel.items
    assert [item.look.colour for item in panel.items] == [style.INK, style.ORANGE, style.PURPLE]
    assert critical_points(-700.0, 10.0) == [-540.0, -180.0, 180.0]  # odd half turns
    for one, size in zip(outlines, (lambda L: 1 / abs(1 + L), lambda L: abs(L / (1 + L))), strict=True):
        L = 10 ** (one.y / 20.0) * np.exp(1j * np.radians(one.x))
        np.testing.assert_allclose(20 * np.log10(size(L)), 6.0, atol=1e-9)
        assert np.abs(np.diff(one.x)).max() < 60.0  # no jump of a turn


def test_the_rise_is_marked_where_it_begins_and_ends() -> None:
    """1 - exp(-t) passes 0.1 at ln(10/9) and 0.9 at ln(10), however few of its samples the figures keep."""
    drawn, kept = np.linspace(0.0, 6.0, 6001), np.array([0.0, 1.0, 4.0, 8.0])
    figures = StepFigures(
        rise_time_s=math.log(9.0), overshoot_percent=0.0, settling_time_s=math.log(50.0), final_value=1.0,
        peak_value=1.0, peak_time_s=math.inf, period_s=None, time_s=kept, response=1.0 - np.exp(-kept),
    )  # fmt: skip
    panel = Chart().panel()
    step_figures(panel, figures, ("", drawn, 1.0 - np.exp(-drawn)), 1.0, stairs=False)
    marks = [item for item in panel.items if item.kind == "curve" and item.look.marker == "o"]
    assert [float(mark.x[0]) for mark in marks] == pytest.approx([math.log(10 / 9), math.log(10)], abs=1e-3)
    assert [float(mark.y[0]) for mark in marks] == pytest.approx([0.1, 0.9], abs=1e-3)


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(load_design("ilr33-amber"), commands.step(0.35), 0.3)


def test_a_limit_that_is_drawn_says_so(run: Trajectory) -> None:
    """A step of 20 deg takes speed, current and voltage to their limits."""
    items = [item for panel in chart_of(run).columns[0].panels for item in panel.items]
    limits = {item.words: item.at for item in items if item.kind == "rule" and item.words}
    expected = [run.limits[name].limit for name in ("speed", "current", "voltage")]
    assert limits == {f"limit ±{each:.4g}": each for each in expected}


def test_nothing_has_no_phase() -> None:
    """It is followed over what does not move: j, nothing, -1, -j."""
    values = np.array([1.0, 1.0j, 0.0, np.nan, -1.0, -1.0j])
    assert phases(values) == pytest.approx([0.0, 90.0, np.nan, np.nan, 180.0, 270.0], nan_ok=True)


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
