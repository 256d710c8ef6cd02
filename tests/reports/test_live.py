"""The figures in a real browser: read, zoomed, moved, switched and redrawn, by mouse, keyboard and touch.

The curves are closed forms: an integrator with delay, and a parabola.
"""

import cmath
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_page import HOSTILE, SEEN, Browser, Locator, Page

from analyses.linear.responses import Curve
from reports import document as doc
from reports.charts import style
from reports.charts.chart import Chart
from reports.html import page as page_of
from reports.sections.loop_charts import both

GAIN, DELAY_S = 100.0, 0.002
CROSSOVER_HZ = GAIN / (2.0 * math.pi)  # of 100 exp(-0.002 s)/s, exactly


def document() -> dict[str, Any]:
    f = np.geomspace(0.1, 1000.0, 240)
    w = 2.0 * np.pi * f
    phase = -90.0 - np.degrees(w * DELAY_S)
    response = GAIN / (1j * w) * np.exp(-1j * w * DELAY_S)
    near = np.abs(response) < 3.0
    bode, (top, bottom) = style.stack(410.0, 1.15, 1.0, width=430.0, loop="current")
    both([("open loop", Curve(w, response, phase))], None, top, bottom, span=100.0)
    nyquist = Chart(width=430.0, height=430.0, loop="current")
    panel = nyquist.panel("real part of L", "imaginary part of L", by_point=True)
    panel.equal = True
    panel.curve(response.real[near], response.imag[near], "L", parameter=f[near])
    panel.x.limits(-2.6, 1.25)
    panel.y.limits(-1.6, 1.6)
    t, (curves, panel) = np.linspace(0.0, 2.0, 41), style.plot(320.0, "time, s", "angle, deg")
    panel.curve(t, t**2, "parabola", **style.series(0))
    panel.curve(t, 3.0 - t, HOSTILE, **style.series(1))
    rows = [{"_loop": "current", "_hz": CROSSOVER_HZ, "what": "gain crossover"}]
    drawn = {"bode": bode, "nyquist": nyquist, "curves": curves}
    blocks = [doc.table("Crossings", [doc.column("what", "Crossing")], rows)]
    blocks += [doc.figure(name, data, caption=name, alt=name) for name, data in drawn.items()]
    head = {"name": "made", "revision": "", "title": "", "origin": "", "axis": "rotary"}
    origin = {"design_hash": "0" * 64, "time": "", "version": "0", "commit": ""}
    parts = [doc.section("loop-current", "Current loop", blocks, result="It is drawn.")]
    return doc.document(title="Made", subtitle="", design=head, provenance=origin, sections=parts)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("live") / "page.html"
    path.write_text(page_of(document()), encoding="utf-8")
    return path


@pytest.fixture
def page(opens, made: Path, request) -> Page:
    """Open the page from disk, offline; any complaint and any request fails the test."""
    options = {"live": False, **getattr(request, "param", {})}
    return opens(made, "#loop-current", **options)  # which opens its fold


def chart(page: Page, k: int) -> Locator:
    return page.locator(".chart").nth(k)


def spot(figure: Locator, across: float, up: float, panel: int = 0) -> tuple[float, float]:
    """Give a point of a panel's frame on the screen, by its share of width and height."""
    figure.scroll_into_view_if_needed()
    place = """(root, [k, a, u]) => {
        const g = root.querySelectorAll(".panel")[k];
        const ends = (name) => g.dataset[name].split(" ").slice(3).map(Number);
        const [x0, x1] = ends("x"), [y0, y1] = ends("y");
        const p = new DOMPoint(x0 + a * (x1 - x0), y0 + u * (y1 - y0));
        const q = p.matrixTransform(root.querySelector(".plot").getScreenCTM());
        return [q.x, q.y];
    }"""
    x, y = figure.evaluate(place, [panel, across, up])
    return float(x), float(y)


def read(figure: Locator) -> dict[str, float]:
    result = {}
    for row in figure.locator(".readout tr").all():
        _, name, value = row.locator("td").all_inner_texts()
        if number := re.match(r"[−\d.]+", value):
            result[name] = float(number.group().replace("−", "-"))
    return result


@pytest.mark.parametrize("across", [0.2, 0.5, 0.83])
def test_the_read_out_is_the_curve(page: Page, across: float) -> None:
    figure = chart(page, 0)
    page.mouse.move(*spot(figure, across, 0.5))
    result, hz = read(figure), 0.1 * 10.0 ** (4.0 * across)
    assert result["frequency"] == pytest.approx(hz, rel=5e-3)
    w = 2.0 * math.pi * result["frequency"]
    assert result["magnitude"] == pytest.approx(20.0 * math.log10(GAIN / w), abs=0.02)
    assert result["phase"] == pytest.approx(-90.0 - math.degrees(w * DELAY_S), abs=max(0.05, 1e-3 * w))


def test_the_nyquist_figure_names_the_frequency_of_its_nearest_point(page: Page) -> None:
    figure = chart(page, 1)
    page.mouse.move(*spot(figure, 0.63, 0.3))
    result = read(figure)
    w = 2.0 * math.pi * result["frequency"]
    value = GAIN / (1j * w) * cmath.exp(-1j * w * DELAY_S)
    seen = complex(result["real part of L"], result["imaginary part of L"])
    assert seen == pytest.approx(value, abs=5e-3)


def test_zoom_keeps_the_point_under_the_pointer_and_the_read_out_true(page: Page) -> None:
    figure = chart(page, 2)
    at = spot(figure, 0.5, 0.5)
    page.mouse.move(*at)
    before, ticks = read(figure), figure.locator(".xt text").all_inner_texts()
    figure.locator(".plots").focus()
    for _ in range(8):
        page.mouse.wheel(0.0, -120.0)
    page.mouse.move(at[0] + 1.0, at[1])
    page.mouse.move(*at)
    after = read(figure)
    assert after["time"] == pytest.approx(before["time"], abs=2e-3)
    assert after["parabola: angle"] == pytest.approx(after["time"] ** 2, abs=1e-3)
    assert figure.locator(".xt text").all_inner_texts() != ticks
    page.keyboard.press("0")
    assert figure.locator(".xt text").all_inner_texts() == ticks
    assert figure.locator(".zoomed").count() == 0


def test_both_panels_of_a_bode_figure_zoom_along_frequency_together(page: Page) -> None:
    figure = chart(page, 0)
    figure.get_by_role("button", name="Zoom in").click()
    shifts = figure.locator(".world").evaluate_all(
        "all => all.map(g => g.getAttribute('transform').match(/[-\\d.]+/g))"
    )
    assert float(shifts[0][0]) == float(shifts[1][0]) > 1.0
    assert shifts[0][4] == shifts[1][4]
    assert float(shifts[1][3]) == 1.0  # the phase axis stays


def test_dragging_moves_the_view_by_as_much(page: Page) -> None:
    figure = chart(page, 2)
    x, y = spot(figure, 0.5, 0.5)
    page.mouse.move(x, y)
    before = read(figure)["time"]
    page.mouse.down()
    page.mouse.move(x + 60.0, y, steps=6)
    page.mouse.up()
    page.mouse.move(x + 61.0, y)
    page.mouse.move(x + 60.0, y)
    assert read(figure)["time"] == pytest.approx(before, abs=5e-3)


def test_a_click_keeps_the_read_out_until_the_next(page: Page) -> None:
    figure = chart(page, 0)
    page.mouse.click(*spot(figure, 0.4, 0.5))
    kept = read(figure)
    page.mouse.move(*spot(figure, 0.8, 0.5))
    assert read(figure) == kept
    page.mouse.click(*spot(figure, 0.8, 0.5))
    page.mouse.move(*spot(figure, 0.6, 0.5))
    assert read(figure) != kept


@pytest.mark.parametrize("act", [lambda item: item.click(), lambda item: item.press("Enter")])
def test_the_legend_switches_curves(page: Page, act: Any) -> None:
    figure = chart(page, 2)
    item = figure.get_by_role("button", name="parabola")
    for shown in (False, True):
        act(item)
        assert item.get_attribute("aria-pressed") == ("true" if shown else "false")
        assert figure.locator(".curve[data-k='0']").is_visible() is shown
        page.mouse.move(*spot(figure, 0.5, 0.5))
        assert ("parabola: angle" in read(figure)) is shown


def test_a_row_of_a_table_shows_its_crossing_in_every_figure_of_its_loop(page: Page) -> None:
    page.get_by_role("button", name="Show this crossing").click()
    assert chart(page, 0).locator(".crossing").count() == 2
    assert chart(page, 2).locator(".crossing").count() == 0
    place = "node => [node.getBBox().x, ...node.closest('.panel').dataset.x.split(' ').slice(1).map(Number)]"
    at, low, high, a, b = chart(page, 0).locator(".crossing").first.evaluate(place)
    assert low * (high / low) ** ((at - a) / (b - a)) == pytest.approx(CROSSOVER_HZ, rel=1e-3)


def test_the_keyboard_reads_zooms_and_resets(page: Page) -> None:
    figure, times = chart(page, 2), []
    figure.locator(".plots").focus()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
        times.append(read(figure)["time"])
    assert times == sorted(set(times))
    assert figure.locator(".readout").get_attribute("role") == "status"
    for key, zoomed in (("+", 1), ("Shift+ArrowLeft", 1), ("Escape", 0)):
        page.keyboard.press(key)
        assert figure.locator(".zoomed").count() == zoomed


@pytest.mark.parametrize(
    "page", [{"viewport": {"width": 390, "height": 844}, "has_touch": True}], indirect=True
)
def test_a_tap_reads_and_two_fingers_zoom(page: Page) -> None:
    figure = chart(page, 0)
    page.touchscreen.tap(*spot(figure, 0.5, 0.5))  # a click only once the browser takes it for a tap
    figure.locator(".readout tr").first.wait_for()
    assert read(figure)["frequency"] == pytest.approx(10.0, rel=0.05)
    x, y = spot(figure, 0.5, 0.5)
    session = page.context.new_cdp_session(page.page)
    for kind, gap in (("touchStart", 20.0), ("touchMove", 35.0), ("touchMove", 50.0), ("touchEnd", 0.0)):
        fingers = [{"x": x - gap, "y": y, "id": 0}, {"x": x + gap, "y": y, "id": 1}]
        points = fingers * (kind != "touchEnd")
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    figure.locator(".zoomed").first.wait_for()
    scale = figure.locator(".world").first.get_attribute("transform")
    assert float(re.findall(r"[\d.]+", scale)[0]) > 1.5


def test_a_curve_can_be_given_new_values(page: Page) -> None:
    figure = chart(page, 2)
    values = {"panel": 0, "curve": "parabola", "x": [0.0, 1.0, 2.0], "y": [1.0, 1.5, 2.0]}
    redraw = "(root, detail) => root.dispatchEvent(new CustomEvent('chart:redraw', { detail }))"
    figure.evaluate(redraw, values)
    page.mouse.move(*spot(figure, 0.3, 0.5))
    result = read(figure)
    assert result["parabola: angle"] == pytest.approx(1.0 + 0.5 * result["time"], abs=2e-3)


def test_nothing_of_a_design_becomes_markup(page: Page) -> None:
    page.mouse.move(*spot(chart(page, 2), 0.5, 0.5))
    for part in (".keys", ".readout"):
        assert SEEN in chart(page, 2).locator(part).inner_text()
    assert page.locator("script").count() == 1


def test_no_other_script_runs_and_without_scripts_figures_are_whole(browser: Browser, made: Path) -> None:
    page = browser.new_context(offline=True).new_page()
    page.goto(made.as_uri())
    page.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), { text: 'ran = 1' }))"
    )
    assert page.evaluate("window.ran") is None
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto(made.as_uri())
    page.locator(".claim summary").first.click()  # a fold opens by itself
    assert page.locator(".plot").count() == 3
    assert all(plot.is_visible() for plot in page.locator(".plot").all())
    assert page.locator(".keys li").first.is_visible()
    assert page.locator(".tools").count() == 0
