"""Texts of other people as signs that are seen: a page, a printer or a terminal obeys nothing in them."""

import html
import re

# tab and line break may stand
_UNSEEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff]")
DIRECTION = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
"""Marks that turn the direction of reading (Unicode's Bidi_Control), as a range of a regular expression."""

_DIRECTION = re.compile(f"[{DIRECTION}]")
LINE_END = re.compile(r"=|\.(?=[a-z])")
"""What a line may end behind in a long name: its dots and equals signs, but not within a number."""


def visible(text: str) -> str:
    """Replace control characters, what XML cannot hold, and marks of direction by signs that are seen.

    Marks of direction let a name read otherwise than it is (``U+202E`` turns ``gpj.exe`` round).

    >>> visible("a\\x00b\\u202ec")
    'a\\ufffdb\\u27e8U+202E\\u27e9c'
    """
    if text.isascii() and text.isprintable():
        return text
    clean = _UNSEEN.sub("\N{REPLACEMENT CHARACTER}", text)
    return _DIRECTION.sub(lambda m: f"⟨U+{ord(m.group()):04X}⟩", clean)


def escape(text: str) -> str:
    """Text for markup: visible, and none of it is a tag, an entity or the end of an attribute.

    >>> escape("a<b\\u202e")
    'a&lt;b⟨U+202E⟩'
    """
    return html.escape(visible(text))
