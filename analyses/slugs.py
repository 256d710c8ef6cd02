"""Names from files as parts of file names."""

from __future__ import annotations

import hashlib
import re

_LONGEST = 60


def slug(name: str) -> str:
    """A file name part for any text: lower-case letters, digits and hyphens, never empty, never a path.

    Texts that lose characters on the way get a digest, so that different names stay different.

    Examples
    --------
    >>> slug("Gear 66:1")
    'gear-66-1-d47910'
    >>> slug("slow"), ".." in slug("../../etc/passwd")
    ('slow', False)
    """
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:_LONGEST].strip("-")
    if plain == name and plain:
        return plain
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{plain}-{digest}" if plain else digest
