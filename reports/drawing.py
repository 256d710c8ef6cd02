"""All figures of a document as SVG, drawn in several processes where that pays."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from analyses.isolation import Missing, caught, note
from reports.figures.registry import draw_svg

Progress = Callable[[int, int], None]
WORTH_A_PROCESS = 6
PLACEHOLDER = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 420 60"><text x="10" y="36" font-size="12"'
    ' fill="currentColor">This figure could not be drawn; the exit status was 3.</text></svg>'
)


def draw_all(
    blocks: Sequence[Mapping[str, Any]],
    processes: int = 1,
    progress: Progress | None = None,
    page: bool = True,
) -> list[str]:
    """Draw figure blocks, in order; one that fails is a notice in its place, and is noted.

    Parameters
    ----------
    blocks : sequence of mapping
        Figure blocks of a document.
    processes : int
        The result does not depend on it.
    progress : callable, optional
        Called with (drawn, in all).
    page : bool
        Whether the colours follow a page (see `reports.figures.registry.draw_svg`).
    """
    jobs = [(block["figure"], block["data"], f"f{k + 1}", page) for k, block in enumerate(blocks)]
    drawn: list[str] = []
    with _mapper(processes if len(jobs) >= WORTH_A_PROCESS else 1) as run:
        for svg, missing in run(_draw, jobs):
            drawn.append(svg or PLACEHOLDER)
            note([missing] if missing else [])
            if progress is not None:
                progress(len(drawn), len(jobs))
    return drawn


@contextmanager
def _mapper(processes: int) -> Iterator[Callable[..., Iterator[Any]]]:
    """Give ``map`` here or over processes."""
    if processes <= 1:
        yield map
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        yield pool.map


def _draw(job: tuple[str, Any, str, bool]) -> tuple[str | None, Missing | None]:
    """Draw one figure; its data pass through JSON, so that a page equals one made of report.json."""
    name, data, prefix, page = job

    def draw() -> str:
        return draw_svg(name, json.loads(json.dumps(data, allow_nan=False)), prefix=prefix, page=page)

    return caught(f"figure {prefix[1:]} ({name})", draw)
