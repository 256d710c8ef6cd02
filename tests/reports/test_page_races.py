"""What moves while the page still works: every test makes two things meet that a busy machine lets meet."""

import json
import math
import re

import pytest
from live_page import AMBER, Page

from actuator_lti import load_design

GAIN = "control.position.gain"
HANDS = """
    const root = document.getElementById("hands-on"), find = (selector) => root.querySelector(selector);
    const press = (does, of) => find(`[data-do="${does}"]${of ? `[data-letter="${of}"]` : ""}`).click();
    const type = (key, value) => {
      const field = find(`.row[data-path="${key}"] .field`);
      field.value = value;
      field.dispatchEvent(new Event("change", { bubbles: true }));
    };
    const frame = () => new Promise((seen) => requestAnimationFrame(seen));
"""
WATCHED = """window.IntersectionObserver = class {
    constructor(run) { window.seen = (...all) => run(all.map((isIntersecting) => ({ isIntersecting }))); }
    observe() { window.watched?.(); }
};"""
# told between the first run and the word that the page is ready
EARLY = """window.watched = () => new MutationObserver(() => seen(true)).observe(
    document.getElementById("hands-on"), { attributes: true, attributeFilter: ["data-count"] });"""
SLOW = "const now = performance.now.bind(performance); performance.now = () => 1000 * now();"
PAGE_UP = """find('[data-chart="bode"] .plots').dispatchEvent(
    new KeyboardEvent("keydown", { key: "PageUp", bubbles: true }));"""


def at_once(page: Page, does: str) -> object:
    """Do several things in one script, before the page has a frame of its own."""
    return page.evaluate(f"async () => {{ {HANDS} {does} }}")


def test_done_is_said_of_the_values_that_are_asked_for(fresh: Page) -> None:
    """However late the frame comes that follows them, and what was listed before is not taken up."""
    told = at_once(
        fresh,
        f"""let follow = null;
        window.requestAnimationFrame = (run) => {{ follow = run; return 1; }};
        type("{GAIN}", "110");
        const first = root.dataset.behind;
        follow();
        type("{GAIN}", "130");
        await new Promise((go) => setTimeout(go, 400)); // by then the first would have been done
        const then = root.dataset.behind;
        follow();
        return [first, then];""",
    )
    assert told == ["waits", "waits"]
    fresh.done()


def test_a_value_that_is_refused_is_not_pinned_before_that_is_said(page: Page) -> None:
    at_once(page, 'type("motor.torque_constant", "1e3"); press("pin"); await frame();')
    assert "Refused" in page.inner_text(".state")
    assert page.locator(".pins li").count() == 0


def test_presses_within_one_frame_are_as_many_steps_as_they_do(fresh: Page) -> None:
    """A fourth variant, a variant removed twice, one restored that is gone: no step and no complaint."""
    at_once(fresh, 'for (let k = 0; k < 4; k++) press("pin"); await frame();')
    assert fresh.locator(".pins li").count() == 3
    at_once(fresh, 'for (const does of ["unpin", "unpin", "restore"]) press(does, "A"); await frame();')
    assert fresh.locator(".pins li").count() == 2
    assert at_once(fresh, 'for (let k = 0; k < 4; k++) press("undo"); await frame(); '
                         'return find(\'[data-do="undo"]\').disabled;')  # fmt: skip
    assert fresh.locator(".pins li").count() == 0


def test_nothing_is_no_step(fresh: Page) -> None:
    does = f'type("{GAIN}", "120"); await frame(); await frame();'
    assert at_once(fresh, does + "return find('[data-do=\"undo\"]').disabled;")


def test_a_move_under_way_is_reset(page: Page) -> None:
    """Back to what was committed last: nothing to commit, yet something to follow."""
    before = page.read()
    page.type_value(GAIN, 150.0)
    page.does("undo")
    shown = at_once(
        page,
        f"""const [range, field] = ["[type=range]", ".field"].map(
          (one) => find(`.row[data-path="{GAIN}"] ${{one}}`));
        range.value = 800;
        range.dispatchEvent(new Event("input", {{ bubbles: true }}));
        await frame();
        const moved = field.value;
        press("reset");
        await frame();
        return [moved, field.value];""",
    )
    assert shown[0] != "120.0" == shown[1]
    assert page.read() == before


def test_a_slider_let_go_after_an_undo_holds_where_it_stands(page: Page) -> None:
    page.type_value(GAIN, 150.0)
    row = f'.row[data-path="{GAIN}"] input[type=range]'
    page.mouse.move(*page.spot(row))
    page.mouse.down()
    page.settled(lambda: page.mouse.move(*page.spot(row, 0.8)))
    page.settled(lambda: page.keyboard.press("Control+z"))
    page.mouse.up()
    page.done()
    place, key = float(page.input_value(row)), page.sliders()[GAIN]
    assert page.field(GAIN) == pytest.approx(
        key["low"] * (key["high"] / key["low"]) ** (place / 1e3), rel=1e-3
    )
    assert place > 600.0


def test_the_map_is_drawn_though_it_is_seen_before_the_page_is_ready(opens) -> None:
    page = opens(AMBER, first=WATCHED + EARLY)
    drawn = "() => JSON.parse(document.querySelector('#hands-on').dataset.cells || '[]').length"
    page.wait_for_function(drawn)


def test_of_several_sights_told_at_once_the_last_counts(opens) -> None:
    page = opens(AMBER, first=WATCHED)
    page.done()
    assert at_once(page, "seen(false, true); return root.dataset.behind;") == "waits"


def test_the_map_waits_as_long_as_a_step_settles_though_that_follows_later(opens) -> None:
    page = opens(AMBER, first=WATCHED + SLOW)
    at_once(page, "seen(true);")
    page.done(60_000)
    page.type_value(GAIN, 140.0)
    settling_s = page.read()["position"]["settling_time"]
    period_s, every = AMBER.controller.period_s, AMBER.controller.position.every
    cells = json.loads(page.get_attribute("#hands-on", "data-cells") or "[]")
    assert {cell[1] for cell in cells} == {math.ceil(1.5 * settling_s / (period_s * every)) * every}


def test_the_file_dropped_last_is_laid_over_the_model(fresh: Page) -> None:
    """The first is still read when the second comes."""
    at_once(
        fresh,
        """let read = null;
        const late = new Promise((go) => { read = go; });
        const table = "time_s,command_deg,angle_deg\\n0,1,0\\n0.1,1,1";
        const drop = (name, text) => root.dispatchEvent(Object.assign(new Event("drop", { bubbles: true }), {
          dataTransfer: { files: [{ name, size: 9, text: () => text }], types: ["Files"] } }));
        drop("first.csv", late);
        drop("second.csv", Promise.resolve(table));
        await new Promise((go) => setTimeout(go, 0));
        read(table);
        await new Promise((go) => setTimeout(go, 0));""",
    )
    assert {*re.findall(r"\w+\.csv", fresh.inner_text(".record"))} == {"second.csv"}


def test_a_playback_paused_and_gone_on_with_is_one(fresh: Page) -> None:
    left = at_once(
        fresh,
        """const asked = new Set();
        const [ask, leave] = [requestAnimationFrame, cancelAnimationFrame].map((one) => one.bind(window));
        window.requestAnimationFrame = (run) => { const id = ask(run); asked.add(id); return id; };
        window.cancelAnimationFrame = (id) => { asked.delete(id); leave(id); };
        for (let k = 0; k < 3; k++) find(".playback button").click();
        return asked.size;""",
    )
    assert left == 1


def test_a_handle_that_vanishes_is_let_go(fresh: Page) -> None:
    """Another loop is shown while the corner of this one is held: what was moved is a step of its own."""
    fresh.locator('[data-chart="bode"]').scroll_into_view_if_needed()
    fresh.settled(lambda: fresh.locator(".tabs button", has_text="Velocity").click())
    x, y = fresh.spot('[data-chart="bode"] circle[data-name="corner of velocity"]')
    fresh.mouse.move(x, y)
    fresh.mouse.down()
    fresh.settled(lambda: fresh.mouse.move(x + 15.0, y))
    at_once(fresh, "find('.tabs [data-loop=\"position\"]').click();")
    fresh.mouse.move(x + 16.0, y)
    fresh.mouse.up()
    fresh.wait_for_function("() => !document.querySelector('[data-do=\"undo\"]').disabled")


@pytest.mark.parametrize("between", ["", PAGE_UP])
def test_a_curve_that_is_held_moves_from_where_it_was_taken(page: Page, between: str) -> None:
    """Whatever else moved it meanwhile: there and back is where it was."""
    page.locator('[data-chart="bode"]').scroll_into_view_if_needed()
    x, y = page.grab("bode")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 6)
    at_once(page, between)
    page.mouse.move(x, y - 9)
    page.settled(lambda: page.mouse.move(x, y))
    page.mouse.up()
    page.done()
    assert page.field(GAIN) == 120.0


def test_rows_of_one_drive_are_not_named_by_another(opens) -> None:
    """Break points of the drive as written follow later than the values of the link, which update at once."""
    link = "#hands-on?control.velocity.every=1&control.position.every=1"
    page = opens(load_design("ilr33-amber-multirate"), link)
    page.done()
    assert "fundamental" not in page.inner_text("table.now")


def test_a_variant_s_figure_that_follows_later_is_not_said_before(opens) -> None:
    page = opens(AMBER, first=SLOW)
    page.done()
    words = at_once(
        page,
        f"""press("pin"); await frame();
        type("{GAIN}", "140"); await frame();
        const cells = root.querySelectorAll("table.variants tbody td:nth-child(3)");
        return [...cells].map((one) => one.textContent);""",
    )
    assert "…" in words
    page.done()
    assert "…" not in page.inner_text("table.variants")


def test_what_waits_is_not_started_once_a_value_moves(fresh: Page) -> None:
    """Whatever is due when the next value comes was listed for the value before: it ran without its run."""
    fresh.evaluate(SLOW)
    fresh.type_value(GAIN, 101.0)  # by this clock its run took long: the next is late
    at_once(
        fresh,
        f"""const wait = (ms) => new Promise((go) => setTimeout(go, ms));
        type("{GAIN}", "102");
        await wait(30); // listed, not started
        for (const end = Date.now() + 300; Date.now() < end;); // due by now
        type("{GAIN}", "103");
        while (root.dataset.behind !== "done") await wait(10);""",
    )
