"""Every figure of a page as SVG, PNG and CSV: what is saved is what the document holds and the page shows."""

import csv
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from live_page import Browser, Built, Page
from matplotlib.image import imread

from reports import document as doc

SIZE = 1e-4  # of a panel's range: a hundredth of a point of some hundred


@pytest.fixture(scope="module")
def page(browser: Browser, built: Built) -> Page:
    made = browser.new_context(offline=True, viewport={"width": 1400, "height": 900}).new_page()
    made.goto(built.page.as_uri())
    made.wait_for_selector("#hands-on[data-ready]")
    made.evaluate(
        "window.trouble = [];"
        "addEventListener('securitypolicyviolation', (event) => trouble.push(event.violatedDirective))"
    )
    return made


def save(page: Page, place: str, kind: str, folder: Path) -> Path:
    chart = page.locator(f"{place} .chart").first
    chart.scroll_into_view_if_needed()
    chart.hover()
    chart.locator(".save-as > summary").click()
    with page.expect_download() as download:
        chart.get_by_role("button", name=f"as {kind}").click()
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    assert page.evaluate("trouble") == []
    return path


def test_a_table_has_the_curves_of_the_document(page: Page, built: Built, tmp_path: Path) -> None:
    path = save(page, "#answer", "CSV", tmp_path)
    assert path.name == "answer-1.csv"
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    chart = doc.figures(built.document)[0]["chart"]
    for k, panel in enumerate(chart["columns"][0]["panels"], start=1):
        own = next(item for item in panel["items"] if item["kind"] == "curve" and item.get("label"))
        found = [row for row in rows if row["panel"] == str(k) and row["y is"] == panel["y"]["label"]]
        x, y = ([float(row[key]) for row in found] for key in ("x", "y"))
        assert found[0]["x is"] == "frequency, Hz"
        assert len(x) > 100
        drawn = zip(own["x"], own["y"], strict=True)
        inside = [(a, b) for a, b in drawn if x[0] < a < x[-1] and b is not None]
        between = np.interp(np.log([a for a, _ in inside]), np.log(x), y)
        room = SIZE * (panel["y"]["high"] - panel["y"]["low"])
        assert between == pytest.approx([b for _, b in inside], abs=20 * room)


def test_a_drawing_stands_alone(page: Page, tmp_path: Path) -> None:
    path = save(page, '[data-chart="bode"]', "SVG", tmp_path)
    assert path.name == "hands-on-bode.svg"
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"var\(|https?://(?!www\.w3\.org)", text)
    root = ET.fromstring(text)
    words = {"".join(node.itertext()) for node in root.iter() if node.tag.endswith("text")}
    assert {"magnitude, dB", "phase, deg", "frequency, Hz", "as designed", "as changed", "−180"} <= words
    paths = [node.get("d", "") for node in root.iter() if node.tag.endswith("path")]
    assert sum(len(path) > 2000 for path in paths) >= 4


def test_a_picture_has_ink_on_paper(page: Page, tmp_path: Path) -> None:
    pixels = imread(save(page, '[data-chart="step"]', "PNG", tmp_path))
    high, wide = pixels.shape[:2]
    assert wide > 800
    assert high > 500
    assert pixels[2, 2, 3] == 1.0  # paper, not nothing
    blue = (np.abs(pixels[:, :, :3] - np.array([0.0, 0x72 / 255, 0xB2 / 255])) < 0.02).all(axis=2)
    assert blue.sum() > 200


def test_a_legend_names_no_curve_that_is_not_there_and_a_double_click_selects_no_text(page: Page) -> None:
    shown = page.locator('[data-chart="run"] .keys li:visible').all_inner_texts()
    assert shown == ["command", "as designed", "as changed"]  # no record was dropped
    border = page.locator('[data-chart="linear-limit"]')
    drawn = border.locator("path.curve").evaluate_all("all => all.filter(p => p.getAttribute('d')).length")
    assert border.locator(".keys li:visible").count() == drawn < border.locator(".keys li").count()
    chart = page.locator("#answer .chart").first
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    page.mouse.dblclick(box["x"] + box["width"] / 2, box["y"] + 60)
    assert page.evaluate("getSelection().toString()") == ""
    assert "moved" in (chart.get_attribute("class") or "")
