"""A declared analysis as a command: its options from the request, its answer from result and section."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature, cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from analyses.request import Option, flag, options
from reports.analyses import Analysis
from reports.cli.drive import SetOption, load_drive, output_quantity
from reports.cli.options import (
    DEFAULT_DESIGN,
    DesignArgument,
    JsonOption,
    QuietOption,
    command_quantity,
    on_axis,
    read_load,
)
from reports.cli.targets import folder_for_results

if TYPE_CHECKING:
    from actuator_lti.design import Design

FolderOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", callback=folder_for_results, help="Write page and JSON there."),
]


def command(one: Analysis) -> Callable[..., None]:
    """The function that typer makes a command of."""

    def run(
        design: str, changes: list[str] | None, out: Path | None, as_json: bool, quiet: bool, **chosen: Any
    ) -> None:
        answer(one, load_drive(design, changes), chosen, out, as_json, quiet)

    needed = any(option.argument for _, option in _options(one).values())  # then a design is, too
    parameters = [
        _parameter("design", DesignArgument, Parameter.empty if needed else DEFAULT_DESIGN),
        _parameter("changes", SetOption, None),
        *(
            _parameter(name, *_option(name, *each, getattr(one.request, name, None)))
            for name, each in _options(one).items()
        ),
        _parameter("out", FolderOption, Path(one.out) if one.out else None),
        _parameter("as_json", JsonOption, False),
        _parameter("quiet", QuietOption, False),
    ]
    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    run.__doc__ = cleandoc(one.words) + (f" In the report: --also {one.name}." if one.also else "")
    return run


def answer(
    one: Analysis, drive: Design, chosen: dict[str, Any], out: Path | None, as_json: bool, quiet: bool
) -> None:
    """Ask, then print the section or the result, and leave with the verdict."""
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress
    from reports.study_pages import study_document, write_pages
    from reports.terminal import print_section

    values = {name: _read(name, option, chosen[name], drive) for name, (_, option) in _options(one).items()}
    with progress(f"{one.doing} {drive.name}", quiet=quiet) as doing:
        more = {"progress": doing} if one.doing else {}
        result = one.run(drive, *one.asked(drive, values), **more)
    first, *others = parts = one.sections(result)
    passed = getattr(result, "verdict", getattr(result, "passed", None))
    files = one.write(result, out)
    if out is not None:
        title = f"{drive.title or drive.name}: {first['title']}"
        made = study_document(drive, parts, title=title, subtitle=first["result"], kind=one.name)
        with progress("drawing figures", quiet=quiet) as drawing:
            files += map(str, write_pages(made, out, one.stem or one.name, progress=drawing))
    if as_json:
        print_json(one.data(result))
    else:
        print_section(first, passed, name=drive.name)
        for part in others:
            print_section(part, None)
        for path in files:
            print_line(f"wrote {path}")
    leave_with(passed in (None, True, "met"))


def _options(one: Analysis) -> dict[str, tuple[Any, Option]]:
    return {} if one.request is None else options(one.request)


def _option(name: str, kind: Any, option: Option, default: Any) -> tuple[Any, Any]:
    """A field as an option of typer; what is not given is None, and the request knows what then."""
    text = {"plain": kind, "load": float}.get(option.kind, str)
    more: dict[str, Any] = {"parser": read_load} if option.kind == "load" else {}
    if option.argument:
        return Annotated[text, typer.Argument(metavar=option.metavar, help=option.words)], Parameter.empty
    made = typer.Option(
        f"--{option.flag or flag(name)}", metavar=option.metavar or None, help=option.words, **more
    )
    return (Annotated[bool, made], default) if kind is bool else (Annotated[text | None, made], None)


def _read(name: str, option: Option, value: Any, drive: Design) -> Any:
    """The value of an option in SI, once the drive is known."""
    if option.kind == "command":
        return command_quantity(f"--{option.flag or flag(name)}", value, drive)
    if option.kind == "output":
        return output_quantity(f"--{option.flag or flag(name)}", value, drive)
    return on_axis(value, drive) if option.kind == "load" and value is not None else value


def _parameter(name: str, annotation: Any, default: Any) -> Parameter:
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
