"""What tests do with the sliders of a report's page: open, move, read, save, and ask the command line."""

import json
import math
import re
from collections.abc import Callable
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from typer.testing import CliRunner

from actuator_lti import Design, load_design
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import write_design
from reports.build import design_report
from reports.cli.app import build
from reports.document import dumps, loads
from reports.html import page as page_of

Browser = Locator = Page = Any  # of playwright, which is not on every machine
AMBER = load_design("ilr33-amber")
HOSTILE = "<script>alert(1)</script> \"quoted\" 'single' & $x^2$ ]]> \u202e {{ 7*7 }}"
SEEN = HOSTILE.replace("\u202e", "⟨U+202E⟩")  # a page shows marks of direction, and does not obey them
LIVE = "JSON.parse(document.getElementById('live-data').textContent)"
FIGURES = {  # of the page: of `margins --json`
    "gain_margin": "gain_margin_db",
    "phase_margin": "phase_margin_deg",
    "delay_margin": "delay_margin_s",
    "sensitivity_peak": "sensitivity_peak_db",
    "bandwidth": "bandwidth_hz",
    "overshoot": "overshoot_percent",
    "settling_time": "settling_time_s",
}
ON_CURVE = """(node) => { // of its middle part, and under nothing else
    for (const part of [0.5, 0.6, 0.7, 0.8, 0.9, 0.4, 0.3]) {
        const place = node.getPointAtLength(part * node.getTotalLength());
        const at = place.matrixTransform(node.getScreenCTM());
        if (document.elementFromPoint(at.x, at.y) === node) return [at.x, at.y];
    }
}"""
RESPONSE = ("bandwidth", "overshoot", "settling_time")


class Built(NamedTuple):
    """A report, its page and its JSON on disk."""

    document: dict[str, Any]
    page: Path
    data: Path


def written(design: Design, once: Callable[..., Path]) -> Path:
    """The page of a design without validation on disk, built once for all tests of a run."""

    def write(path: Path) -> None:
        path.write_text(page_of(loads(dumps(design_report(design)))), encoding="utf-8")

    return once(f"{sha256(write_design(design).encode()).hexdigest()}.html", write)


def opened(browser: Browser, path: Path, trouble: list[str], fragment: str = "", **options: Any) -> Page:
    """Open a page from disk, offline; complaints and requests are collected.

    ``live``: wait for its sliders; ``first``: a script that runs before its own; all else is the browser's.
    """
    live, first = options.pop("live", True), options.pop("first", "")
    chosen = {"viewport": {"width": 1400, "height": 1000}, **options}
    page = browser.new_context(offline=True, accept_downloads=True, **chosen).new_page()
    page.add_init_script(first)
    own = path.as_uri()
    page.on("console", lambda message: trouble.append(message.text))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    page.on("request", lambda r: trouble.append(r.url) if r.url.split("#")[0] != own else None)
    page.goto(own + fragment)
    if live:
        page.wait_for_selector("#hands-on[data-ready]", timeout=30_000)
    return Live(page)


class Live:
    """A page with sliders; what is not here is the browser's."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def __getattr__(self, name: str) -> Any:
        return getattr(self.page, name)

    def settled(self, act: Any) -> None:
        """Do something and wait until the page has followed."""
        count = self.get_attribute("#hands-on", "data-count")
        act()
        self.wait_for_function("(n) => document.getElementById('hands-on').dataset.count !== n", arg=count)
        self.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def does(self, what: str, of: str = "") -> None:
        """Press one of its buttons: undo, redo, reset, pin, ..."""
        self.settled(lambda: self.click(f'[data-do="{what}"]{of}'))

    def type_value(self, key: str, value: float) -> None:
        """Type a value, in the unit of the page, into the field of a key."""
        row = f'.row[data-path="{key}"]'
        self.eval_on_selector(row, "(node) => { node.closest('details').open = true; }")
        self.settled(lambda: (self.fill(f"{row} .field", repr(value)), self.press(f"{row} .field", "Enter")))

    def done(self, timeout_ms: float = 30_000.0) -> None:
        """Wait until that has followed, too, that comes behind."""
        self.wait_for_selector("#hands-on[data-behind=done]", timeout=timeout_ms)

    def read(self) -> dict[str, dict[str, float]]:
        """Read every figure of the page, to all digits."""
        self.done()
        told = "all => all.map(td => [td.dataset.loop, td.dataset.figure, td.dataset.value])"
        result: dict[str, dict[str, float]] = {}
        for loop, name, value in self.locator(".now td[data-figure]").evaluate_all(told):
            result.setdefault(loop, {})[name] = float(value.replace("Infinity", "inf"))
        return result

    def field(self, key: str) -> float:
        """The value of a key in the unit of the page, as its slider says it."""
        return float(self.input_value(f'.row[data-path="{key}"] .field'))

    def sliders(self) -> dict[str, dict[str, Any]]:
        """What its sliders move, by path."""
        return {one["path"]: one for one in self.evaluate(f"{LIVE}.keys")}

    def spot(self, selector: str, across: float = 0.5, down: float = 0.5) -> tuple[float, float]:
        """A place within a part of the page, which is scrolled to."""
        self.locator(selector).scroll_into_view_if_needed()
        box = self.locator(selector).bounding_box()
        return box["x"] + across * box["width"], box["y"] + down * box["height"]

    def grab(self, chart: str) -> tuple[float, float]:
        """A place on the curve of a chart that can be taken hold of."""
        return tuple(map(round, self.locator(f'[data-chart="{chart}"] path.grab').evaluate(ON_CURVE)))

    def saved(self, path: Path) -> Path:
        with self.expect_download() as waiting:
            self.click('[data-do="save"]')
        waiting.value.save_as(path)
        return path


def command_line(path: Path | str) -> Any:
    done = CliRunner().invoke(build(), ["margins", str(path), "--json"])
    assert done.exit_code in (0, 1), done.output
    return json.loads(done.stdout)


def verdicts_agree(page: Page, verdicts: list[dict[str, Any]]) -> None:
    """Compare value and verdict of every requirement that the page judges."""
    page.done()
    told = "all => all.map(({ dataset }) => [dataset.id, dataset.loop, dataset.value, dataset.met])"
    rows = page.locator("table.demands tbody tr").evaluate_all(told)
    apart = {each["id"] for each in page.evaluate(f"{LIVE}.apart")}
    ours = {(id, loop or None): (value, met) for id, loop, value, met in rows}
    for item in verdicts:
        id = item["id"].removesuffix(f"/{item['loop']}")
        if id in apart and (id, item["loop"]) not in ours:
            continue
        value, met = ours.pop((id, item["loop"]))
        assert met == {"met": "true", "not met": "false", "not proven": "null"}[item["verdict"]], item
        if item["value"] is not None and math.isfinite(item["value"]):
            assert float(value) == pytest.approx(item["value"], rel=1e-9, abs=1e-9), item
    assert not ours, ours


def agree(ours: dict[str, dict[str, float]], loops: dict[str, Any], filtered: bool = False) -> None:
    """Compare every figure judged; bandwidth and step are behind the mean of a profile, through a filter."""
    for loop, bare in loops.items():
        own = bare.get("judged", bare)
        for name, key in FIGURES.items():
            result = own.get("to_reference", own) if name in RESPONSE and not filtered else own
            if result[key] is None:  # there is none: the page must not show one
                assert not math.isfinite(ours[loop][name]), (loop, name)
            elif math.isfinite(result[key]):
                assert ours[loop][name] == pytest.approx(result[key], rel=1e-9, abs=1e-9), (loop, name)


HANDS, SIZE = '.toc a[href="#hands-on"]', ".run-keys label:has-text('Size') input"
EACH, LOOPS = "#answer details.fold > summary", "table.loops"
# question: what is clicked (and typed), where the answer stands, and what it looks like
QUESTIONS = {
    "Is it good?": ([], ".masthead .overall", r"\d+ of \d+ requirements met"),
    "Which loop is worst?": ([], ".weakest strong", r"(Current|Velocity|Position) loop"),
    "By how much?": ([], ".weakest", r"not stable|margin [−-]?[\d.]+.*(above|below)"),
    "Who checked that?": ([], ".said a", r"checked|checks"),
    "Is it linear?": ([], '.said a[href="#limits"]', r"linear (up to [\d.]+ Hz; above, the .+ acts|over)"),
    "What is nearest?": ([], ".bar-row >> nth=0", r"[\d.]+\n?\s*[≥≤] [\d.]+"),
    "How fast is it?": ([EACH], LOOPS, r"bandwidth[\s\S]+[\d.]+ "),
    "How much delay can I add?": ([HANDS], "#hands-on .now", r"Delay margin ms[\s\S]+loop\t[\s\S]+\d"),
    "What happens at 20?": ([HANDS, SIZE], ".acting", r"^(No limit acts|Limits that act).+changed"),
    "What is assumed?": (['.toc a[href="#parameters"]'], "#parameters", r"\d+ of them assumed"),
    "Where is phase lost?": (['.toc a[href="#delays"]'], "#delays", r"delay[\s\S]+deg"),
}  # fmt: skip


def answered_within_two_clicks(page: Page) -> None:
    """Ten questions on a screen of 1400 by 900; what is not clicked for is seen without scrolling."""
    page.set_viewport_size({"width": 1400, "height": 900})
    for question, (clicks, place, pattern) in QUESTIONS.items():
        assert len(clicks) <= 2
        page.goto(page.url.split("#")[0] + "#content")
        for each in clicks:
            page.click(each)
        if SIZE in clicks:
            page.fill(SIZE, "20")
            page.press(SIZE, "Enter")
            page.done()
        answer = page.locator(place).first
        assert answer.is_visible(), question
        assert re.search(pattern, answer.inner_text()), (question, answer.inner_text())
        if not clicks:
            box = answer.bounding_box()
            assert box["y"] + box["height"] <= 900, question


def same_figures(page: Page, design: Design, what: str = "") -> None:
    """Compare every figure of every loop with those of the linear form; an unstable loop's S has no peak."""
    theirs, ours = linear_figures(Population(design, {}, 1)), page.read()
    for loop, name in product(theirs.loops, FIGURES):
        wanted = float(theirs.quantity(name, loop)[0])
        if math.isfinite(wanted):
            assert ours[loop][name] == pytest.approx(wanted, rel=1e-9, abs=1e-9), (what, loop, name)
        elif name == "sensitivity_peak" and not theirs.stable(loop)[0]:
            assert math.isnan(wanted)
            assert math.isnan(ours[loop][name])
