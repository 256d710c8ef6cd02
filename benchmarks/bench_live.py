"""How long margins, curves, run and verdicts take to follow a slider of the report, in Chromium."""

from __future__ import annotations

import shutil
import statistics
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.row import Row

if TYPE_CHECKING:
    from playwright.sync_api import Page

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
DESIGNS = ("ilr33-amber", "ilr33-amber-multirate", "emps", "fin", "joint", "ballscrew")
TARGET_MS = 50.0
ROUNDS = 2


def rows(quick: bool = False) -> Iterable[Row]:
    """Move every slider of some designs and take the time that the page itself measures."""
    path = next((result for name in BROWSERS if (result := shutil.which(name))), None)
    if path is None:
        return
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        browser = running.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name in DESIGNS[: 1 if quick else None]:
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            page.goto(_written(name, Path(folder)).as_uri())
            page.wait_for_selector("#hands-on[data-ready]")
            taken = [ms for _ in range(1 if quick else ROUNDS) for ms in _moved(page)]
            note = f"median of {len(taken)} moves, the longest {max(taken):.0f} ms"
            yield Row(
                group="live",
                name=f"slider to figures, {name}",
                measured=statistics.median(taken),
                unit="ms",
                target=TARGET_MS,
                note=note,
            )
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
