"""The compiled search of the axis, by the library of this package's kernels."""

from pathlib import Path

from actuator_lti.compiled.kinds import Kind
from actuator_lti.compiled.library import Entry, Library, source_files

_FOLDER = Path(__file__).parent
_ROW: Kind = "row"
_LOOP: tuple[Kind, ...] = ("int", _ROW)
_ASKED: tuple[Kind, ...] = ("int", "float", "float", "int", _ROW)
LIBRARY = Library(
    "axis",
    _FOLDER,
    (
        Entry(f"{__package__}._search", "search", (*_LOOP, *_ASKED, "int", *(_ROW,) * 6), "int"),
        Entry(f"{__package__}._nearest", "nearest", (*_LOOP, "int", *(_ROW,) * 5), "int"),
        Entry(f"{__package__}._factors", "evaluated", (*_LOOP, "float", _ROW, "int")),
    ),
    source_files(_FOLDER, wanted="_*.py"),
)
