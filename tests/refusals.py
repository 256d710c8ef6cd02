"""What is refused: in one line that can be printed."""

import re
from collections.abc import Callable

import pytest

from actuator_lti.design import read_design_text
from actuator_lti.errors import InputError


def refused(
    call: Callable[..., object],
    *arguments: object,
    words: str | tuple[str, ...] = (),
    match: str = "",
    **named,
) -> str:
    """What is said of it, these words among it, and what this pattern matches."""
    with pytest.raises(InputError) as caught:
        call(*arguments, **named)
    line = str(caught.value)
    assert line.isprintable()
    assert len(line) < 400
    assert re.search(match, line), line
    for word in (words,) if isinstance(words, str) else words:
        assert word in line
    return line


def mistakes(text: str, origin: str = "my.toml") -> str:
    """What a design file is answered with, a printable line a mistake."""
    with pytest.raises(InputError) as caught:
        read_design_text(text, origin)
    lines = str(caught.value).split("\n")
    assert all(line.startswith(f"{origin}: ") and line.isprintable() for line in lines)
    return "\n".join(lines)
