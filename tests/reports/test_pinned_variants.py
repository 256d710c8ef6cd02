"""Pinned variants beside the drive as it is now, and one cursor through all figures of a loop."""

import re

import pytest
from live_page import AMBER, FIGURES, LIVE, Page, command_line

from actuator_lti import load_design

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
        wanted[letter] = command_line(page.saved(tmp_path / f"{letter}.toml"))["position"]
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
