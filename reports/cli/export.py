"""`actuator-lti export`: the running drive as C99 or an FMU, its controller for firmware, linear loops."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.files.tree import Tree
from reports.cli.drive import SetOption, load_drive
from reports.cli.export_linear import linear
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption
from reports.cli.targets import folder_for_results, refuse_existing

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from analyses.linear.code_check import CodeCheck

app = typer.Typer(
    help="The drive outside of Python: C99, FMU, controller for firmware, linear models.",
    no_args_is_help=True,
)
app.command("linear")(linear)

CheckOption = Annotated[
    bool,
    typer.Option(
        "--check/--no-check",
        help="Measure the margins of the compiled code (sweep by injection, borders in time) and say so in "
        "the export; needs a C compiler.",
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]


@app.command("c")
def c(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="DIR", help="Folder for the files.", callback=folder_for_results),
    ] = Path("drive-c"),
    single: Annotated[bool, typer.Option("--single", help="float in place of double.")] = False,
    check: CheckOption = True,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write the drive as C99: drive.h, drive.c, the design's parameters, an example and a README."""
    from actuator_lti.files.atomic import write_together
    from nonlinear.export import c_export
    from reports.export_check import check_text

    drive = load_drive(design, changes)
    texts = c_export(drive, single_precision=single)
    for name in texts:
        refuse_existing(out / name, force)
    result = _checked(drive) if check else None
    texts["README.md"] += "\n" + check_text(result, single_precision=single)
    write_together({out / name: text.encode() for name, text in texts.items()})
    about = {"files": [str(out / name) for name in texts]}
    _answer("export-c", about, f"{out}: {', '.join(texts)}", result, as_json)


class NumberType(StrEnum):
    """Types of a number in C."""

    double = "double"
    float = "float"


@app.command("controller")
def controller(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="DIR", help="Folder for the files.", callback=folder_for_results),
    ] = Path("controller-c"),
    number: Annotated[NumberType, typer.Option("--type", help="Type of a number.")] = NumberType.float,
    prefix: Annotated[
        str, typer.Option("--prefix", metavar="NAME_", help="In front of every symbol.")
    ] = "drive_",
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write the controller alone as C99 for firmware, with test vectors and a class for C++."""
    from actuator_lti.files.atomic import write_together
    from nonlinear.export import controller_export

    drive = load_drive(design, changes)
    texts = controller_export(drive, single_precision=number == NumberType.float, prefix=prefix)
    for name in texts:
        refuse_existing(out / name, force)
    write_together({out / name: text.encode() for name, text in texts.items()})
    about = {"type": str(number), "files": [str(out / name) for name in texts]}
    _answer("export-controller", about, f"{out}: {', '.join(texts)}", None, as_json)


def _checked(drive: Design) -> CodeCheck:
    from analyses.linear.code_check import check_code
    from nonlinear.runs.waiting import told_if_slow

    with told_if_slow("measuring the margins of the compiled code (--no-check leaves it out)"):
        return check_code(drive)


def _answer(schema: str, about: Tree, words: str, result: CodeCheck | None, as_json: bool) -> None:
    """Print what was written and what the check has found, and leave with its verdict."""
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.export_check import summary

    if result is not None:
        about = {**about, "check": {"passed": not result.failed, "result": summary(result)}}
    if as_json:
        print_json({"schema": f"actuator-lti/{schema}", "version": 1, **about})
    else:
        print_line("\n".join([words, *([summary(result)] if result else [])]))
    leave_with(result is None or not result.failed)


@app.command("fmu")
def fmu(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write; default NAME.fmu.")
    ] = None,
    version: Annotated[int, typer.Option("--fmi", metavar="2|3", help="Version of FMI.")] = 2,
    platform: Annotated[
        list[str] | None,
        typer.Option("--platform", metavar="NAME", help="linux64 or win64, may be repeated; default both."),
    ] = None,
    plain: Annotated[bool, typer.Option("--plain", help="Without reports inside, and no check.")] = False,
    check: CheckOption = True,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write the drive as a co-simulation FMU: binaries, sources, every key of the design as a parameter."""
    from actuator_lti.files.atomic import write_bytes
    from nonlinear.export import PLATFORMS, fmu_bytes, refuse_unknown
    from reports.export_documents import export_documents
    from reports.model_picture import model_png
    from reports.provenance import package_version

    drive = load_drive(design, changes)
    target = out or Path(f"{drive.name}.fmu")
    refuse_existing(target, force)
    platforms = tuple(dict.fromkeys(platform or PLATFORMS))
    refuse_unknown(version, platforms)
    result = _checked(drive) if check and not plain else None
    data = fmu_bytes(
        drive,
        version,  # type: ignore[arg-type]
        platforms,
        documents={} if plain else export_documents(drive, result),
        picture=model_png(drive),
        tool=f"actuator-lti {package_version()}",
    )
    write_bytes(target, data)
    about: Tree = {"file": str(target), "fmi": version, "platforms": platforms, "bytes": len(data)}
    words = f"{target}: FMI {version}.0 co-simulation, {', '.join(platforms)}, {len(data)} bytes"
    _answer("export-fmu", about, words, result, as_json)
