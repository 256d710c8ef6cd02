"""The browser of all tests that look at a page; which tests are slow; a processor that is not at hand.

``OTHER_PROCESSOR=SEED``: every result of linear algebra a few ulp beside what it was (`machines.beside`).
``RANDOM_ORDER=SEED``: files in another order, and the tests in each; else those with slow tests come first,
so that no process waits for a long last one.
Examples that hypothesis draws are the same in every run and are not timed; ``--hypothesis-profile=search``
draws new ones.
"""

from __future__ import annotations

import gc
import os
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings

from tests.command_line import Command

if TYPE_CHECKING:
    from playwright.sync_api import Browser

if os.environ.get("OTHER_PROCESSOR"):
    from tests.machines import beside

    beside.install(int(os.environ["OTHER_PROCESSOR"]))

settings.register_profile("search", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("same", settings.get_profile("search"), derandomize=True, database=None)
settings.load_profile("same")

# Nobody cuts the power: no test waits for the disk; one has its own to see what is flushed.
os.fsync = os.fstat

SLOW = Path(__file__).with_name("slow.txt")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what `slow.txt` names, by file or by test; turn the order round where asked to."""
    if seed := os.environ.get("RANDOM_ORDER"):
        draw = random.Random(seed)
        files = {item.path: draw.random() for item in items}
        items.sort(key=lambda item: (files[item.path], draw.random()))
    slow = {line for line in SLOW.read_text(encoding="utf-8").splitlines() if line[:1] not in ("", "#")}
    for item in items:
        name = item.nodeid.partition("[")[0]
        if name in slow or name.partition("::")[0] in slow:
            item.add_marker(pytest.mark.slow)
    if not seed:
        first = {item.path for item in items if item.get_closest_marker("slow")}
        items.sort(key=lambda item: item.path not in first)


def pytest_collection_finish() -> None:
    """What was collected stays: looking through it for garbage, again and again, was a tenth of a run.

    What comes after is looked through less often, which was a twentieth.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Start a headless Chromium, or skip where there is none."""
    path = next((result for name in BROWSERS if (result := shutil.which(name))), None)
    if path is None:
        pytest.skip("no Chromium on this machine")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as running:
        started = running.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], object]], Path]:
    """A file or folder that the first who asks for it makes, for all workers of this run."""
    own = tmp_path_factory.getbasetemp()
    folder = own.parent if "PYTEST_XDIST_WORKER" in os.environ else own

    def path_of(name: str, make: Callable[[Path], object]) -> Path:
        path, part = folder / name, folder / f"{name}.part"
        with FileLock(f"{path}.lock"):
            if not path.exists():
                make(part)
                part.rename(path)
        return path

    return path_of


@pytest.fixture
def cli(capsys) -> Command:
    """Run commands of `actuator-lti` in this process."""
    from reports.cli.main import main  # only now: a processor that is not at hand comes first

    return Command(main, capsys)
