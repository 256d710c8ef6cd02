"""`actuator-lti keys`: every key of a design file, with unit, default, range and meaning."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from reports.cli.options import JsonOption

MatchArgument = Annotated[
    str, typer.Argument(metavar="TEXT", help="Only keys whose name or meaning holds this text.")
]
LinearOption = Annotated[bool, typer.Option("--linear", help="Units of a linear axis (m, N, kg).")]


def keys(match: MatchArgument = "", linear: LinearOption = False, as_json: JsonOption = False) -> None:
    """List the keys of a design file: unit, default, allowed range, meaning, example.

    A repeated table stands as gear.* (by name), friction.point.* and control.velocity.filter.* (by number).
    Try: actuator-lti keys notch
    """
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
        print_json({"schema": "actuator-lti/keys", "version": 1, "keys": [key.as_dict() for key in result]})
        return
    out = console()
    section = ""
    for key in result:
        if key.section != section:
            section = key.section
            out.print(f"\n[bold]\\[{section}][/bold]", highlight=False)
        out.print(f"  {key.key}{_facts(key)}", markup=False, highlight=False, soft_wrap=True)
        out.print(f"      {key.description}", markup=False, highlight=False, soft_wrap=True)


def _facts(key: Any) -> str:
    """Unit, default and range of a key, in one line."""
    parts = [] if key.unit == "1" else [f"unit {key.unit}"]
    parts += ["required"] if key.required else [f"default {key.default}"] if key.default else []
    parts += [f"allowed {key.allowed}"] if key.allowed else []
    parts += [f'e.g. "{key.example}"'] if key.example else []
    return f": {'; '.join(parts)}" if parts else ""
