"""`actuator-lti keys`: every key of a design file, with unit, default, range and meaning."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

import typer

from reports.cli.options import JsonOption

MatchArgument = Annotated[
    str, typer.Argument(metavar="TEXT", help="Only keys whose name or meaning holds this text.")
]
ExplainOption = Annotated[
    str | None,
    typer.Option(
        "--explain", metavar="FILE", help="The numbers of a design: written, read as, in the model as."
    ),
]
LinearOption = Annotated[bool, typer.Option("--linear", help="Units of a linear axis (m, N, kg).")]


def keys(
    match: MatchArgument = "",
    explain: ExplainOption = None,
    linear: LinearOption = False,
    as_json: JsonOption = False,
) -> None:
    """List the keys of a design file: unit, default, allowed range, meaning, example.

    A repeated table stands as gear.* (by name), friction.point.* and control.velocity.filter.* (by number).
    Try: actuator-lti keys notch, or actuator-lti keys --explain my.toml
    """
    if explain is not None:
        _explain(explain, match, as_json)
        return
    from actuator_lti.design.key_reference import key_reference
    from actuator_lti.errors import InputError
    from reports.cli.output import console, print_json

    result = [
        key
        for key in key_reference("linear" if linear else "rotary")
        if match.lower() in key.path.lower() or match.lower() in key.description.lower()
    ]
    if not result:
        raise InputError(f"{match!r}: no key has it in its name or meaning; allowed: see actuator-lti keys")
    if as_json:
        print_json({"schema": "actuator-lti/keys", "version": 1, "keys": [asdict(key) for key in result]})
        return
    out = console()
    section = ""
    for key in result:
        if key.section != section:
            section = key.section
            out.print(f"\n[bold]\\[{section}][/bold]", highlight=False)
        out.print(f"  {key.key}{_facts(key)}", markup=False, highlight=False, soft_wrap=True)
        out.print(f"      {key.description}", markup=False, highlight=False, soft_wrap=True)


def _explain(name_or_path: str, match: str, as_json: bool) -> None:
    """Show how each number of a design was understood."""
    from actuator_lti.design import load_design
    from actuator_lti.design.explained import explained
    from reports.cli.output import console, print_json

    design = load_design(name_or_path)
    rows = [asdict(item) for item in explained(design) if match.lower() in item.path]
    if as_json:
        print_json({"schema": "actuator-lti/explained", "version": 1, "design": design.name, "keys": rows})
        return
    rows = [{"path": "key", "written": "written", "read": "read as", "model": "in the model as"}, *rows]
    widths = [max(len(row[column]) for row in rows) for column in rows[0]]
    for row in rows:
        line = "  ".join(text.ljust(width) for text, width in zip(row.values(), widths, strict=True))
        console().print(line.rstrip(), markup=False, highlight=False, soft_wrap=True)


def _facts(key: Any) -> str:
    """Unit, default and range of a key, in one line."""
    parts = [] if key.unit == "1" else [f"unit {key.unit}"]
    parts += ["required"] if key.required else [f"default {key.default}"] if key.default else []
    parts += [f"allowed {key.allowed}"] if key.allowed else []
    parts += [f'e.g. "{key.example}"'] if key.example else []
    return f": {'; '.join(parts)}" if parts else ""
