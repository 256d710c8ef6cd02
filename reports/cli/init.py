"""`actuator-lti init`: a design file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from reports.cli.options import JsonOption
from reports.cli.targets import refuse_existing

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="Design file to write.")]
FromOption = Annotated[
    str | None,
    typer.Option("--from", metavar="NAME", help="Start from this design (shipped name or file) instead."),
]
# Kind of drive, and the shipped design that it starts from; None is the starter with all keys explained.
KINDS: dict[str, str | None] = {"servo-axis": None, "joint": "joint", "ballscrew": "ballscrew", "fin": "fin"}
KindOption = Annotated[
    str | None,
    typer.Option("--kind", metavar="KIND", help=f"Start from a typical drive: {', '.join(KINDS)}."),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite FILE if it exists.")]


def init(
    file: FileArgument = Path("my-drive.toml"),
    source: FromOption = None,
    kind: KindOption = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a commented design file to start one's own drive from."""
    from actuator_lti.design import read_design_text
    from actuator_lti.files.atomic import write_text
    from reports.cli.output import print_json, print_line

    refuse_existing(file, force)
    text = _renamed(_source_text(source if kind is None else _of_kind(kind, source)), file.stem)
    read_design_text(text, str(file))
    write_text(file, text)
    if as_json:
        print_json({"schema": "actuator-lti/init", "version": 1, "file": str(file)})
        return
    print_line(f"wrote {file}; next: actuator-lti report {file}")


def _of_kind(kind: str, source: str | None) -> str | None:
    """The shipped design of a kind, None for the starter."""
    from actuator_lti.errors import InputError

    if source is not None:
        raise InputError(f'--kind = "{kind}": not allowed beside --from')
    if kind not in KINDS:
        raise InputError(f'--kind = "{kind}": allowed: {", ".join(KINDS)}')
    return KINDS[kind]


def _source_text(source: str | None) -> str:
    """The text to start from, comments included."""
    from actuator_lti.design.loader import design_text

    if source is None:
        return (Path(__file__).parents[1] / "templates" / "design.toml").read_text(encoding="utf-8")
    return design_text(source)


def _renamed(text: str, name: str) -> str:
    """The text with the design's name set to that of the file, where it can be one."""
    import re

    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}", name):
        return text
    return re.sub(r'(?m)^(\[design\]\n(?:[^\[\n]*\n)*?name = )"[^"\n]*"', rf'\1"{name}"', text, count=1)
