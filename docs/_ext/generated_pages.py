"""Pages made from the sources at each build: keys of a design file, commands, quantities, terms, pictures."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import Any


def cell(text: str) -> str:
    """A text as a cell of a Markdown table."""
    return " ".join(text.split()).replace("|", "\\|").replace("*", "\\*").replace("<", "&lt;")


def code(text: str) -> str:
    """A text as code in a cell; nothing where it is empty."""
    return f"`{' '.join(text.split())}`".replace("|", "\\|") if text else ""


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return [f"| {' | '.join(line)} |" for line in lines] + [""]


def keys_page() -> str:
    """Every key of a design file, from the registry of fields."""
    from actuator_lti.design.key_reference import key_reference

    lines = [
        "# Keys of a design file",
        "",
        "Made from the registry of fields; `actuator-lti keys TEXT` searches the same list on the terminal.",
        "Units are those of a rotary axis; on a linear axis read N for N m, m for rad and kg for kg m².",
        "A table that repeats stands as `gear.*` (by name) or `control.velocity.filter.*` (by number).",
        'A quantity may be a table: `{ value = "0.2 mH", source = "...", grade = "A", tolerance = "10 %" }`.',
        "",
    ]
    for section, entries in groupby(key_reference(), key=lambda key: key.section):
        rows = [
            [
                code(key.key),
                code(key.unit if key.unit != "1" else ""),
                "required" if key.required else cell(key.default),
                cell(key.allowed),
                cell(key.description) + (f" E.g. {code(key.example)}" if key.example else ""),
            ]
            for key in entries
        ]
        title = f"## `[{section}]`" if section else "## Whole file"
        lines += [title, "", *table(["key", "unit", "default", "allowed", "meaning"], rows)]
    return "\n".join(lines)


def quantities_page() -> str:
    """Every quantity that a requirement may limit."""
    from actuator_lti.asked.quantities import QUANTITIES

    rows = [
        [
            code(each.name),
            code(each.unit),
            each.scope,
            "minimum" if each.better > 0 else "maximum",
            cell(each.description),
        ]
        for each in QUANTITIES.values()
    ]
    head = ["quantity", "unit", "of", "usual limit", "definition"]
    intro = "What `quantity = ...` of a `[[requirement]]` may name; from `actuator_lti.asked.quantities`."
    return "\n".join(["# Requirement quantities", "", intro, "", *table(head, rows)])


def commands_page() -> str:
    """Every command with its arguments and options, from the command line itself."""
    import typer

    from reports.cli.app import PANELS, build

    lines = [
        "# Commands",
        "",
        "Made from the command line itself; each command has `--help`. Exit status: 0 what is judged is met,",
        "1 something is not or not proven to be, 2 bad input, 3 no result (failure, time limit, crash).",
        "`python -m reports.cli` is the same program where `actuator-lti` is not on the path.",
        "",
    ]
    root = typer.main.get_command(build())
    lines += ["## Options of every command", "", *_options(root)]
    for panel, names in PANELS.items():
        lines += [f"## {panel}", ""]
        for name in names:
            lines += _command(root.commands[name], f"actuator-lti {name}", 3)  # type: ignore[attr-defined]
    return "\n".join(lines)


def _command(command: Any, path: str, level: int) -> list[str]:
    import inspect

    words = inspect.cleandoc(command.help or "")
    lines = [f"{'#' * level} `{path}`", "", *(_prose(words))]
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    if arguments:
        rows = [[code(_metavar(each)), cell(getattr(each, "help", "") or "")] for each in arguments]
        lines += table(["argument", "meaning"], rows)
    lines += _options(command)
    for name, inner in getattr(command, "commands", {}).items():
        lines += _command(inner, f"{path} {name}", level + 1)
    return lines


def _prose(words: str) -> list[str]:
    return [
        line.replace("*", "\\*").replace("[", "\\[").replace("<", "&lt;") for line in words.splitlines()
    ] + [""]


def _metavar(parameter: Any) -> str:
    return str(parameter.metavar or (parameter.name or "").upper())


def _options(command: Any) -> list[str]:
    rows = []
    for each in command.params:
        if each.param_type_name != "option" or each.name == "help" or getattr(each, "hidden", False):
            continue
        names = ", ".join((*each.opts, *each.secondary_opts))
        taken = "" if each.is_flag else f" {_metavar(each)}"
        rows.append([code(names + taken), cell(each.help or "")])
    return table(["option", "meaning"], rows) if rows else []


def glossary_page() -> str:
    """Every term of reports with its line."""
    from reports.glossary import glossary

    rows = [[cell(term), cell(line)] for term, line in glossary().items()]
    intro = "The words of reports and of this documentation; a heading of a report's table says its own line."
    return "\n".join(["# Glossary", "", intro, "", *table(["term", "meaning"], rows)])


def diagram_page() -> str:
    """The drive as a block diagram with its keys."""
    from drive_diagram import diagram_page as page

    return page()


PAGES = {
    "diagram": diagram_page,
    "keys": keys_page,
    "commands": commands_page,
    "quantities": quantities_page,
    "glossary": glossary_page,
}


def write_pages(app: Any) -> None:
    """Write the pages into the sources, where they changed."""
    folder = Path(app.srcdir) / "generated"
    folder.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        text, path = page().rstrip() + "\n", folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def write_picture(app: Any) -> None:
    """Draw the landing page's map of the limiters."""
    import matplotlib as mpl

    mpl.use("Agg")
    from actuator_lti import assemble_loops, load_design
    from analyses.large_signal.map import amplitude_map

    design = load_design("ilr33-amber")
    axes = amplitude_map(design, assemble_loops(design), counts=(14, 24)).plot_map()
    path = Path(app.srcdir) / "generated" / "map.svg"
    axes.figure.savefig(path, bbox_inches="tight", metadata={"Date": None})


def setup(app: Any) -> dict[str, Any]:
    """Tell Sphinx to write the pages before it looks for pages."""
    app.connect("builder-inited", write_pages)
    app.connect("builder-inited", write_picture)
    return {"parallel_read_safe": True}
