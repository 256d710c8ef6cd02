"""What is asked about design files: their keys, and one to start from."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from actuator_lti.errors import InputError
from analyses.request import FORCE, Option

# Kind of drive, and the shipped design that it starts from; None is the starter with all keys explained.
KINDS: dict[str, str | None] = {"servo-axis": None, "joint": "joint", "ballscrew": "ballscrew", "fin": "fin"}


@dataclass(frozen=True, kw_only=True)
class AskedKeys:
    """List the keys of a design file: unit, default, allowed range, meaning, example.

    A repeated table stands as gear.* (by name), friction.point.* and control.velocity.filter.* (by number).
    Try: actuator-lti keys notch, or actuator-lti keys --explain my.toml
    """

    match: Annotated[
        str, Option("Only keys whose name or meaning holds this text.", "TEXT", argument=True)
    ] = ""
    explain: Annotated[
        str | None,
        Option(
            words="The numbers of a design: written, read as, in the model as; what follows, and warnings.",
            metavar="FILE",
        ),
    ] = None
    linear: Annotated[bool, Option("Units of a linear axis (m, N, kg).")] = False


@dataclass(frozen=True, kw_only=True)
class AskedStart:
    """Write a commented design file to start one's own drive from.

    Try: actuator-lti init arm.toml --kind joint, or with values of data sheets: actuator-lti init arm.toml
    --motor maxon-ec-i-40-100w-48v --gear harmonic-drive-csf-17-30
    """

    file: Annotated[Path, Option("Design file to write.", "FILE", argument=True)] = Path("my-drive.toml")
    source: Annotated[
        str | None, Option("Start from this design (shipped name or file) instead.", "NAME", flag="from")
    ] = None
    kind: Annotated[str | None, Option(f"Start from a typical drive: {', '.join(KINDS)}.", "KIND")] = None
    motor: Annotated[str | None, Option("Motor of the catalogue; a wrong name lists them all.", "NAME")] = (
        None
    )
    gear: Annotated[str | None, Option("Gear of the catalogue; a wrong name lists them all.", "NAME")] = None
    force: Annotated[bool, FORCE] = False

    def __post_init__(self) -> None:
        part = "motor" if self.motor is not None else "gear" if self.gear is not None else ""
        if part and (self.kind or self.source):
            raise InputError(f"--{part}: not allowed beside --kind and --from")
        if self.kind is not None and self.source is not None:
            raise InputError(f'--kind = "{self.kind}": not allowed beside --from')
        if self.kind is not None and self.kind not in KINDS:
            raise InputError(f'--kind = "{self.kind}": allowed: {", ".join(KINDS)}')
