"""`actuator-lti validate`: the linear predictions of a design checked by the nonlinear simulator."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, QuietOption
from reports.cli.targets import folder_for_results

if TYPE_CHECKING:
    from analyses.isolation import Missing
    from analyses.validation import Validation
    from reports.document_schema import Document

FolderOption = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        callback=folder_for_results,
        help="Also write validation.html and validation.json there.",
    ),
]
QuickOption = Annotated[
    bool,
    typer.Option("--quick", help="Checks and verdict only, as without --out and --json."),
]


def validate(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    out: FolderOption = None,
    as_json: JsonOption = False,
    quick: QuickOption = False,
    quiet: QuietOption = False,
) -> None:
    """Check every prediction against the derivative of the nonlinear simulator, and show where it ends.

    Each row is met, not met or not proven. Exit status 1 if one is not met or not proven, if the drive does
    not come to rest, or if a command within full deflection makes it diverge. The page (--out) and --json
    also show what is large, starts from rest, or is shaken by counts.
    """
    from analyses.isolation import isolated
    from analyses.validation import QUICK, Settings
    from analyses.validation import validate as run
    from reports.cli.errors import leave_with
    from reports.cli.progress import progress

    drive = load_drive(design, changes)
    with progress(f"validating {drive.name}", quiet=quiet) as report, isolated() as missing:
        shown = not quick and (out is not None or as_json)
        result = run(drive, Settings() if shown else QUICK, report)
    made = _document(result, missing)
    paths = _write(made, out, quiet) if out is not None else ()
    if as_json:
        _print_json(made)
    else:
        _print_tables(result, made, paths)
    leave_with(result.passed)


def _document(validation: Validation, missing: Sequence[Missing]) -> Document:
    """The validation as a document of its own."""
    from actuator_lti.design import design_hash
    from reports import document as doc
    from reports.build import design_head, notices
    from reports.provenance import provenance
    from reports.sections.validation import section

    design = validation.design
    return doc.document(
        title=f"{design.title or design.name}: validation",
        subtitle="Predictions against the nonlinear simulation",
        design=design_head(design),
        provenance=provenance(design_hash(design)),
        sections=[*notices(missing, "validation"), *section(validation)],
        kind="validation",
    )


def _write(made: Document, folder: Path, quiet: bool) -> tuple[Path, ...]:
    """Write the page and its JSON; both or neither."""
    from actuator_lti.atomic import write_together
    from reports.cli.progress import progress
    from reports.document import dumps, loads
    from reports.html import page

    content = dumps(made)
    with progress("drawing figures", quiet=quiet) as drawing:
        html = page(loads(content), progress=drawing)
    paths = (folder / "validation.html", folder / "validation.json")
    write_together({paths[0]: html.encode(), paths[1]: content.encode()})
    return paths


def _print_json(made: Document) -> None:
    from reports.cli.output import print_line
    from reports.document import dumps

    print_line(dumps(made).rstrip("\n"))


def _print_tables(validation: Validation, made: Document, paths: tuple[Path, ...]) -> None:
    """Print the verdict, every check, and what is large."""
    from reports import document as doc
    from reports.cli.output import print_line
    from reports.sections.validation import by_loop, loop_name, table
    from reports.terminal import print_blocks, print_verdict

    shown = ("quantity", "predicted", "found", "unit", "error", "allowed", "verdict")
    tables = [
        doc.with_columns(table(rows, loop_name(name)), shown)
        for name, rows in by_loop(validation.rows).items()
    ]
    tables += [doc.text(part["result"]) for part in made["sections"] if part["id"] == "conditional"]
    print_verdict(validation.verdict, str(validation))
    for label, reason in _not_met(made):
        print_line(f"not met: {label}{f': {reason}' if reason else ''}")
    print_blocks(tables, validation.notes)
    for path in paths:
        print_line(str(path))


def _not_met(made: Document) -> list[tuple[str, str]]:
    """Every check of the document that is not met, and why."""
    blocks = [block for part in made["sections"] for block in part["blocks"]]
    items = [item for block in blocks if block["kind"] == "verdicts" for item in block["items"]]
    return [(item["label"], item["reason"]) for item in items if item["verdict"] == "not met"]
