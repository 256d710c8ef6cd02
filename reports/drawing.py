"""All figures of a document as SVG."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from reports.figures.registry import draw_svg

Progress = Callable[[int, int], None]


def draw_all(
    blocks: Sequence[Mapping[str, Any]], progress: Progress | None = None, page: bool = True
) -> list[str]:
    """Draw figure blocks, in order.

    Parameters
    ----------
    blocks : sequence of mapping
        Figure blocks of a document; their data pass through JSON, so that a page equals one made of
        report.json.
    progress : callable, optional
        Called with (drawn, in all).
    page : bool
        Whether for a page or for paper (see `reports.figures.registry.draw_svg`).
    """
    drawn: list[str] = []
    for k, block in enumerate(blocks):
        data = json.loads(json.dumps(block["data"], allow_nan=False))
        drawn.append(draw_svg(block["figure"], data, prefix=f"f{k + 1}", page=page, alt=block["alt"]))
        if progress is not None:
            progress(len(drawn), len(blocks))
    return drawn
