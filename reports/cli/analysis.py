"""A declared analysis as a command: its options from the request, its answer from result and section."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from inspect import Parameter, Signature
from pathlib import Path
from textwrap import dedent
from typing import TYPE_CHECKING, Annotated, Any

import typer

from actuator_lti.asked.verdict import Verdict
from analyses.request import Kind, OnMachines, Option, flag, is_number, options
from analyses.studies.study_asked import study_with
from reports.analyses import Analysis
from reports.cli import options as common
from reports.cli.errors import leave_with
from reports.cli.output import print_json, print_line, print_note, print_warning, progress

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from analyses.studies.study import Study
    from reports.document_schema import Section

DesignOption = Annotated[
    str | None,
    typer.Option(metavar="DESIGN", help="Design by name or path (default: what the files name, or emps)."),
]
FolderOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", callback=common.folder_for_results, help="Write page and JSON there."),
]

StudyArgument = Annotated[
    str | None, typer.Argument(metavar="STUDY", help="Study file (--example prints one), or a design.")
]
VariantOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help='A variant more: "gear.worm.ratio=50"; repeatable.'),
]


def command(one: Analysis) -> Callable[..., None]:
    usual = getattr(one.request, "design_of", lambda _given: common.DEFAULT_DESIGN)

    def run(design: str | None = None, changes: list[str] | None = None, **given: Any) -> None:
        subject: Design | Study | None = None
        if one.study and design is not None:
            subject = study_with(design, {words: common.read_changes([words]) for words in changes or ()})
        elif not one.alone and not one.study:
            subject = common.load_drive(usual(given) if design is None else design, changes)
        answer(one, subject, **given)

    parameters = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, (annotation, default) in _parameters(one).items()
    ]
    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    words = one.help.replace("[", "\\[")  # of keys, no markup
    run.__doc__ = words + (f"\n\nIn the report: --also {one.name}." if one.also else "")
    return run


def _parameters(one: Analysis) -> dict[str, tuple[Any, Any]]:
    asked = [(name, *each, getattr(one.request, name, None)) for name, each in options(one.request).items()]
    needed = any(option.argument and default is None for _, _, option, default in asked)  # so is a design
    made: dict[str, tuple[Any, Any]] = {}
    if one.study:
        made["design"] = (StudyArgument, None)
    elif hasattr(one.request, "design_of"):
        made["design"] = (DesignOption, None)
    elif not one.alone:
        made["design"] = (common.DesignArgument, Parameter.empty if needed else common.DEFAULT_DESIGN)
    if made:
        made["changes"] = (VariantOption if one.study else common.SetOption, None)
    made |= {name: _option(name, kind, option, default) for name, kind, option, default in asked}
    if one.page:
        made["out"] = (FolderOption, Path(one.out) if one.out else None)
    made["as_json"] = (common.JsonOption, False)
    made["quiet"] = (common.QuietOption, False)
    if one.example:
        made["example"] = (_example(one), False)
    return made


def _example(one: Analysis) -> Any:
    """An option that prints a file to start from: what stands in a module's docstring behind ``::``."""

    def show(wanted: bool) -> None:
        if wanted:
            text = (import_module(one.example).__doc__ or "").split("::", 1)[1]
            typer.echo(dedent(text).strip())
            raise typer.Exit

    words = "Print a file to start from, and stop."
    return Annotated[bool, typer.Option("--example", is_eager=True, callback=show, help=words)]


def _kept_gains(variants: Sequence[Any]) -> Iterable[str]:
    """What is warned of each gain, of the first variant that changes what it does."""
    from actuator_lti.design.suspicions import kept_gains

    made = [(one.name, line) for one in variants if one.design is not None for line in kept_gains(one.design)]
    return {line.partition(":")[0]: f"{name}: {line}" for name, line in reversed(made)}.values()


def answer(
    one: Analysis, subject: Design | Study | None, *, as_json: bool, out: Path | None = None,
    quiet: bool = False, **chosen: Any,
) -> None:  # fmt: skip
    from actuator_lti.design import warnings_of
    from actuator_lti.design.suspicions import beyond_largest
    from analyses.isolation import isolated
    from reports import document as doc
    from reports.as_json import as_json as plain_data
    from reports.as_json import on_a_line
    from reports.study_pages import in_amperes, notices

    drive: Any = getattr(getattr(subject, "base", None), "design", subject)
    values, beyond = dict[str, Any](), list[str]()
    for name, (kind, option) in options(one.request).items():
        of, value = f"--{option.flag or flag(name)}", chosen[name]
        plain = option.kind == "plain" and not is_number(kind)
        way: Kind = "rate" if option.ramps and chosen.get("command") == "ramp" else option.kind
        values[name] = value if plain else common.read_quantity(of, value, way, drive, option.metavar)
        if option.kind == "load" and values[name]:
            beyond += beyond_largest(drive, of, values[name])
    if one.written and (as_json or out is not None):
        values[one.written] = True
    asked = one.asked(subject, values)
    for each in asked:
        if isinstance(each, OnMachines) and each.engine.caution:
            print_note(f"actuator-lti: {each.engine.caution}")
    with progress(f"{one.doing} {getattr(subject, 'name', '')}", quiet=quiet) as doing, isolated() as missing:
        more: dict[str, Any] = {"progress": doing} if one.doing else {}
        more |= {"out": out} if one.keeps else {}
        result = one.run(subject, *asked, **more)
    own = [f"{drive.name}: {warning}" for warning in (*(warnings_of(drive) if one.warns else ()), *beyond)]
    for warning in (*own, *_kept_gains(getattr(subject, "variants", ()))):
        print_warning(warning)
    if (text := one.shows("text", lambda _: None)(result)) is not None:
        print_json({"design": text}) if as_json else print_line(text)
        return
    parts = [*notices(missing, one.name), *in_amperes(one.sections(result), drive)]
    if drive is not None:
        doc.waived(parts, drive)
    verdict = one.verdict(result)
    if verdict is not None:
        parts[bool(missing)]["verdict"] = verdict
    files = one.shows("write", lambda *_: [])(result, out)
    if out is not None:
        files += _pages(one, drive, parts, out, quiet)
    if as_json:
        data = one.shows("data", plain_data)(result)
        print_json(on_a_line(data) if getattr(drive, "axis", "") == "linear" else data)
    else:
        _print(one, drive, result, parts, verdict)
        for path in files:
            print_line(f"wrote {path}")
    leave_with(verdict in (None, Verdict.MET))


def _pages(one: Analysis, drive: Design, parts: Sequence[Section], out: Path, quiet: bool) -> list[str]:
    from reports.html import write_report
    from reports.study_pages import study_document

    title = f"{drive.title or drive.name}: {parts[0]['title']}"
    made = study_document(drive, parts, title=title, subtitle=parts[0]["result"], kind=one.name)
    with progress("drawing figures", quiet=quiet) as drawing:
        return [str(path) for path in write_report(made, out, one.stem or one.name, progress=drawing)]


def _print(
    one: Analysis, drive: Design | None, result: Any, parts: Sequence[Section], verdict: Verdict | None
) -> None:
    from reports.study_pages import in_amperes
    from reports.terminal import print_blocks, print_section, print_verdict

    name = getattr(drive, "name", "")
    if (made := one.shows("brief", lambda _: None)(result)) is not None:
        print_verdict(verdict or Verdict.NOT_MET, f"{name}: {in_amperes(made.words, drive, 'result')}")
        print_blocks(in_amperes(made.blocks, drive), made.notes)
        return
    for k, part in enumerate(parts):
        print_section(part, None if k else verdict, name="" if k else name)


def _option(name: str, kind: Any, option: Option, default: Any) -> tuple[Any, Any]:
    """A field as an option of typer; what is not given is None, and the request knows what then."""
    text = kind if option.kind == "plain" and not is_number(kind) else str
    if option.argument:
        needed = Parameter.empty if default is None else default
        return Annotated[text, typer.Argument(metavar=option.metavar, help=option.words)], needed
    metavar = option.metavar or "NUMBER" * is_number(kind) or None
    made = typer.Option(f"--{option.flag or flag(name)}", metavar=metavar, help=option.words)
    return (Annotated[bool, made], default) if kind is bool else (Annotated[text | None, made], None)
