"""`actuator-lti objects export` and `objects import`: settings in the motion controller's own objects."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, SetOption, load_drive, write_new
from reports.cli.output import print_json, print_line, print_note

if TYPE_CHECKING:
    from actuator_lti.design.model import ControllerObject

app = typer.Typer(
    help="Settings in the motion controller's own objects: export and import.", no_args_is_help=True
)

TargetOption = Annotated[Path | None, typer.Option(metavar="FILE", help="File to write.")]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite the file if it exists.")]
PerOption = Annotated[
    str | None,
    typer.Option(
        "--velocity-gain-per", metavar="UNIT", help="Unit of 0x2344.01: rad/s (factor 1) or rpm (9.549)."
    ),
]


@app.command("export")
def export(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    out: TargetOption = None,
    per: PerOption = None,
    complete: Annotated[
        bool, typer.Option("--complete", help="Also objects that the imported settings did not have.")
    ] = False,
    into: Annotated[
        Path | None, typer.Option(metavar="XDC", help="Device configuration whose other contents are kept.")
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a design's settings as controller objects: TOML, or XML where FILE ends in .xdc or .xml.

    Try: actuator-lti objects export ilr33-amber --velocity-gain-per rad/s --out settings.toml
    """
    from actuator_lti.design.objects import calibration, export_objects
    from actuator_lti.design.settings_file import settings_xml, write_settings_toml

    drive = load_drive(design, changes)
    if per is not None:
        drive = replace(drive, objects=replace(drive.objects, velocity_gain_factor=calibration(per)))
    result = export_objects(drive, complete=complete or None)
    if into is not None or (out is not None and out.suffix.lower() in (".xdc", ".xml")):
        held, (text, homeless) = "XML", settings_xml(result.objects, into)
    else:
        held, text, homeless = "TOML", write_settings_toml(result.objects), ()
    write_new(out, text, force, held)
    unsaid = held == "XML" and result.objects.velocity_gain_factor != 1.0
    notes = [*(f"rounded: {item}" for item in result.rounded), *result.notes]
    notes += [f"no place for it in {into}: {label}" for label in homeless]
    notes += ["XML has no place for that factor: import it with --velocity-gain-per rpm"] * unsaid
    if as_json:
        plain = {"objects": list(map(_plain, result.objects.values)), "notes": notes}
        plain["velocity_gain_factor"] = result.objects.velocity_gain_factor
        print_json({"schema": "actuator-lti/objects", "version": 1, **plain})
        return
    if out is None:
        print_line(text.rstrip())
    for note in notes:
        print_note(note)


@app.command("import")
def import_settings(
    settings: Annotated[Path, typer.Argument(metavar="SETTINGS", help="Settings file of a controller.")],
    base: Annotated[
        str, typer.Option("--onto", metavar="DESIGN", help="Design that the settings are put into.")
    ] = DEFAULT_DESIGN,
    out: TargetOption = None,
    per: PerOption = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Put controller settings into a design and write it as a design file.

    Known by what stands in them: objects of an MC V3 controller, an EPOS4 export (.dcf, .xdc), an ODrive
    configuration (JSON), a VESC motor configuration (XML), SimpleFOC settings (lines of the sketch).

    Try: actuator-lti objects import settings.toml --onto ilr33-amber --out mine.toml
    """
    from actuator_lti.design import load_design, write_design
    from actuator_lti.design.controller_files import import_controller_file
    from actuator_lti.design.objects import calibration, import_objects
    from actuator_lti.design.settings_file import read_settings
    from actuator_lti.files.reading import shown_path

    factor = None if per is None else calibration(per)
    drive = load_design(base)
    result = import_controller_file(settings, drive) or import_objects(
        read_settings(settings, factor), drive, shown_path(settings)
    )
    text = write_design(result.design)
    write_new(out, text, force)
    if as_json:
        changed = {path: result.design.parameters[path].text for path in result.changed}
        plain = {"changed": changed, "kept": list(map(_plain, result.kept)), "notes": list(result.notes)}
        print_json({"schema": "actuator-lti/objects-import", "version": 1, **plain})
        return
    if out is None:
        print_line(text.rstrip())
    for path, known in ((path, result.design.parameters[path]) for path in result.changed):
        print_note(f"{path} = {known.text}" + f"  ({known.source})" * bool(known.source))
    for line in [*(f"kept: {item.label} = {item.value}" for item in result.kept), *result.notes]:
        print_note(line)


def _plain(item: ControllerObject) -> dict[str, object]:
    return {"object": item.label, "value": item.value, "name": item.name}
