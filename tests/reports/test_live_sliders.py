"""The sliders of the report in a real browser, held against the command line.

A value is moved by mouse, keyboard and touch, figures are read off the page; the design that the page saves
goes through ``margins``, whose figures are those of the linear form, found without the simulator.
"""

import math
import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from live_page import AMBER, Page, command_line, same_figures, written

from actuator_lti import InputError, assemble_loops
from actuator_lti.design import Design, check_design, with_values
from actuator_lti.design.asked import FrozenMap
from nonlinear import simulate
from nonlinear.commands import step

DROP = """([name, text]) => {
    const data = new DataTransfer();
    data.items.add(new File([text], name));
    const drop = new DragEvent("drop", { dataTransfer: data, bubbles: true });
    document.querySelector("#hands-on").dispatchEvent(drop);
}"""


def refusal(design: Design) -> str:
    """What the command line refuses first, values as they are then."""
    try:
        check_design(replace(design, parameters=FrozenMap({})), "")
    except InputError as error:
        return error.message.partition("; the ratio is")[0]
    return ""


def test_every_slider_leads_to_the_figures_of_the_changed_design(page: Page) -> None:
    """Each key by itself, moved by a fifth; what the command line refuses, the page refuses in its words."""
    keys, refused = page.sliders(), set()
    assert len(keys) > 25
    for key in keys.values():
        value = key["value"] + 1.0 if key["whole"] else key["value"] * 1.2 or 0.4 * key["high"]
        page.type_value(key["path"], value / key["factor"])
        changed = with_values(AMBER, {key["path"]: value}, check=False)
        if why := refusal(changed):
            refused.add(key["path"])
            assert f"Refused, nothing follows: {why}" in page.inner_text(".state")
            assert page.get_attribute(".state", "class") == "state fail"
        else:
            same_figures(page, changed, key["path"])
        page.does("undo")
    assert {"motor.back_emf_constant", "motor.torque_constant", "control.velocity.every"} <= refused


def test_a_requirement_that_fails_is_said_at_once(page: Page, tmp_path) -> None:
    assert page.get_attribute(".state", "data-failing") == "0"
    page.type_value("control.position.gain", 590.0)
    failing = int(page.get_attribute(".state", "data-failing") or 0)
    found = command_line(page.saved(tmp_path / "hot.toml"))["requirements"]
    verdicts = [item for item in found if item["verdict"] == "not met"]
    assert failing == sum(item["loop"] is not None for item in verdicts) > 0
    assert f"{failing} not met" in page.inner_text(".state")
    assert [item["id"] for item in verdicts] == ["phase-margin/position"]
    assert ": phase margin of the position loop." in page.inner_text(".state")


def test_undo_redo_reset_and_keyboard(page: Page) -> None:
    before = page.read()
    slider = page.locator('.row[data-path="control.velocity.gain"] input[type=range]')
    slider.focus()
    page.settled(lambda: slider.press("ArrowRight"))
    page.settled(lambda: slider.press("PageUp"))
    moved = page.read()
    assert moved["velocity"]["gain_margin"] < before["velocity"]["gain_margin"]
    for does, wanted in (("undo", before), ("redo", moved)):
        for _ in range(2):
            page.does(does)
        assert page.read() == wanted
    page.does("reset")
    assert page.read() == before
    assert "#" not in page.url


@pytest.mark.parametrize(("delay_us", "words", "place"), [
    (1e4, "too many states for this page", "table.now"), (1.1e4, "allowed: at most 100 ticks", ".state")
])  # fmt: skip
def test_a_value_that_is_too_much_is_said_and_undone(page: Page, delay_us: float, words: str, place: str):
    before = page.read()
    page.type_value("control.computing_delay", delay_us)
    has = "([place, words]) => document.querySelector(place).innerText.includes(words)"
    page.wait_for_function(has, arg=[place, words])
    page.does("undo")
    assert page.read() == before


def test_nonsense_is_not_taken(opens, page: Page) -> None:
    before, row = page.read(), '.row[data-path="control.position.gain"]'
    for words in ("-5", "abc", "", "0", "Infinity", "1e300"):
        page.fill(f"{row} .field", words)
        page.press(f"{row} .field", "Enter")
        assert f'"{words}": allowed: above 0, ' in page.inner_text(f"{row} .was")
        assert page.get_attribute(f"{row} .field", "aria-invalid") == "true"
    assert page.read() == before
    page.press(f"{row} input[type=range]", "ArrowRight")
    page.wait_for_selector(f"{row} .field[aria-invalid=false]")
    assert page.inner_text(f"{row} .was").startswith("was ")
    page.does("reset")
    page.fill(f"{row} .field", "120")
    page.press(f"{row} .field", "Enter")
    page.wait_for_selector(f"{row} .field[aria-invalid=false]")
    assert page.inner_text(f"{row} .was") == ""
    nonsense = "#hands-on?control.position.gain=-1&%E0%A4%A=3&control.velocity.gain&no.key=4"
    assert opens(AMBER, fragment=nonsense).read() == before


def test_a_link_carries_the_changes(opens, fresh: Page) -> None:
    fresh.type_value("control.position.gain", 175.0)
    fresh.type_value("load.inertia", 3e-4)
    fresh.click('[data-do="link"]')
    link = fresh.input_value(".sheet textarea")
    assert opens(AMBER, fragment="#" + link.split("#")[1]).read() == fresh.read()


def test_a_dropped_record_is_laid_over_the_model(fresh: Page) -> None:
    """The record is a run of another gain: the model meets it once that gain is set; then it is removed."""
    made = simulate(with_values(AMBER, {"control.position.gain": 80.0}), step(math.radians(2.0)), 0.25)
    table = zip(made.time_s, np.degrees(made.reference_rad), np.degrees(made.output_angle_rad), strict=True)
    lines = ["time_s,command_deg,angle_deg", *(f"{t:.12g},{r:.12g},{y:.12g}" for t, r, y in table)]

    def told(fresh: Page) -> str:
        fresh.done()
        return str(fresh.inner_text(".record"))

    fresh.settled(lambda: fresh.evaluate(DROP, ["bench.csv", "\n".join(lines)]))
    words = told(fresh)
    assert "bench.csv" in words
    assert float(words.split("as changed: ")[1].split(" %")[0].replace("×10", "e")) > 0.5
    fresh.type_value("control.position.gain", 80.0)
    words = told(fresh)
    assert float(words.split("as changed: ")[1].split(" %")[0].replace("−", "-")) < 1e-6
    assert "fit 100.0" in words
    fresh.settled(lambda: fresh.get_by_label("Measured in").select_option("mrad"))
    assert "fit 100.0" not in told(fresh)
    fresh.settled(lambda: fresh.click(".dropped button"))
    assert told(fresh) == ""
    fresh.locator('[data-chart="run"] .keys li', has_text="record").wait_for(state="hidden")
    fresh.evaluate(DROP, ["bench.png", "\0PNG"])
    fresh.wait_for_function(
        "() => document.querySelector('.record').innerText.includes('bench.png: no text')"
    )


def test_a_dropped_response_is_laid_over_the_loop(fresh: Page) -> None:
    """Measured as the closed loop 2 dB and 5 deg beside the model's own open loop, with its coherence."""
    model, hertz = assemble_loops(AMBER).velocity.open_loop, np.geomspace(2.0, 400.0, 40)
    open_loop = model(np.exp(2j * np.pi * hertz * model.dt)) * 10.0**0.1 * np.exp(1j * np.radians(5.0))
    closed = open_loop / (1.0 + open_loop)
    rows = zip(hertz, 20.0 * np.log10(abs(closed)), np.degrees(np.angle(closed)), strict=True)
    table = (f"{f:.15g};{m:.15g};{p:.15g};0.9" for f, m, p in rows)
    lines = ["frequency_Hz;mag_dB;phase_deg;coherence", *table]
    fresh.settled(lambda: fresh.locator(".tabs button", has_text="Velocity").click())
    fresh.settled(lambda: fresh.evaluate(DROP, ["sweep.csv", "\n".join(lines)]))
    fresh.settled(lambda: fresh.get_by_label("of", exact=True).select_option("T"))
    words = fresh.inner_text(".record .told")
    assert re.search(r"(?s)by coherence: 2\.00 dB rms, at most 2\.00.*5\.00 deg rms, at most 5\.00", words)
    for figure in ("bode", "nyquist"):
        assert fresh.locator(f'[data-chart="{figure}"] .keys li', has_text="measured").is_visible()
    assert fresh.locator('[data-chart="difference"]').is_visible()
    fresh.type_value("control.velocity.gain", 0.12 * 10.0**0.1)
    rest = fresh.inner_text(".record .told").split("coherence: ")[1].split(" dB rms")[0]
    assert float(rest.replace("−", "-")) < 1e-9
    fresh.settled(lambda: fresh.click(".dropped button"))
    assert fresh.locator('[data-chart="difference"]').is_hidden()


def test_a_phone_has_the_sliders_within_its_width(opens) -> None:
    small = opens(AMBER, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    assert small.evaluate("document.documentElement.scrollWidth") <= 390
    before = small.read()
    place = small.spot('.row[data-path="control.position.gain"] input[type=range]', 0.8)
    small.settled(lambda: small.touchscreen.tap(*place))
    assert small.read()["position"]["bandwidth"] > before["position"]["bandwidth"]


def test_without_scripts_the_page_is_the_report_and_with_them_the_module_alone_is_compiled(browser, once):
    page = browser.new_context(offline=True, java_script_enabled=False).new_page()
    path = written(AMBER, once)
    page.goto(path.as_uri())
    assert page.locator("#hands-on").is_hidden()
    assert page.locator("#verdicts").is_visible()
    policy = unescape(path.read_text("utf-8").split('Content-Security-Policy" content="')[1].split('"')[0])
    words = ("'wasm-unsafe-eval'", "'unsafe-eval'", "http")
    assert [word in policy for word in words] == [True, False, False]
