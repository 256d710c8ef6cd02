"""The designs that come with the package."""

from __future__ import annotations

from pathlib import Path

_FOLDER = Path(__file__).parent / "shipped"


def shipped_designs() -> tuple[str, ...]:
    """Names of the shipped designs, the baseline first.

    Examples
    --------
    >>> shipped_designs()[0]
    'ilr33-amber'
    """
    names = sorted(path.stem for path in _FOLDER.glob("*.toml"))
    return tuple(sorted(names, key=lambda name: name != "ilr33-amber"))


def shipped_path(name: str) -> Path:
    """Where a shipped design lies."""
    return _FOLDER / f"{name}.toml"
