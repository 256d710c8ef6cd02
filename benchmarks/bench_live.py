"""How long margins, curves, run and verdicts take to follow a slider or a dragged curve, in Chromium.

Of each move the least of several counts: the machine may do other things meanwhile.
"""

from __future__ import annotations

import shutil
import statistics
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from actuator_lti.design.loader import shipped_designs
from benchmarks.row import Row

if TYPE_CHECKING:
    from playwright.sync_api import Page

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
TARGET_MS = 50.0
ROUNDS = 3
# a place on a curve where nothing lies above it, on the screen
MIDDLE = """(node) => {
    node.ownerSVGElement.scrollIntoView({ block: "center" });
    for (const part of [0.5, 0.6, 0.7, 0.8, 0.9, 0.4, 0.3, 0.2]) {
        const place = node.getPointAtLength(part * node.getTotalLength());
        const at = place.matrixTransform(node.getScreenCTM());
        if (document.elementFromPoint(at.x, at.y) === node) return [at.x, at.y];
    }
}"""


def rows(quick: bool = False) -> Iterable[Row]:
    """Move every slider of some designs and take the time that the page itself measures."""
    path = next((result for name in BROWSERS if (result := shutil.which(name))), None)
    if path is None:
        return
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        browser = running.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name in shipped_designs()[: 1 if quick else None]:
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            page.goto(_written(name, Path(folder)).as_uri())
            page.wait_for_selector("#hands-on[data-ready]")
            dragged = [_dragged(page) for _ in range(1 if quick else ROUNDS)]
            rounds = [_moved(page) for _ in range(1 if quick else ROUNDS)]
            taken = [min(times) for times in zip(*rounds, strict=True)]
            note = f"of {len(taken)} sliders, median {statistics.median(taken):.0f} ms"
            yield Row(f"longest slider to figures, {name}", max(taken), "ms", TARGET_MS, note=note)
            yield Row(
                f"longest step of a drag to figures, {name}",
                max(min(times) for times in zip(*dragged, strict=True)),
                "ms",
                TARGET_MS,
            )
            page.close()
        browser.close()


def _written(name: str, folder: Path) -> Path:
    """Write the page of a shipped design."""
    from actuator_lti import load_design
    from reports.build import design_report
    from reports.document import dumps, loads
    from reports.html import page

    path = folder / f"{name}.html"
    path.write_text(page(loads(dumps(design_report(load_design(name))))), encoding="utf-8")
    return path


def _moved(page: Page) -> list[float]:
    """Move every slider a little, by the keyboard; the times that the page measured."""
    taken = []
    page.evaluate("document.querySelectorAll('.group').forEach((group) => (group.open = true))")
    for slider in page.locator(".row input[type=range]").all():
        count = page.get_attribute("#hands-on", "data-count")
        slider.press("ArrowRight")
        page.wait_for_function("(n) => document.getElementById('hands-on').dataset.count !== n", arg=count)
        taken.append(float(page.get_attribute("#hands-on", "data-ms") or "nan"))
    return taken


def _dragged(page: Page) -> list[float]:
    """Drag the magnitude of the loop that is shown, up and down again; the times that the page measured."""
    taken = []
    x, y = (round(value) for value in page.locator('[data-chart="bode"] path.grab').evaluate(MIDDLE))
    page.mouse.move(x, y)
    page.mouse.down()
    for by in (*range(1, 9), *range(7, -1, -1)):
        count = page.get_attribute("#hands-on", "data-count")
        page.mouse.move(x, y - by)
        page.wait_for_function("(n) => document.getElementById('hands-on').dataset.count !== n", arg=count)
        taken.append(float(page.get_attribute("#hands-on", "data-ms") or "nan"))
    page.mouse.up()
    return taken
