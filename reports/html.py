"""A document as one self-contained page: no request to anywhere, opens from disk, prints, goes dark.

Everything that comes from a file of the user is escaped by the templates; only the figures, which
escape their own text, are put in as they are.
"""

from __future__ import annotations

import base64
import hashlib
import html
import itertools
import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from reports.document import figures
from reports.drawing import Progress, draw_all
from reports.numbers import MISSING, show, significant
from reports.verdict_summary import verdict_lines

SMALLEST, LARGEST = 0.92, 1.35  # pixels for a point of a figure: text stays between 8 and 12 pixels
KICKERS = {"report": "Loop analysis report"}


def page(
    made: Mapping[str, Any],
    *,
    template: str = "report.html",
    processes: int = 1,
    progress: Progress | None = None,
) -> str:
    """Make the page of a document.

    Parameters
    ----------
    made : mapping
        A document of `reports.document`.
    template : str
        The template that lays it out; it gets the document as ``doc``.
    processes : int
        How many processes draw the figures; the page does not depend on it.
    progress : callable, optional
        Called with (figures drawn, figures in all).
    """
    blocks = figures(made)
    drawings = dict(zip(map(id, blocks), draw_all(blocks, processes, progress), strict=True))

    def drawn(block: Mapping[str, Any]) -> Markup:
        return _labelled(drawings[id(block)], block["alt"])

    kicker = KICKERS.get(made.get("kind", "report"), "Report")
    return render(template, doc=made, drawn=drawn, kicker=kicker)


def render(template: str, **context: Any) -> str:
    """Fill a template that extends ``base.html``; every page gets the same style, script and policy."""
    counter = itertools.count(1)
    return (
        environment()
        .get_template(template)
        .render(
            stylesheet=Markup(asset("style.css")),
            script=Markup(asset("page.js")),
            security_policy=security_policy(asset("page.js")),
            verdict_lines=verdict_lines,
            unique=lambda letter: f"{letter}{next(counter)}",
            **context,
        )
    )


@cache
def environment() -> Environment:
    """Give the template environment: everything is escaped, an unknown name is an error."""
    made = Environment(
        loader=PackageLoader("reports"),
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["show"] = show
    made.filters["show_signed"] = show_signed
    return made


@cache
def asset(name: str) -> str:
    """Give the text of a style sheet or script that stands beside the templates."""
    source, _, _ = PackageLoader("reports").get_source(Environment(autoescape=True), name)
    return source


def security_policy(*scripts: str) -> str:
    """Give the page's content security policy: no request at all, and only these scripts run."""
    hashes = " ".join(f"'sha256-{_sha256(script)}'" for script in scripts)
    return (
        f"default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src {hashes}; base-uri 'none'"
    )


def show_signed(value: float | None, digits: int = 3) -> str:
    """Write a difference with its sign."""
    if value is None:
        return MISSING
    return ("+" if value > 0 else "") + significant(value, digits)


def _sha256(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _labelled(svg: str, alt: str) -> Markup:
    """Give a figure the text that stands for it where it cannot be seen, and the bounds of its width."""
    box = re.search(r'viewBox="0 0 ([\d.]+) ', svg)
    width = float(box.group(1)) if box else 600.0
    bounds = f"min-width:{SMALLEST * width:.0f}px;max-width:{LARGEST * width:.0f}px"
    return Markup(
        svg.replace("<svg ", f'<svg role="img" aria-label="{html.escape(alt)}" style="{bounds}" ', 1)
    )
