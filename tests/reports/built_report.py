"""What the tests of the report share."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple


class Built(NamedTuple):
    """A report on disk and the document it was made of."""

    document: dict[str, Any]
    page: Path
    data: Path


HOSTILE = "<script>alert(1)</script> \"quoted\" 'single' & $x^2$ ]]> \u202e {{ 7*7 }}"
