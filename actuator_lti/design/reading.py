"""From a file to a checked tree of plain values: sizes, encoding, syntax, characters; nothing physical."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError

MAX_BYTES = 1 << 20
MAX_STRING = 10_000
MAX_DEPTH = 8
MAX_VALUES = 20_000
MAX_KEY_DOTS = 64


def shown(value: object, longest: int = 60) -> str:
    """A value as it may be printed: short, one line, no control characters."""
    if isinstance(value, dict | list):
        return "a table" if isinstance(value, dict) else "a list"
    text = value if isinstance(value, str) else repr(value)
    text = "".join(c if unicodedata.category(c)[0] != "C" else "?" for c in text[: longest + 1])
    text = text if len(text) <= longest else text[: longest - 3] + "..."
    return f'"{text}"' if isinstance(value, str) else text


def read_bytes(path: Path, what: str = "design file") -> bytes:
    """The bytes of a regular file of at most 1 MiB."""
    where = shown(str(path), 200)[1:-1]
    try:
        if path.is_dir():
            raise InputError(f"is a directory; allowed: a {what}", where=where)
        if path.exists() and not path.is_file():
            raise InputError(f"is no regular file; allowed: a {what}", where=where)
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise InputError(f"no such file; allowed: a {what}", where=where) from None
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"cannot be read: {reason}", where=where) from None
    if len(data) > MAX_BYTES:
        raise InputError("is larger than allowed: at most 1 MiB", where=where)
    return data


def decode(data: bytes, where: str) -> str:
    """UTF-8 text, with or without a byte-order mark."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"byte {error.start} is not UTF-8; allowed: UTF-8 text", where=where) from None


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """The tree of a TOML text, refused with line and column where the syntax is wrong."""
    if len(text) > MAX_BYTES:
        raise InputError("is larger than allowed: at most 1 MiB", where=where)
    _refuse_long_keys(text, where)
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            f"not TOML: {shown(str(error), 200)[1:-1]}{_hint(text, error)}", where=where
        ) from None
    except RecursionError:
        raise InputError(f"nested too deeply; allowed: {MAX_DEPTH} levels", where=where) from None
    except (ValueError, OverflowError) as error:
        raise InputError(f"not TOML: {shown(str(error), 200)[1:-1]}", where=where) from None
    _walk(tree, where)
    return tree


_UNQUOTED = re.compile(
    r"\s*([A-Za-z_][\w.]*)\s*=\s*([+-]?[0-9][0-9.,eE+-]*\s*[A-Za-zµΩ%/°][^#\"\n]*?)\s*(#.*)?$"
)
_COMMA = re.compile(r"\s*([A-Za-z_][\w.]*)\s*=\s*([+-]?[0-9]+,[0-9]+)\s*(#.*)?$")


def _hint(text: str, error: tomllib.TOMLDecodeError) -> str:
    """What the line at fault most likely wants: quotes around a quantity, a decimal point."""
    place = re.search(r"line ([0-9]+)", str(error))
    lines = text.splitlines()
    if place is None or not 0 < int(place[1]) <= len(lines):
        return ""
    line = lines[int(place[1]) - 1]
    if found := _COMMA.match(line):
        return f"; use a decimal point: {found[1]} = {found[2].replace(',', '.')}"
    if found := _UNQUOTED.match(line):
        return f'; put a quantity in quotes: {found[1]} = "{shown(found[2].replace(",", "."))[1:-1]}"'
    return ""


def _refuse_long_keys(text: str, where: str) -> None:
    for number, line in enumerate(text.splitlines(), 1):
        head = line.partition("=")[0]
        if head.count(".") > MAX_KEY_DOTS and not head.lstrip().startswith("#"):
            raise InputError(
                f"line {number}: a key nested too deeply; allowed: {MAX_DEPTH} levels", where=where
            )


def _walk(tree: dict[str, Any], where: str) -> None:
    """Refuse deep nesting, too many values, long strings and control characters."""
    stack: list[tuple[str, Any, int]] = [("", tree, 0)]
    count = 0
    while stack:
        path, value, depth = stack.pop()
        count += 1
        if depth > MAX_DEPTH:
            raise InputError(f"{path}: nested too deeply; allowed: {MAX_DEPTH} levels", where=where)
        if count > MAX_VALUES:
            raise InputError(f"more values than allowed: at most {MAX_VALUES}", where=where)
        if isinstance(value, dict):
            for key, item in value.items():
                _check_string(key, f"a key of {path or 'the file'}", where, ("Cc", "Cf", "Cs"))
                stack.append((f"{path}.{key}" if path else key, item, depth + 1))
        elif isinstance(value, list):
            stack.extend((f"{path}[{i + 1}]", item, depth + 1) for i, item in enumerate(value))
        elif isinstance(value, str):
            _check_string(value, path, where, ("Cc", "Cs"))


def _check_string(text: str, path: str, where: str, refused: tuple[str, ...]) -> None:
    """Refuse a long text, and characters of some Unicode categories; line break and tab may stand."""
    path = shown(path)[1:-1]
    if len(text) > MAX_STRING:
        raise InputError(f"{path}: {len(text)} characters; allowed: at most {MAX_STRING}", where=where)
    for character in text:
        if unicodedata.category(character) in refused and character not in "\n\t":
            raise InputError(
                f"{path} = {shown(text)}: holds the control character U+{ord(character):04X}; "
                "allowed: printable text",
                where=where,
            )
