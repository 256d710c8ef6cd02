"""`actuator-lti validate`: the linear predictions of a design checked by the nonlinear simulator."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, QuietOption
from reports.cli.targets import folder_for_results

if TYPE_CHECKING:
    from analyses.isolation import Missing
    from analyses.validation import Validation
    from reports.document_schema import Block, Document

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
    bool, typer.Option("--quick", help="Fewer frequencies, a coarser map; no margins by amplitude.")
]


def validate(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    out: FolderOption = None,
    as_json: JsonOption = False,
    quick: QuickOption = False,
    quiet: QuietOption = False,
) -> None:
    """Check every linear prediction against the nonlinear simulation.

    Exit status 1 if a prediction fails where it should hold, if a command within full deflection makes the
    drive diverge, or if nothing could be judged. Predictions that cannot hold (friction, a limit) are shown
    with the reason.
    """
    from analyses.isolation import isolated
    from analyses.validation import QUICK, Settings
    from analyses.validation import validate as run
    from reports.cli.errors import leave_with
    from reports.cli.progress import progress

    drive = load_drive(design, changes)
    with progress(f"validating {drive.name}", quiet=quiet) as report, isolated() as missing:
        result = run(drive, QUICK if quick else Settings(), report)
    made = _document(result, missing)
    paths = _write(made, out, quiet) if out is not None else ()
    if as_json:
        _print_json(made)
    else:
        _print_tables(result, made, paths)
    leave_with(result.passed and made["verdict"]["passed"])


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
        subtitle="Linear predictions against the nonlinear simulation",
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
    """Print the ledger, the conditional stability, and the verdict."""
    from reports.cli.output import print_line
    from reports.sections.validation import by_loop, loop_name
    from reports.terminal import print_blocks, print_verdict

    tables = [_ledger(rows, loop_name(name)) for name, rows in by_loop(validation.ledger).items()]
    sections = {part["id"]: part for part in made["sections"]}
    if "conditional" in sections:
        from reports import document as doc

        tables.append(doc.text(sections["conditional"]["result"]))
        tables += [block for block in sections["conditional"]["blocks"] if block["kind"] in ("text", "table")]
    passed = validation.passed and made["verdict"]["passed"] is not False
    failed = validation.verdict if not validation.passed else "FAIL"
    print_verdict(passed, str(validation), failed=failed)
    for label, reason in _not_met(made):
        print_line(f"not met: {label}{f': {reason}' if reason else ''}")
    print_blocks(tables, validation.notes)
    for path in paths:
        print_line(str(path))
    print_line(f"{sum(validation.seconds.values()):.1f} s")


def _not_met(made: Document) -> list[tuple[str, str]]:
    """Every check of the document that is not met, and why."""
    blocks = [block for part in made["sections"] for block in part["blocks"]]
    items = [item for block in blocks if block["kind"] == "verdicts" for item in block["items"]]
    return [(item["label"], item["reason"]) for item in items if item["verdict"] == "not met"]


def _ledger(rows: Any, caption: str) -> Block:
    """The ledger of one loop for a terminal: fewer columns, verdicts in colour."""
    from reports import document as doc
    from reports.document_schema import Mark
    from reports.sections.validation import STATUS, WORD, row_of

    columns = [
        doc.column("quantity", "Prediction"),
        doc.column("predicted", "Linear", format="sig:5"),
        doc.column("measured", "Simulated", format="sig:5"),
        doc.column("unit", ""),
        doc.column("difference", "Difference", format="sig:2"),
        doc.column("tolerance", "Allowed", format="sig:2"),
        doc.column("verdict", "Verdict"),
        doc.column("why", "Under, because"),
    ]
    lines = []
    for row in rows:
        shown = row_of(row)
        small = row.passed is not None
        shown["verdict"] = Mark(text=WORD[row.passed], status=STATUS[row.passed])
        shown["why"] = row.reason if small else f"{row.condition}: {row.reason}"
        lines.append(shown)
    return doc.table(caption, columns, lines)
