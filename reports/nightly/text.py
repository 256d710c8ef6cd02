"""Times as texts; other people's names made safe: as file names, in XML, in CSV and in one line of text."""

import csv
import hashlib
import io
import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime

from reports.visible import visible

_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "|")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")


def sha256(data: bytes | str) -> str:
    """Hex digest of bytes or of the UTF-8 of a text (lone surrogates kept apart, not refused)."""
    raw = data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data
    return hashlib.sha256(raw).hexdigest()


def one_line(text: str, limit: int = 300) -> str:
    """Text as one visible line of at most ``limit`` characters.

    >>> one_line("a\\n b", 10), one_line("abcdef", 4)
    ('a b', 'abc…')
    """
    line = " ".join(visible(text).split())
    return line if len(line) <= limit else line[: limit - 1] + "…"


def markdown_cell(text: str, limit: int = 80) -> str:
    """Text that stays text in a Markdown table: markup characters escaped, one line.

    >>> markdown_cell("a|b <i>")
    'a\\\\|b &lt;i&gt;'
    """
    line = one_line(text, limit)
    line = line.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_{}\[\]()#+!|~@])", r"\\\1", line)


def csv_cell(value: object) -> str:
    """One CSV value that no spreadsheet takes for a formula: a quote in front of what could start one.

    >>> csv_cell("=1+1"), csv_cell("-3.5"), csv_cell(None), csv_cell(2.0)
    ("'=1+1", '-3.5', '', '2.0')
    """
    text = "" if value is None else visible(str(value))
    harmful = text.lstrip(" ").startswith(_FORMULA_STARTS) and not _NUMBER.match(text)
    return f"'{text}" if harmful else text


def csv_text(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A CSV table (RFC 4180) whose cells are safe to open in a spreadsheet."""
    buffer = io.StringIO()
    csv.writer(buffer).writerows([csv_cell(value) for value in row] for row in (header, *rows))
    return buffer.getvalue()


def now() -> str:
    """Time of the clock, as ``2026-01-31T23:59:59Z``."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def to_seconds(text: str) -> float:
    """Seconds since 1970 of such a text."""
    return datetime.fromisoformat(text).timestamp()
