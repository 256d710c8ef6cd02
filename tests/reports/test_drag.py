"""Curves of the live page taken hold of: a drag by so many decibels is a gain by so much; pinned variants.

The truth is the axis: what lies between two places on a scale in dB is a factor, in closed form.
"""

import math
import re

import pytest
from live_page import AMBER, FIGURES, LIVE, Page, command_line

from actuator_lti import load_design
from actuator_lti.design import with_values
from actuator_lti.design.control import Filter
from tests.changed import changed

# px on the screen to units of an axis of a panel: [per px along x (ratio if logarithmic), along y]
SCALE = """([chart, k]) => {
    const svg = document.querySelector(`[data-chart="${chart}"] .plot`);
    const group = svg.querySelectorAll(".panel")[k];
    const ends = (name) => [...group.querySelectorAll(name)];
    const zoom = svg.getScreenCTM().a;
    const at = (node, key) => Number(node.getAttribute(key));
    const number = (node) => Number(node.textContent.replace("−", "-").replace("k", "e3").replace("M", "e6"));
    const xs = ends(".xt text"), ys = ends(".yt text");
    const along = (list, key) => {
        const [a, b] = [list[0], list[list.length - 1]];
        return [number(a), number(b), (at(b, key) - at(a, key)) * zoom];
    };
    return [along(xs.length ? xs : [...svg.querySelectorAll(".xt text")], "x"), along(ys, "y")];
}"""


TURN = 2.0 * math.pi
NOTCH = Filter(kind="notch", frequency_rad_s=TURN * 200.0, width_rad_s=TURN * 60.0, depth=0.3)
NOTCHED = changed(AMBER, controller={"velocity": {"filters": (NOTCH,)}})


@pytest.fixture
def page(shared) -> Page:
    result = shared(NOTCHED)
    for tab in result.locator('.tabs [data-loop="velocity"][aria-pressed="false"]').all():
        result.settled(tab.click)
    result.locator('[data-chart="bode"]').scroll_into_view_if_needed()
    return result


def drag(page: Page, at: tuple[float, float], dx: float, dy: float) -> None:
    """Move by whole pixels: a browser tells a script no parts of one."""
    x, y = (round(place) for place in at)
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, 6):
        page.mouse.move(x + round(dx * k / 5), y + round(dy * k / 5))
    page.settled(page.mouse.up)


def decibels(page: Page, pixels: float) -> float:
    low, high, apart = page.evaluate(SCALE, ["bode", 0])[1]
    return pixels * (high - low) / apart


def test_the_magnitude_is_dragged_by_decibels_and_undone_in_one_step(page: Page) -> None:
    before = page.read()["velocity"]
    drag(page, page.grab("bode"), 0.0, -8.0)
    by = decibels(page, -8.0)
    assert by > 3.0
    assert page.field("control.velocity.gain") == pytest.approx(0.12 * 10.0 ** (by / 20.0), rel=2e-3)
    assert page.read()["velocity"]["gain_margin"] == pytest.approx(before["gain_margin"] - by, abs=0.02)
    page.does("undo")
    assert page.field("control.velocity.gain") == pytest.approx(0.12)
    assert page.read()["velocity"] == before


MOVED = """() => new Promise((told) => {
    const seen = () => [document.querySelector('[data-chart="bode"] path.grab').getAttribute("d"),
        document.querySelector(".hands-run").dataset.last];
    const field = document.querySelector('.row[data-path="control.velocity.gain"] .field'), before = seen();
    const changed = () => seen().map((now, k) => now !== before[k]);
    field.value = "0.2";
    field.dispatchEvent(new Event("change", { bubbles: true }));
    requestAnimationFrame(() => { // behind the page's own, before anything else
        const first = changed(), { dataset } = document.getElementById("hands-on");
        const wait = () => (dataset.behind === "done" ? told([first, changed()]) : setTimeout(wait, 10));
        wait();
    });
})"""


def test_the_curve_that_moves_waits_for_no_run(page: Page) -> None:
    """The curve is there when the frame ends; the run with limits and friction comes in its own script."""
    page.wait_for_selector("#hands-on[data-behind=done]")
    assert page.evaluate(MOVED) == [[True, False], [True, True]]


def test_the_nyquist_curve_is_dragged_outwards(page: Page) -> None:
    x, y = page.grab("nyquist")
    origin = page.evaluate(
        """() => { const svg = document.querySelector('[data-chart="nyquist"] .plot');
        const told = svg.querySelector(".panel").dataset;
        const ends = (name) => told[name].split(" ").slice(1).map(Number);
        const scale = ([low, high, from, to]) => (to - from) / (high - low);
        const zero = (axis) => axis[2] - axis[0] * scale(axis);
        const [a, b] = [ends("x"), ends("y")];
        const at = new DOMPoint(zero(a), zero(b)).matrixTransform(svg.getScreenCTM());
        return [at.x, at.y]; }"""
    )
    drag(page, (x, y), 0.4 * (x - origin[0]), 0.4 * (y - origin[1]))
    assert page.field("control.velocity.gain") == pytest.approx(0.12 * 1.4, rel=2e-2)


def test_the_corner_and_the_notch_are_moved_by_their_handles(page: Page) -> None:
    def middle(name: str) -> tuple[float, float]:
        return page.spot(f'[data-chart="bode"] circle[data-name="{name}"]')

    low, high, apart = page.evaluate(SCALE, ["bode", 1])[0]
    ratio = (high / low) ** (15.0 / apart)
    drag(page, middle("corner of velocity"), 15.0, 0.0)
    assert page.field("control.velocity.integral_time") == pytest.approx(15.0 / ratio, rel=5e-3)
    name = next(path for path in page.sliders() if path.endswith(".frequency"))
    notch, width = name.removesuffix(".frequency"), name.replace(".frequency", ".width")
    first, wide = page.field(name), page.field(width)
    drag(page, middle(notch), 15.0, 0.0)
    assert (moved := page.field(name)) == pytest.approx(first * ratio, rel=5e-3)
    page.keyboard.down("Shift")
    drag(page, middle(notch), 15.0, 0.0)
    page.keyboard.up("Shift")
    assert (page.field(name), page.field(width)) == (moved, pytest.approx(wide * ratio, rel=5e-3))


def test_marks_stand_where_the_margins_are(page: Page) -> None:
    """The stem of the gain margin is as long as the figure says, and so is that of the phase margin."""
    page.locator('[data-chart="bode"] .plots').focus()
    for _ in range(3):
        page.settled(lambda: page.keyboard.press("PageUp"))
    assert page.field("control.velocity.gain") == pytest.approx(0.12 * 10.0 ** (1.5 / 20.0), rel=1e-3)
    own = page.read()["velocity"]
    for panel, name in ((0, "gain_margin"), (1, "phase_margin")):
        low, high, apart = page.evaluate(SCALE, ["bode", panel])[1]
        length = page.evaluate(
            """(k) => { const svg = document.querySelector('[data-chart="bode"] .plot');
            const stem = svg.querySelectorAll(".panel")[k].querySelector(".live-marks .stem");
            const [, from, to] = stem.getAttribute("d").match(/M[-\\d.]+ ([-\\d.]+)V([-\\d.]+)/).map(Number);
            return (to - from) * svg.getScreenCTM().a; }""",
            panel,
        )
        assert abs(length * (high - low) / apart) == pytest.approx(abs(own[name]), rel=0.02, abs=0.3), name


def test_a_design_with_a_limit_that_fails_marks_only_that(opens) -> None:
    page = opens(with_values(AMBER, {"control.velocity.gain": 0.75}))
    page.settled(lambda: page.locator(".tabs button", has_text="Velocity").click())
    stems, demands = '[data-chart="bode"] .live-marks .stem', "table.demands tr[data-loop=velocity]"
    colours = page.locator(stems).evaluate_all("all => all.map(n => n.style.stroke)")
    met = dict(page.locator(demands).evaluate_all("all => all.map(r => [r.dataset.id, r.dataset.met])"))
    shown = {"false": "var(--fail)", "true": "var(--pass)"}
    assert colours == [shown[met[name]] for name in ("gain-margin", "phase-margin")]
    assert "var(--fail)" in colours


CURSOR = """(name) => { const svg = document.querySelector(`[data-chart=${name}] .plot`);
    const [, x, top] = svg.querySelector(".over .cursor").getAttribute("d").match(/M([-\\d.]+) ([-\\d.]+)/);
    const at = new DOMPoint(+x, +top + 9).matrixTransform(svg.getScreenCTM());
    return [at.x, at.y]; }"""


def press(page: Page, does: str, letter: str = "") -> None:
    page.does(does, f'[data-letter="{letter}"]' if letter else "")
    page.done()


def column(page: Page, heading: str) -> list[str]:
    heads = page.locator("table.variants thead th").all_inner_texts()
    rows = page.locator("table.variants tbody tr").all()
    return [row.locator("th, td").all_inner_texts()[heads.index(heading)] for row in rows]


def curves(page: Page, label: str) -> list[str]:
    found = 'all => all.filter(li => !li.hidden).map(li => li.closest("[data-chart]").dataset.chart)'
    legends = page.locator("[data-chart] .keys li").filter(has_text=re.compile(f"^([ST] )?{label}$"))
    return sorted(set(legends.evaluate_all(found)))


def test_variants_stand_side_by_side_and_undo_holds(opens, tmp_path) -> None:
    page, wanted = opens(AMBER), {}
    for letter, gain in (("A", 80.0), ("B", 140.0)):
        page.type_value("control.position.gain", gain)
        press(page, "pin")
        wanted[letter] = command_line(page.saved(tmp_path / f"{letter}.toml"))["loops"]["position"]
    press(page, "reset")
    followed = page.evaluate(f"{LIVE}.figures")
    for letter, figures in wanted.items():
        for cell, figure in zip(column(page, letter), followed, strict=False):
            own = figures.get("to_reference", figures)[FIGURES[figure["name"]]]
            factor = {"s": 1e3}.get(FIGURES[figure["name"]].rpartition("_")[2], 1.0)  # shown in ms
            assert float(cell.replace("−", "-")) == pytest.approx(own * factor, rel=6e-4, abs=6e-4), figure
        assert curves(page, letter) == ["bode", "nyquist", "sensitivity", "step"]
    assert column(page, "As changed") == column(page, "As designed")
    press(page, "unpin", "A")
    assert curves(page, "A") == []
    press(page, "undo")
    press(page, "restore", "A")
    assert column(page, "As changed") == column(page, "A")
    press(page, "undo")
    assert column(page, "As changed") == column(page, "As designed")
    press(page, "undo")  # what was reset
    assert column(page, "As changed") == column(page, "B")
    press(page, "undo")
    assert page.locator(".pins li").count() == 1
    press(page, "redo")
    assert column(page, "As changed") == column(page, "B")


def test_one_cursor_goes_through_the_figures_of_a_loop(opens) -> None:
    """A time in the step is half a period: pointed at there, the frequency stands in the other figures."""
    page = opens(load_design("fin"))
    step = page.locator('[data-chart="step"] .chart')
    step.scroll_into_view_if_needed()
    step.locator(".plots").focus()
    for _ in range(6):
        page.keyboard.press("ArrowLeft")
    readout = step.locator(".readout").inner_text()
    told = dict(re.findall(r"(time|half a period of)\s+([\d.]+) (?:ms|Hz)", readout))
    hertz = float(told["half a period of"])
    assert 2.0 * hertz * 1e-3 * float(told["time"]) == pytest.approx(1.0, rel=2e-3)
    assert page.locator('[data-chart="nyquist"] .over .probe').count() == 2
    assert page.locator('[data-chart="sensitivity"] .over .cursor').count() == 1
    page.mouse.move(*page.evaluate(CURSOR, "bode"))
    seen = page.locator('[data-chart="bode"] .readout').inner_text()
    match = re.search(r"frequency\s+([\d.]+) Hz", seen)
    assert float(match[1]) == pytest.approx(hertz, rel=0.02)
    assert page.locator('[data-chart="step"] .over .cursor').count() == 1
