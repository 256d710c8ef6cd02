"""Arguments and options that several commands share, and what they mean; imports only typer."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.errors import InputError

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from actuator_lti.files.reading import Tree
    from analyses.request import Kind


def folder_for_results(path: Path | None) -> Path | None:
    """Refuse a folder that cannot be written, before anything is computed; made only when it is needed."""
    if path is None:
        return None
    there = next(one for one in (path.absolute(), *path.absolute().parents) if one.exists())
    if not there.is_dir():
        raise InputError("is not a directory; allowed for --out: a folder, made if needed", where=str(there))
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError("cannot be written to; allowed for --out: a folder of your own", where=str(there))
    return path


DEFAULT_DESIGN = "ilr33-amber"

DesignArgument = Annotated[
    str, typer.Argument(metavar="DESIGN", help="Name of a shipped design, or path of a design file.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="JSON to standard output, and nothing else there.")]
QuietOption = Annotated[bool, typer.Option("--quiet", help="No progress on standard error.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Change a value of the design, e.g. limits.voltage="24 V" (repeatable).',
    ),
]


_AT_OUTPUT = {
    ("output", "rotary"): ("rad", 'a value such as "2 deg"'),
    ("output", "linear"): ("m", 'a value such as "5 mm"'),
    ("speed", "rotary"): ("rad/s", 'a speed such as "300 rpm"'),
    ("speed", "linear"): ("m/s", 'a speed such as "0.2 m/s"'),
    ("load", "rotary"): ("N*m", 'a torque such as "4 N*m"'),
    ("load", "linear"): ("N", 'a force such as "40 N"'),
    ("slope", "rotary"): ("N*m/rad", 'a slope such as "5 N*m/rad"'),
    ("slope", "linear"): ("N/m", 'a slope such as "5 N/m"'),
}
_STEPS: dict[str, Kind] = {"position": "output", "velocity": "speed"}  # A and V are SI in any case


_AMPERES = {"A": "limits.peak_current", "A/s": "limits.current_rate"}  # which are read as a file's


def read_quantity(option: str, words: str | None, kind: Kind, drive: Design, unit: str = "") -> float | None:
    """A number of the command line with its unit; but for what is at the output also without it.

    In SI a position, speed or load at the output and a step of the command, in its usual unit the outermost
    loop's command; the drive's axis and outermost loop say the unit. A plain number is in ``unit``.
    ``option``: for the message. Amperes of an AC motor are read as in its file; a plain number is dc.
    """
    from actuator_lti.design.field import Structure
    from actuator_lti.design.fields import FIELDS
    from actuator_lti.design.stated import Frame
    from actuator_lti.design.units import parse_limit

    if words is None:
        return None
    bare: float | None = None
    if kind == "step":
        kind = _STEPS.get(drive.controller.outermost, "command")
    if kind in ("output", "speed", "load", "slope"):
        unit, allowed = _AT_OUTPUT[kind, drive.axis]
    else:
        if kind in ("command", "rate"):
            from nonlinear.runs.trajectory import COMMAND_UNITS

            unit, _ = COMMAND_UNITS[drive.axis, drive.controller.outermost]
            if kind == "rate":
                unit += "^2" if unit.endswith("/s") else "/s"
        allowed = f'"5 {unit}", or 5 in {unit}' if unit else 'a number such as 0.5 or "50 %"'
        if unit in _AMPERES and drive.motor.constants != "dc":
            rms, peak, dc = (unit.replace("A", f"A {which}") for which in ("rms", "peak", "dc"))
            allowed = f'"5 {rms}", "5 {peak}", or 5 in {dc}'
    with suppress(ValueError):
        bare = None if kind in ("output", "speed") else float(words)
    if bare is not None and not isfinite(bare):
        raise InputError(f"{option} {words}: must be a finite number")
    try:
        if bare is None and unit in _AMPERES:
            return Frame(Structure.of(drive), drive.motor.constants).quantity(words, FIELDS[_AMPERES[unit]])
        return parse_limit(words, unit or "1") if bare is None else bare
    except InputError as error:
        reason = error.message.partition("allowed:")[0].rstrip("; ") or "the motor's amperes are dc"
        raise InputError(f"{option} {words!r}: {reason}; allowed: {allowed}") from None


def load_drive(name_or_path: str, changes: Sequence[str] | None = None) -> Design:
    """A shipped design or a design file, with values changed as its file would write them.

    Changes are ``KEY=VALUE``, such as ``"control.position.gain=90 1/s"`` or ``"limits.voltage=24 V"``.
    """
    from actuator_lti.design import load_design, with_overrides

    design = load_design(name_or_path)
    return with_overrides(design, read_changes(changes)) if changes else design


def read_changes(changes: Sequence[str]) -> Tree:
    """Keys and values of ``KEY=VALUE`` texts; numbers, lists and tables as TOML has them, all else a text.

    >>> read_changes(["limits.voltage=24 V", "gear.worm.ratio=40", "friction.law=tanh"])
    {'limits.voltage': '24 V', 'gear.worm.ratio': 40, 'friction.law': 'tanh'}
    """
    result: Tree = {}
    for words in changes:
        key, equals, value = words.partition("=")
        if not equals or not key.strip():
            raise InputError(f"--set {words!r}: allowed: KEY=VALUE, such as limits.voltage='24 V'")
        result[key.strip()] = text = value.strip()
        with suppress(ValueError, RecursionError):
            result[key.strip()] = text if "\n" in text else tomllib.loads(f"v = {text}")["v"]
    return result


def refuse_existing(path: Path, force: bool) -> None:
    """Refuse to overwrite a file without ``--force``, and anything that is no file always."""
    if path.is_dir():
        raise InputError("is a directory; allowed: a file to write", where=str(path))
    if path.exists() and not force:
        raise InputError("exists already; allowed: another name, or --force", where=str(path))


_HELD = {".toml": "TOML", ".json": "JSON", ".xml": "XML", ".xdc": "XML"}  # by files of such a name


def write_new(path: Path | None, text: str, force: bool, held: str = "TOML") -> None:
    """Write a file that is not there yet, or with ``--force``; nothing without a path.

    Refused is a name that says otherwise than what it would have ``held``.
    """
    from actuator_lti.files.atomic import write_text

    if path is not None:
        if (named := _HELD.get(path.suffix.lower(), held)) != held:
            raise InputError(f"would hold {held}, no {named}; allowed: another name", where=str(path))
        refuse_existing(path, force)
        write_text(path, text)
