"""Each bound of the one reader, from both sides: what it allows is read, one more is refused."""

from __future__ import annotations

import pytest

from actuator_lti.bounds import JSON_DEPTH, KEY_PARTS, TEXT_CHARACTERS, TOML_BYTES, TOML_DEPTH, TOML_VALUES
from actuator_lti.errors import InputError
from actuator_lti.files.reading import parse_json, parse_toml


def refused(read, text: str) -> str:
    with pytest.raises(InputError) as caught:
        read(text, "f")
    line = str(caught.value)
    assert line.isprintable()
    assert len(line) < 500
    return line


def tables(levels: int) -> str:
    """A value within so many tables."""
    return "a = " + "{ a = " * (levels - 1) + "1" + " }" * (levels - 1)


def lists(levels: int) -> str:
    return "[" * levels + "]" * levels


def test_depth() -> None:
    assert parse_toml(tables(TOML_DEPTH.most), "f")
    assert "nested too deeply" in refused(parse_toml, tables(TOML_DEPTH.most + 1))
    assert parse_json(lists(JSON_DEPTH.most + 1), "f")  # the innermost holds nothing
    assert "nested too deeply" in refused(parse_json, lists(JSON_DEPTH.most + 2))
    for read, text in ((parse_toml, "a = " + "[" * 10_000), (parse_json, "[" * 10_000)):
        assert "nested too deeply" in refused(read, text)


def test_values() -> None:
    def text(count: int) -> str:  # with the file and the list there are two more
        return f"a = [{'1,' * (count - 2)}]"

    assert parse_toml(text(TOML_VALUES.most), "f")
    assert f"at most {TOML_VALUES.most}" in refused(parse_toml, text(TOML_VALUES.most + 1))
    assert "more values" in refused(parse_toml, "\n".join(f"k{k} = 1" for k in range(TOML_VALUES.most + 1)))


def test_texts_keys_and_size() -> None:
    most = TEXT_CHARACTERS.most
    assert parse_toml(f'a = "{"x" * most}"', "f")
    assert f"{most + 1} characters" in refused(parse_toml, f'a = "{"x" * (most + 1)}"')
    assert "characters" in refused(parse_toml, f'"{"x" * (most + 1)}" = 1')
    assert "nested too deeply" in refused(parse_toml, "a" + ".a" * KEY_PARTS.most + " = 1")
    room = TOML_BYTES.most - len("a = 1\n#")
    assert parse_toml("a = 1\n#" + "x" * room, "f") == {"a": 1}
    assert "larger" in refused(parse_toml, "a = 1\n#" + "x" * (room + 1))


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1, 10**4000])
def test_integers(number: int) -> None:
    for read, text in ((parse_toml, "a = {}"), (parse_json, '{{"a": {}}}')):
        edge = 2**63 - 1 if number > 0 else -(2**63)
        assert read(text.format(edge), "f") == {"a": edge}
        assert "whole numbers of 64 bits" in refused(read, text.format(f"{number:d}"))


@pytest.mark.parametrize("code", [0x00, 0x07, 0x1B, 0x7F, 0x85, 0x9B])
def test_control_characters(code: int) -> None:
    words = f"U+{code:04X}"
    assert words in refused(parse_toml, f'a = "x\\u{code:04x}"')
    assert words in refused(parse_toml, f'"x\\u{code:04x}" = 1')
    assert words in refused(parse_json, f'{{"a": "x\\u{code:04x}"}}')
    assert parse_toml('a = "x\\n\\t"', "f") == {"a": "x\n\t"}


@pytest.mark.parametrize(
    ("read", "text"),
    [(parse_toml, "a = 1\na = 2"), (parse_toml, "[a]\n[a]"), (parse_json, '{"a": 1, "a": 2}')],
)
def test_a_key_twice(read, text: str) -> None:
    refused(read, text)
