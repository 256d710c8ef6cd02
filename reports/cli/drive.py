"""The design that a command works on: by name or path, with the changes of `--set`."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from actuator_lti.files.tree import Tree

if TYPE_CHECKING:
    from actuator_lti.design import Design

SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Change a value of the design, e.g. control.position.gain="90 1/s" (repeatable).',
    ),
]


def load_drive(name_or_path: str, changes: Sequence[str] | None = None) -> Design:
    """A shipped design or a design file, with values changed as its file would write them.

    Parameters
    ----------
    name_or_path : str
    changes : sequence of str, optional
        ``KEY=VALUE``, such as ``"control.position.gain=90 1/s"`` or ``"limits.voltage=24 V"``.

    Raises
    ------
    InputError
        Where the design is refused, with or without the changes.
    """
    from actuator_lti.design import load_design, with_overrides

    design = load_design(name_or_path)
    return with_overrides(design, read_changes(changes)) if changes else design


def read_changes(changes: Sequence[str]) -> Tree:
    """Keys and values of ``KEY=VALUE`` texts; numbers, lists and tables as TOML has them, all else a text.

    Examples
    --------
    >>> read_changes(["limits.voltage=24 V", "gear.worm.ratio=40", "friction.law=tanh"])
    {'limits.voltage': '24 V', 'gear.worm.ratio': 40, 'friction.law': 'tanh'}
    """
    from actuator_lti.errors import InputError

    result: Tree = {}
    for words in changes:
        key, equals, value = words.partition("=")
        if not equals or not key.strip():
            raise InputError(f"--set {words!r}: allowed: KEY=VALUE, such as limits.voltage='24 V'")
        result[key.strip()] = _value(value.strip())
    return result


def _value(words: str) -> Any:
    if "\n" in words:
        return words
    try:
        return tomllib.loads(f"v = {words}")["v"]
    except (tomllib.TOMLDecodeError, ValueError, RecursionError):
        return words
