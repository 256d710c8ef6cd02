"""From a document to a PDF: the template is fixed, everything else reaches it as data."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.start.extras import need
from reports.pdf.printable import printable, summary

TEMPLATE = Path(__file__).resolve().parents[1] / "templates" / "pdf" / "report.typ"
MAX_BYTES = 64_000_000


def write_pdf(made: Mapping[str, Any], path: str | Path, *, whole: bool = True) -> Path:
    """Write a report as PDF: cover with verdicts and lines to sign, tables, vector figures, page numbers.

    Parameters
    ----------
    made : mapping
        A document of `reports.document`.
    path : str or Path
        Where to write; written whole or not at all.
    whole : bool
        Everything, or the first screen and one line a section.

    Raises
    ------
    InputError
        If the file cannot be written or the document is too large.
    NumericalError
        If typst refuses it (no text of a document should be able to make it).
    """
    write_bytes(path, pdf_bytes(made if whole else summary(made)))
    return Path(path)


def pdf_bytes(made: Mapping[str, Any]) -> bytes:
    """Give a report as PDF; see `write_pdf`.

    The fonts are those that come with typst and matplotlib, embedded; what they lack is taken from the
    system's.  The same document gives the same file wherever those are the same.
    """
    need("typst", "pdf", "a PDF")
    import typst

    data = json.dumps(printable(made), ensure_ascii=False, allow_nan=False)
    if len(data) > MAX_BYTES:
        raise InputError(f"report of {len(data)} bytes: at most {MAX_BYTES} can be typeset")
    try:
        return bytes(
            typst.compile(
                str(TEMPLATE),
                root=str(TEMPLATE.parent),
                font_paths=[font_folder()],
                sys_inputs={"document": data},
                timestamp=_time(made),
                format="pdf",
            )
        )
    except typst.TypstError as error:
        raise NumericalError(f"typst refuses the report: {str(error).splitlines()[0]}") from error


@cache
def font_folder() -> str:
    """Folder of the fonts that matplotlib brings along: those of the figures."""
    import matplotlib

    return str(Path(matplotlib.get_data_path()) / "fonts" / "ttf")


def _time(made: Mapping[str, Any]) -> int:
    """Give the document's own time, so that it is typeset the same tomorrow."""
    text = (made.get("provenance") or {}).get("time")
    try:
        return int(datetime.fromisoformat(str(text)).astimezone(UTC).timestamp())
    except (ValueError, OverflowError):
        return 0
