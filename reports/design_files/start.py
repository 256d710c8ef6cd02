"""A design file to start from."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from actuator_lti.errors import InputError
from analyses.request import FORCE, Option

# Kind of drive, and the shipped design that it starts from; None is the starter with all keys explained.
KINDS: dict[str, str | None] = {"servo-axis": None, "joint": "joint", "ballscrew": "ballscrew", "fin": "fin"}


@dataclass(frozen=True, kw_only=True)
class Asked:
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
        """Refuse a kind that there is not, and two sources."""
        if (self.motor is not None or self.gear is not None) and (self.kind or self.source):
            raise InputError(
                f"--{'gear' if self.motor is None else 'motor'}: not allowed beside --kind and --from"
            )
        if self.kind is not None and self.source is not None:
            raise InputError(f'--kind = "{self.kind}": not allowed beside --from')
        if self.kind is not None and self.kind not in KINDS:
            raise InputError(f'--kind = "{self.kind}": allowed: {", ".join(KINDS)}')


@dataclass(frozen=True)
class Started:
    """The file that was written."""

    file: str

    def __str__(self) -> str:
        return f"wrote {self.file}; next: actuator-lti report {self.file}"


def start(asked: Asked) -> Started:
    """Write a commented design file, named as the file is.

    An InputError if there is such a file already, or the source is no design.
    """
    from actuator_lti.design import read_design_text
    from actuator_lti.design.loader import design_text
    from actuator_lti.files.atomic import write_text
    from reports.cli.options import refuse_existing
    from reports.design_files.parts import with_parts

    refuse_existing(asked.file, asked.force)
    source = KINDS[asked.kind] if asked.kind else asked.source
    starter = Path(__file__).parents[1] / "templates" / "design.toml"
    text = starter.read_text(encoding="utf-8") if source is None else design_text(source)
    if asked.motor is not None or asked.gear is not None:
        text = with_parts(text, asked.motor, asked.gear)
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}", name := asked.file.stem):  # can be a design's, too
        head = r'(?m)^(\[design\]\n(?:[^\[\n]*\n)*?name = )"[^"\n]*"'
        text = re.sub(head, rf'\1"{name}"', text, count=1)
    read_design_text(text, str(asked.file))
    write_text(asked.file, text)
    return Started(str(asked.file))
