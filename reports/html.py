"""A document as one self-contained page: no request to anywhere, opens from disk, prints, goes dark.

Everything that comes from a file of the user is escaped by the templates; only the figures, which
escape their own text, are put in as they are.
"""

import base64
import hashlib
import itertools
import json
from collections.abc import Mapping
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup, escape

from actuator_lti.files.atomic import write_together
from actuator_lti.files.reading import Tree
from actuator_lti.types import Progress
from reports.charts.svg import draw_all
from reports.document import dumps, figures, loads
from reports.glossary import meaning
from reports.numbers import show, show_signed
from reports.scripts import asset, bundled
from reports.verdict_summary import role, verdict_lines, why
from reports.visible import LINE_END, visible

LONG_TABLE = 13  # rows; longer tables fold
KICKERS = {"report": "Loop analysis report"}


def write_report(
    made: Mapping[str, Any], folder: str | PathLike[str], stem: str = "report", *, progress: Progress = None
) -> tuple[Path, Path]:
    """Write a document as ``<stem>.html`` and ``<stem>.json``; both or neither."""
    content = dumps(made)
    html = page(loads(content), progress=progress, beside=f"{stem}.json")
    paths = (Path(folder) / f"{stem}.html", Path(folder) / f"{stem}.json")
    write_together({paths[0]: html.encode(), paths[1]: content.encode()})
    return paths


def page(made: Mapping[str, Any], *, progress: Progress = None, beside: str = "") -> str:
    """Make the page of a document (of `reports.document`); ``progress``: (figures drawn, figures in all).

    ``beside``: the file with its figures.
    """
    drawings = draw_all(figures(made), progress)
    kicker = KICKERS.get(made.get("kind", "report"), "Report")
    about = {"doc": made, "kicker": kicker, "beside": beside, **_live(made)}
    return render("report.html", drawn=lambda block: Markup(drawings[id(block)]), **about)


def _live(made: Mapping[str, Any]) -> Tree:
    """Give what the sliders of a page need: data, module, empty figures; nothing where it has none."""
    known = made.get("live")
    if not known or known.get("refused"):
        return {}
    from nonlinear.export.wasm_module import kept_wasm
    from reports.live.charts import live_charts

    # within a script element only "<" could end it; JSON may write it otherwise
    data = json.dumps(known, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    drawn = live_charts(str(known["step"]["unit"]), known["axis"], known["ampere"])
    return {
        "live": Markup(data),
        "module": base64.b64encode(kept_wasm()).decode(),
        "live_charts": {name: Markup(text) for name, text in drawn.items()},
    }


def render(template: str, *, style: str = "", code: str = "", **context: Any) -> str:
    """Fill a template that extends ``base.html``; every page gets the same style (and ``style``) and policy.

    The script is ``code``, else that of every report. A page with sliders (``live`` is given) has one script
    more, and may compile WebAssembly.
    """
    counter, live = itertools.count(1), "live" in context
    code, sheet = code or script(live=live), Markup(asset("style.css") + style)
    context |= {"security_policy": security_policy(code, wasm=live), "script": Markup(code)}
    context["unique"] = lambda letter: f"{letter}{next(counter)}"
    return environment().get_template(template).render(stylesheet=sheet, **context)


def _breakable(name: str) -> Markup:
    return Markup(LINE_END.sub(r"\g<0><wbr>", str(escape(name))))


@cache
def environment() -> Environment:
    """Give the template environment: everything is escaped, an unknown name is an error."""
    made = Environment(
        loader=PackageLoader("reports"), autoescape=select_autoescape(default=True, default_for_string=True),
        finalize=_seen, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    made.filters |= {"show": show, "show_signed": show_signed, "breakable": _breakable}
    made.globals |= {"term": _term, "verdict_lines": verdict_lines, "role": role, "why": why}
    made.globals["LONG_TABLE"] = LONG_TABLE
    return made


def _term(heading: str) -> Markup:
    """The attribute by which a heading says its line of the glossary; nothing for a word that has none."""
    line = meaning(heading)
    return Markup(' title="{}"').format(line) if line else Markup("")


def _seen(value: Any) -> Any:
    """What a template puts in: texts of files so that they are seen, not obeyed; markup of ours as it is."""
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value


@cache
def script(*, live: bool = False) -> str:
    """Give the one script of a page: folds and printing, the live figures, and sliders where it has any."""
    return bundled("folds", "figures", "hands") if live else bundled("folds", "figures")


def security_policy(script: str, *, wasm: bool) -> str:
    """Give the page's content security policy: no request at all, and only this script runs."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    scripts = f"'sha256-{digest}'" + " 'wasm-unsafe-eval'" * wasm
    own = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
    return f"{own}; script-src {scripts}; base-uri 'none'"
