"""The page in a real browser: no error, no request, every figure to be seen, on any screen and on paper."""

import io
import unicodedata
from pathlib import Path

import pypdf
import pytest
from live_page import Built, Page

AXE = Path(__file__).parents[2] / "node_modules" / "axe-core" / "axe.min.js"  # by `make page`
FOUND = """() => axe.run(document, { resultTypes: ["violations"] }).then(({ violations }) => violations
    .filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(({ id, nodes }) => [id, nodes[0].html]))"""
STOPS = """[...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex]")]
    .filter((one) => one.tabIndex >= 0 && !one.disabled && one.checkVisibility()).length"""
OPEN_ALL = """document.querySelectorAll('main details, figure[hidden]')
    .forEach((one) => { one.open = true; one.hidden = false; })"""
DESK = {"viewport": {"width": 1400, "height": 900}}
SCREENS = {
    "desktop, light": {**DESK, "color_scheme": "light"},
    "desktop, dark": {**DESK, "color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}, "color_scheme": "light"},
}
LIGHT = """() => [["body", "backgroundColor"], ["figure svg text", "fill"]].map(([of, part]) =>
    getComputedStyle(document.querySelector(of))[part].match(/\\d+/g).reduce((sum, x) => sum + +x, 0))"""
FIRST = (".overall", ".weakest", ".said", ".bars", "#answer figure.half", ".findings")


@pytest.mark.parametrize("screen", SCREENS)
def test_no_sideways_scrolling_every_figure_with_ink_and_the_ground_is_dark_where_asked(
    opens, built: Built, screen: str
) -> None:
    page, wide = opens(built.page, **SCREENS[screen]), SCREENS[screen]["viewport"]["width"]
    assert page.evaluate("document.documentElement.scrollWidth") <= wide
    ground, ink = page.evaluate(LIGHT)
    assert (ground < ink) is ("dark" in screen)
    page.evaluate(OPEN_ALL)
    figures = page.locator("figure svg.plot")
    assert figures.count() == built.page.read_text(encoding="utf-8").count('<svg class="plot"') > 10
    for figure in figures.all():
        box = figure.bounding_box()
        assert min(box["width"] / 200, box["height"] / 100) > 1
        assert figure.locator(".world path, .marks use").count() > 2


def test_the_first_screen_is_one_screen_its_bars_to_scale_and_the_open_page_few(opens, built: Built) -> None:
    """Bar and limit stand on one scale from 0: their ratio is that of the numbers."""
    page = opens(built.page, **DESK)
    for selector in FIRST:
        for part in page.locator(selector).all():
            box = part.bounding_box()
            assert 0 <= box["y"] <= 900 - box["height"], (selector, box)
    assert page.locator(".findings li").count() <= 3
    assert page.evaluate("document.documentElement.scrollHeight") <= 6 * 900
    bars = next(one for one in built.document["sections"][0]["blocks"] if one["kind"] == "glance")["bars"]
    assert len(bars) == page.locator(".bar-row").count() == 12
    for bar, row in zip(bars, page.locator(".bar-row").all(), strict=True):
        (start, now), (low, high) = row.evaluate(
            "row => ['.found', '.limit'].map(s => row.querySelector(s).getBoundingClientRect())"
            ".map(box => [box.left, box.right])"
        )
        part = (now - start) / ((low + high) / 2 - start)
        assert part == pytest.approx(bar["value"] / bar["limit"], rel=0.02)


def test_keys_links_and_buttons_lead_to_what_they_say_and_put_folds_back(opens, built: Built) -> None:
    page = opens(built.page, **DESK)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "content"
    page.evaluate(
        "window.seen = [];"
        "window.print = () => seen.push(document.querySelectorAll('main details[open]').length); null"
    )
    for name in ("Print summary", "Print all"):
        page.get_by_role("button", name=name).click()
        page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate("seen") == [0, page.locator("main details").count()]
    assert page.locator("#limits figure").is_hidden()
    assert page.locator("#limits .result").is_visible()
    page.locator('.said a[href="#limits"]').click()
    assert page.locator("#limits figure").is_visible()
    page.locator('.toc a[href="#margins"]').click()
    assert abs(page.locator("#margins").bounding_box()["y"]) < 120
    page.goto(built.page.as_uri() + "#margins")
    page.reload()
    assert page.locator("#margins table").first.is_visible()
    assert page.locator("#limits figure").is_hidden()


def printed(page: Page) -> list[pypdf.PageObject]:
    """Its sheets; figures have their room, but none of the curves that are long to read."""
    page.evaluate(
        "document.querySelectorAll('figure svg').forEach(({ style }) => style.visibility = 'hidden')"
    )
    return list(pypdf.PdfReader(io.BytesIO(page.pdf(prefer_css_page_size=True))).pages)


def test_paper_is_white_short_and_ends_no_page_with_a_heading(opens, built: Built) -> None:
    """The summary on four pages; with all folds open, too."""
    page = opens(built.page, color_scheme="dark")
    page.emulate_media(media="print", color_scheme="dark")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert not page.locator(".toc").is_visible()
    sheets = printed(page)
    assert len(sheets) <= 4
    words = "".join("".join(sheet.extract_text().split()) for sheet in sheets)
    summary = unicodedata.normalize("NFKC", words)
    for part in built.document["sections"]:
        assert "".join(part["title"].split()) in summary or part["id"] == "answer"
    page.evaluate(OPEN_ALL.replace("main details", ".claim > details"))
    sheets = printed(page)
    assert len(sheets) <= 15
    titles = {part["title"] for part in built.document["sections"]}
    results = " ".join(part["result"] for part in built.document["sections"])
    for sheet in sheets:
        last = sheet.extract_text().strip().splitlines()[-1].strip()
        assert last not in titles
        assert last not in results


@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: make page")
def test_axe_finds_nothing_serious_and_few_stops_to_tab(opens, built: Built) -> None:
    page = opens(built.page, bypass_csp=True)
    page.evaluate(AXE.read_text(encoding="utf-8"))
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        assert page.evaluate(FOUND) == []
    assert page.evaluate(STOPS) < 220
