"""What the ways of identifying share: options, fixed values, what is written and how the command ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.identification.verdict import Item
    from reports.document_schema import Section


@dataclass(frozen=True, kw_only=True)
class Common:
    """The options that campaigns and records share; ``fixed`` as written, ``KEY=VALUE``."""

    design: str | None
    fixed: tuple[str, ...]
    accept: bool
    residual_limit: float
    out: Path | None
    as_json: bool
    quiet: bool
    changes: tuple[str, ...] = ()


def fixed_values(design: Design, texts: Sequence[str]) -> dict[str, float]:
    """``KEY=VALUE`` texts as SI values by key; a bare number is in SI.

    Raises
    ------
    InputError
        For a text without ``=``, an unknown key, or a value that does not fit.
    """
    from actuator_lti.design.access import located
    from actuator_lti.design.fields import Structure
    from actuator_lti.design.units import parse_quantity
    from actuator_lti.errors import InputError

    result = {}
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not value:
            raise InputError(f'--fix "{text}": KEY=VALUE is wanted, such as friction.load_coefficient=0')
        field, _ = located(design, key)
        try:
            result[key] = float(value)
        except ValueError:
            try:
                result[key] = parse_quantity(value, field.unit(Structure.of(design)))
            except InputError as error:
                raise InputError(f"--fix {key} = {value}: {error.message}") from None
    return result


def finish(
    common: Common, base: Design, made: Design, text: str, section: Section, items: Sequence[Item]
) -> Path | None:
    """Write the pages, and the design where all checks pass or it was accepted; the design's path.

    Parameters
    ----------
    base, made : Design
        The design that was started from, and the identified one with its ``text``.
    """
    if common.out is None:
        return None
    from actuator_lti.atomic import write_text
    from analyses.identification.verdict import passed
    from reports.cli.progress import progress
    from reports.study_pages import study_document, write_pages

    document = study_document(
        made,
        [section],
        title=f"Identification of {base.title or base.name}",
        subtitle=section["intro"],
        kind="identification",
    )
    with progress("drawing figures", quiet=common.quiet) as bar:
        write_pages(document, common.out, "identification", progress=bar)
    if not (passed(items) or common.accept):
        return None
    path = common.out / f"{base.name}-identified.toml"
    write_text(path, text)
    return path


def say(section: Section, written: Path | None, items: Sequence[Item]) -> None:
    """Print the verdict, the section, and what was written or why nothing was."""
    from analyses.identification.verdict import passed
    from reports.cli.output import print_line
    from reports.terminal import print_section

    print_section(section, passed(items))
    if written is not None:
        print_line(f"design written: {written}" + ("" if passed(items) else " (accepted, a check failed)"))
    elif not passed(items):
        print_line("no design is written, as a check fails; --accept writes it all the same")
