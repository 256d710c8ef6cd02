"""What is asked of an export."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from analyses.request import FORCE, Option

CHECK = Option(
    words="Measure the margins of the compiled code (sweep by injection, limits in time) and say so in the "
    "export; needs a C compiler.",
    flag="check/--no-check",
)


@dataclass(frozen=True, kw_only=True)
class AskedC:
    """Write the drive as C99: drive.h, drive.c, the design's parameters, an example and a README.

    Try: actuator-lti export c fin --out fin-c --prefix fin_
    """

    target: Annotated[Path, Option("Folder for the files; drive-c.", "DIR", flag="out")] = Path("drive-c")
    single: Annotated[bool, Option("float in place of double.")] = False
    prefix: Annotated[str, Option("In front of the design's own files and symbols; drive_.", "NAME_")] = (
        "drive_"
    )
    check: Annotated[bool, CHECK] = True
    force: Annotated[bool, FORCE] = False


@dataclass(frozen=True, kw_only=True)
class AskedController:
    """Write the controller alone as C99 for firmware, with test vectors and a class for C++.

    Try: actuator-lti export controller joint --type float --prefix joint_ --out joint-controller
    """

    target: Annotated[Path, Option("Folder for the files; controller-c.", "DIR", flag="out")] = Path(
        "controller-c"
    )
    number: Annotated[Literal["float", "double"], Option("Type of a number; float.", flag="type")] = "float"
    prefix: Annotated[str, Option("In front of every symbol; drive_.", "NAME_")] = "drive_"
    force: Annotated[bool, FORCE] = False


@dataclass(frozen=True, kw_only=True)
class AskedFmu:
    """Write the drive as a co-simulation FMU: binaries, sources, every key of the design as a parameter.

    Try: actuator-lti export fmu joint --platform linux64
    """

    target: Annotated[Path | None, Option("File to write; NAME.fmu.", "FILE", flag="out")] = None
    version: Annotated[int, Option("Version of FMI; 2.", "2|3", flag="fmi")] = 2
    platform: Annotated[list[str] | None, Option("linux64 or win64, may be repeated; both.", "NAME")] = None
    plain: Annotated[bool, Option("Without reports inside, and no check.")] = False
    check: Annotated[bool, CHECK] = True
    force: Annotated[bool, FORCE] = False


@dataclass(frozen=True, kw_only=True)
class AskedLinear:
    """Write every loop, break point, command and load response as state space, with units and margins.

    Try: actuator-lti export linear joint --to mat
    """

    to: Annotated[Literal["json", "mat", "python"], Option("Format; json.")] = "json"
    target: Annotated[
        Path | None, Option("File to write; NAME-linear.json, .mat or .py.", "FILE", flag="out")
    ] = None
    force: Annotated[bool, FORCE] = False
