"""The report of the shipped baseline, built once for all tests of this folder; pages to open."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from live_page import AMBER, Built, opened, written

from actuator_lti import Design
from analyses.validation import Settings, validate
from reports.build import design_report
from reports.document import load
from reports.html import write_report
from reports.sections.validation import section


@pytest.fixture(scope="session")
def built(once: Callable[..., Path]) -> Built:
    """The report of ilr33-amber at a fixed time, with a coarse validation."""
    findings = ("injected sweep", "motion from rest", "large signals")
    coarse = Settings(findings=findings, rest_frequencies=10, map_counts=(10, 16))

    def write(folder: Path) -> None:
        write_report(design_report(AMBER, section(validate(AMBER, coarse))), folder)

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        data = once("report", write) / "report.json"
    return Built(load(data), data.with_suffix(".html"), data)


@pytest.fixture
def opens(browser, once) -> Iterator[Callable[..., Any]]:
    """Open pages, of a design or from disk; in the end none has complained or asked for anything."""
    trouble: list[str] = []
    pages = []

    def call(what: Design | Path, fragment: str = "", **options: Any) -> Any:
        path = written(what, once) if isinstance(what, Design) else what
        pages.append(opened(browser, path, trouble, fragment, **options))
        return pages[-1]

    yield call
    for page in pages:
        page.context.close()
    assert trouble == []


@pytest.fixture
def fresh(opens) -> Any:
    """The page of ilr33-amber, once it has followed; nothing has happened on it."""
    made = opens(AMBER)
    made.done()
    return made


@pytest.fixture(scope="module")
def shared(browser, once) -> Iterator[Callable[[Design], Any]]:
    """Pages of designs, each opened once for all tests of a file: values are put back, history is kept."""
    trouble: list[str] = []
    pages: dict[Design, Any] = {}

    def call(design: Design) -> Any:
        if design not in pages:
            pages[design] = opened(browser, written(design, once), trouble)
        pages[design].done()
        if pages[design].is_enabled('[data-do="reset"]'):
            pages[design].does("reset")
        return pages[design]

    yield call
    for page in pages.values():
        page.context.close()
    assert trouble == []


@pytest.fixture
def page(shared) -> Any:
    """The page of ilr33-amber, with its values."""
    return shared(AMBER)
