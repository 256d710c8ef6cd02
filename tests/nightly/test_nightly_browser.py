"""The site in a real browser: sort, search, open a report, dark mode, print, keyboard, contrast."""

import re
from pathlib import Path

import pytest
from nightly_fakes import CODE, INLINE, Calendar, job, study

from reports.nightly.night import run_night


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """Five nights of seven designs: one fails, one raises, one regressed, one flaps, one changed."""
    folder = tmp_path_factory.mktemp("browser") / "site"
    clock = Calendar()
    for k in range(6):
        margins = {"gear 66:1": 12.0, "gear 100:1": 5.0, "gear 30:1": 8.0 - (k == 5)}
        margins |= {"fast velocity loop": 9.0 + k % 2, "Über drive": 20.0, "<i>odd</i> name": 7.0}
        jobs = [job(*named) for named in margins.items()]
        jobs.append(job("broken", mode="raise" if k == 5 else ""))
        run_night(study(*jobs), folder, INLINE, code=CODE, clock=clock.next())
    return folder


@pytest.fixture
def page(browser, site):
    """The index at desktop size; fails on any error in the page and on any request beyond the disk."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    made = context.new_page()
    problems: list[str] = []
    made.on("pageerror", lambda error: problems.append(str(error)))
    made.on("console", lambda m: problems.append(m.text) if m.type in ("error", "warning") else None)
    made.on("request", lambda r: None if r.url.startswith(("file:", "data:")) else problems.append(r.url))
    made.goto((site / "index.html").as_uri())
    yield made
    context.close()
    assert problems == []


def names(page) -> list[str]:
    return page.eval_on_selector_all(
        "#designs tbody tr:not([hidden]) th a", "links => links.map(a => a.textContent)"
    )


def open_design(page) -> None:
    page.locator("#designs").get_by_role("link", name="gear 30:1", exact=True).click()


def test_the_worst_come_first_and_every_column_sorts_both_ways(page) -> None:
    assert names(page)[:3] == ["broken", "gear 100:1", "gear 30:1"]
    page.get_by_role("button", name="Design").click()
    gears = ["gear 30:1", "gear 66:1", "gear 100:1"]
    assert names(page) == ["<i>odd</i> name", "broken", "fast velocity loop", *gears, "Über drive"]
    head = page.get_by_role("columnheader", name="Design")
    assert head.get_attribute("aria-sort") == "ascending"
    page.get_by_role("button", name="Design").click()
    assert head.get_attribute("aria-sort") == "descending"
    assert names(page)[0] == "Über drive"
    page.get_by_role("button", name="Nearest limit").click()
    assert names(page)[1:3] == ["gear 100:1", "gear 30:1"]
    page.get_by_role("button", name="Changed").click()
    page.get_by_role("button", name="Changed").click()
    assert set(names(page)[:2]) == {"gear 30:1", "fast velocity loop"}
    assert page.locator("th[aria-sort]").count() == 1


def test_search_and_filters_narrow_the_table_and_say_so(page) -> None:
    search = page.get_by_role("searchbox", name="Search designs")
    for words, found in (("gear 100", ["gear 100:1"]), ("<i>", ["<i>odd</i> name"]), ("nothing like it", [])):
        search.fill(words)
        assert names(page) == found
        assert page.get_by_role("status").inner_text() == f"{len(found)} of 7 shown"
    assert page.get_by_role("button", name="All").inner_text() == "All 7"
    assert page.get_by_text("No design fits").is_visible()
    search.fill("")
    page.get_by_role("button", name="Failing").click()
    assert names(page) == ["gear 100:1"]
    assert page.get_by_role("button", name="Failing").get_attribute("aria-pressed") == "true"


def test_keyboard_alone_sorts_and_opens_a_report(page) -> None:

    def tab_to(what: str, wanted: str, presses: int) -> None:
        for _ in range(presses):
            page.keyboard.press("Tab")
            if page.evaluate(f"document.activeElement.{what}") == wanted:
                return
        pytest.fail(f"{wanted} is not reached")

    tab_to("textContent", "Skip to the content", 1)
    tab_to("dataset.key", "name", 40)
    page.keyboard.press("Enter")
    assert names(page)[0] == "<i>odd</i> name"
    tab_to("textContent", "report", 60)
    page.keyboard.press("Enter")
    page.wait_for_url("**/report.html")
    assert page.title() == "report"


def test_a_design_page_shows_trends_changes_and_every_night(page) -> None:
    open_design(page)
    assert page.get_by_role("heading", level=1).inner_text() == "gear 30:1"
    assert page.get_by_role("img", name="gain margin: 7.000 dB in the last night").is_visible()
    assert "1 change(s) of level" in page.locator("svg.plot").first.get_attribute("aria-label")
    assert page.get_by_text("control.position.gain 8 → 7 1/s").first.is_visible()
    assert page.locator("table.nights tbody tr").count() == 6
    page.get_by_role("link", name="Report of 2026-01-02").click()
    page.wait_for_url("**/report.html")


def test_trends_are_live_figures(page) -> None:
    """The night and its value are read off at the pointer; the figure zooms."""
    open_design(page)
    plot = page.locator("svg.plot").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.5 * box["height"])
    chart = page.locator(".chart").first
    assert re.search(r"2026-01-0.*8\.00 dB", chart.locator(".readout").inner_text(), re.DOTALL)
    chart.get_by_role("button", name="Zoom in").click()
    assert plot.locator(".panel.zoomed").count() == 1
    chart.get_by_role("button", name="Show everything").click()
    page.mouse.click(box["x"] + 0.97 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_url("**/report.html")


def test_a_broken_design_says_why(page) -> None:
    page.get_by_role("link", name="broken", exact=True).click()
    assert page.get_by_role("heading", name="Why there is no result").is_visible()
    assert page.get_by_text("ValueError: this design cannot be built").first.is_visible()


CONTRAST = """() => {
  const rgb = (text) => text.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (node) => {
    for (; node; node = node.parentElement) {
      const colour = rgb(getComputedStyle(node).backgroundColor.replace(/color\\(srgb ([^)]*)\\)/,
        (_, v) => v.split(" ").map((x) => x * 255).join(" ")));
      if (colour.length < 4 || colour[3] > 0.99) return colour;
    }
    return [255, 255, 255];
  };
  const low = [];
  for (const node of document.querySelectorAll("body *")) {
    const own = [...node.childNodes].some((c) => c.nodeType === 3 && c.textContent.trim());
    const style = getComputedStyle(node);
    if (!own || node.closest("[aria-hidden=true], svg, script, style, .skip")) continue;
    if (style.visibility === "hidden" || !node.getClientRects().length) continue;
    const [a, b] = [light(rgb(style.color)), light(ground(node))].sort((x, y) => y - x);
    const ratio = (a + 0.05) / (b + 0.05);
    if (ratio < 4.5) low.push([node.tagName, node.textContent.trim().slice(0, 30), ratio.toFixed(2)]);
  }
  return low;
}"""


def test_every_page_has_contrast_captions_and_words_beside_colours_and_fits_a_phone(page) -> None:
    for mark in page.locator(".mark").all():
        assert len(mark.inner_text().split()) >= 2, mark.inner_text()
    for opened in (lambda: None, lambda: open_design(page)):
        opened()
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
            assert (sum(int(v) for v in ground[4:-1].split(",")) < 200) == (scheme == "dark")
            assert page.evaluate(CONTRAST) == []
        for table in page.locator("table").all():
            assert table.locator("caption").count() == 1
            assert table.locator("th:not([scope])").count() == 0
        page.set_viewport_size({"width": 360, "height": 740})
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        page.set_viewport_size({"width": 1280, "height": 900})


def test_it_prints_black_on_white_without_the_controls(page, tmp_path) -> None:
    pypdf = pytest.importorskip("pypdf")
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert not page.get_by_role("searchbox").is_visible()
    page.pdf(path=str(tmp_path / "p.pdf"), format="A4")
    text = "".join(sheet.extract_text() for sheet in pypdf.PdfReader(tmp_path / "p.pdf").pages)
    shown = ("gear 100:1", "failing", "Search designs")
    assert [words in text for words in shown] == [True, True, False]


def test_without_scripts_the_table_is_complete(browser, site) -> None:
    page = browser.new_context(java_script_enabled=False).new_page()
    page.goto((site / "index.html").as_uri())
    assert page.locator("#designs tbody tr").count() == 7
