"""Read a design by name or path, or from a text."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from actuator_lti.design.checks import contradictions
from actuator_lti.design.mistakes import Findings, lines_of, nearest
from actuator_lti.design.model import Design
from actuator_lti.design.reader import read_tree
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, decode, parse_toml, read_bytes, shown

AnyDesign = Design | str | PathLike[str]  # or its name, or the path of its file
SHIPPED = Path(__file__).parent / "shipped"


def shipped_designs() -> tuple[str, ...]:
    """Names of the shipped designs, the baseline first.

    >>> shipped_designs()[0]
    'ilr33-amber'
    """
    names = sorted(path.stem for path in SHIPPED.glob("*.toml"))
    return tuple(sorted(names, key=lambda name: name != "ilr33-amber"))


def load_design(name_or_path: AnyDesign) -> Design:
    """Read a shipped design by name, or a design file by path; a design is given back as it is.

    ``name_or_path``: a shipped name (see :func:`shipped_designs`), else the path of a TOML file of at most
    1 MiB.

    Raises `InputError`: one line: file, key, value and what is allowed.

    Examples
    --------
    >>> load_design("ilr33-amber").total_ratio
    2376.0
    """
    if isinstance(name_or_path, Design):
        return name_or_path
    name = _name_of(name_or_path)
    if name in shipped_designs():
        return _shipped(name)
    return read_design_text(design_text(name), shown(name, 200)[1:-1], Path(name).parent)


as_design = load_design  # for what a function is given as a design


def _name_of(given: object) -> str:
    name = fspath(given) if isinstance(given, str | PathLike) else None
    if not isinstance(name, str):
        allowed = "allowed: a Design, a shipped name, or the path of a design file"
        raise InputError(f"design = {shown(given)}: {allowed}")
    return name


def design_text(name_or_path: str | PathLike[str]) -> str:
    """The text of a design file, by shipped name or path, with its comments; no file is an InputError."""
    name = _name_of(name_or_path)
    if name in shipped_designs():
        return (SHIPPED / f"{name}.toml").read_text(encoding="utf-8")
    path = Path(name)
    named = not path.suffix and "/" not in name and "\\" not in name
    if named and not (name and os.path.exists(name)):
        hint = nearest(name, shipped_designs())
        names = ", ".join(shipped_designs())
        raise InputError(f"{shown(name)}: no such design{hint}; allowed: {names}, or a design file")
    return decode(read_bytes(path), shown(name, 200)[1:-1])


@lru_cache(maxsize=16)
def _shipped(name: str) -> Design:
    return read_design_text(design_text(name), name)


def read_design_text(text: str, origin: str = "design", folder: Path | str = "") -> Design:
    """Read a design from TOML text; ``origin`` is named in errors and kept in the design.

    Files that it names, as a law's, are sought in ``folder``.

    Raises `InputError`: as :func:`load_design`.
    """
    if tree := parse_toml(text, origin):
        return design_from_tree(tree, origin, Findings(origin, lines_of(text, tree), Path(folder)))
    raise InputError("is empty; allowed: a design file (actuator-lti init writes one)", where=origin)


def design_from_tree(tree: Tree, origin: str, findings: Findings | None = None) -> Design:
    """Build and check a design from a parsed TOML tree; refused with all that is found wrong in it."""
    findings = findings or Findings(origin)
    design = read_tree(tree, origin, findings)
    findings.refuse(contradictions(design))
    return design


@dataclass(frozen=True)
class SweepPoint:
    """A value of the key as it was given, and the design that has it."""

    value: Any
    design: Design


def sweep(design: AnyDesign, path: str, values: Iterable[Any]) -> tuple[SweepPoint, ...]:
    """Designs that differ in one key.

    ``design``: a design, a shipped name, or the path of a design file.
    ``path``: dotted key, such as ``"limits.voltage"``.
    ``values``: texts with their unit (``"14 V"``), or numbers in SI; their order is that of the designs.

    Raises `InputError`: for an unknown key, a wrong unit, or a value that is not allowed.

    Examples
    --------
    >>> result = sweep("ilr33-amber", "limits.voltage", ["12 V", 14.0])
    >>> [(at.value, at.design.limits.voltage_V) for at in result]
    [('12 V', 12.0), (14.0, 14.0)]
    """
    base = load_design(design)
    return tuple(SweepPoint(value, base.with_values({path: value})) for value in values)
