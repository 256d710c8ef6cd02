"""Names from files as parts of file names."""

import hashlib
import re


def slug(name: str) -> str:
    """A file name part for any text: lower-case letters, digits and hyphens, never empty, never a path.

    Texts that lose characters on the way get a digest, so that different names stay different.

    >>> slug("Gear 66:1")
    'gear-66-1-d47910'
    >>> slug("slow"), ".." in slug("../../etc/passwd")
    ('slow', False)
    """
    made = hashed(name, 60, 6)
    return name if made[:-7] == name else made


def hashed(name: str, longest: int = 40, digits: int = 10) -> str:
    """As `slug`, always with so many digits of its hash: names of different texts are never alike.

    >>> hashed("../../etc/passwd"), hashed("é")[:-10]
    ('etc-passwd-3754d6cb3a', 'design-')
    """
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:longest].strip("-") or "design"
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()
    return f"{plain}-{digest[:digits]}"
