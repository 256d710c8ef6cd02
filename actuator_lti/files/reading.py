"""The one reader of files: from a path to bytes, text and a tree of plain values; nothing physical.

Size, encoding, depth, number of values, texts, integers and control characters are checked here for every
file that somebody wrote: what comes out may be printed and written to other files as it is.
"""

import json
import os
import re
import stat
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Callable
from difflib import get_close_matches
from io import BufferedReader
from os import PathLike
from pathlib import Path
from typing import Any

from actuator_lti import bounds
from actuator_lti.bounds import TOML_BYTES, TOML_DEPTH, TOML_VALUES, Bound
from actuator_lti.errors import InputError, in_file

AnyPath = str | PathLike[str]
Tree = dict[str, Any]
"""A table of TOML or an object of JSON as a file has it: a schema checks its keys, or has done so."""
INTEGERS = range(-(1 << 63), 1 << 63)
"""What TOML promises to hold; longer ones would become infinite as floats, or take long to print."""

UTF_16 = (b"\xff\xfe", b"\xfe\xff")  # what its texts begin with

_PIECE = 1 << 20
_HARMLESS = (float, bool, type(None))  # need no look where values are not counted
_CONTROL = ("Cc", "Cs")
_CONTROL_OF_KEYS = ("Cc", "Cf", "Cs")


def shown(value: object, longest: int = 60) -> str:
    """A value as it may be printed: short, one line, no control characters."""
    if isinstance(value, dict | list):
        return f"a{'' if value else 'n empty'} {'table' if isinstance(value, dict) else 'list'}"
    if isinstance(value, int) and value not in INTEGERS:  # Python does not agree to print every digit
        return f"an integer of {value.bit_length()} bits"
    text = value if isinstance(value, str) else repr(value)
    text = "".join(c if unicodedata.category(c)[0] != "C" else "?" for c in text[: longest + 1])
    text = text if len(text) <= longest else text[: longest - 3] + "..."
    return f'"{text}"' if isinstance(value, str) else text


def shown_path(path: AnyPath) -> str:
    """A path as it may be printed; what is no path is refused."""
    if not isinstance(path, str | bytes | PathLike):
        raise InputError(f"{path!r}: allowed: the path of a file")
    return shown(os.fspath(path), 200)[1:-1]


def as_path(path: AnyPath) -> Path:
    shown_path(path)
    return Path(os.fspath(path))


def open_regular(path: AnyPath, what: str = "file") -> BufferedReader:
    """Open a regular file for reading; a directory, device or pipe is an InputError without a wait."""
    with in_file(shown_path(path)):
        try:
            handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        except FileNotFoundError:
            raise InputError(f"cannot be read: no such file{_near(path)}; allowed: a {what}") from None
        except (OSError, ValueError) as error:
            raise InputError(f"cannot be read: {reason(error)}") from None
        mode = os.fstat(handle).st_mode
        if stat.S_ISREG(mode):
            return os.fdopen(handle, "rb")
        os.close(handle)
        kind = "is a directory" if stat.S_ISDIR(mode) else "is no regular file"
        raise InputError(f"{kind}; allowed: a {what}")


def _near(path: AnyPath) -> str:
    folder, name = os.path.split(os.fsdecode(path))
    try:
        near = get_close_matches(name, os.listdir(folder or "."), 1, 0.8)
    except OSError:
        return ""
    return f" (there is {shown(near[0])})" if near else ""


def reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def read_bytes(path: AnyPath, what: str = "design file", most: Bound = TOML_BYTES) -> bytes:
    """The bytes of a regular file of bounded size; an InputError names the file and what is allowed."""
    data = bytearray()
    with in_file(shown_path(path)), open_regular(path, what) as stream:
        try:
            while len(data) <= most.most and (piece := stream.read(_PIECE)):
                data += piece
        except OSError as error:
            raise InputError(f"cannot be read: {reason(error)}") from None
        if len(data) > most.most:
            raise InputError(f"is larger than allowed: {most.allowed}")
    return bytes(data)


def decode(data: bytes, where: str) -> str:
    """UTF-8 text, with or without a byte-order mark."""
    if data[:2] in UTF_16:
        raise InputError("is UTF-16; allowed: UTF-8 text", where=where)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"byte {error.start} is not UTF-8; allowed: UTF-8 text", where=where) from None


def read_text(path: AnyPath, what: str = "design file", most: Bound = TOML_BYTES) -> str:
    """The text of a regular file of bounded size; as `read_bytes`, `decode`."""
    return decode(read_bytes(path, what, most), shown_path(path))


def read_toml(
    path: AnyPath, what: str = "design file", size: Bound = TOML_BYTES, values: Bound = TOML_VALUES
) -> Tree:
    """The tree of a TOML file: size, encoding, syntax, depth, texts and integers checked."""
    return parse_toml(read_text(path, what, size), shown_path(path), size=size, values=values)


def read_campaign_toml(path: AnyPath) -> Tree:
    """As `read_toml`, for campaign and record files, which list thousands of runs."""
    return read_toml(path, "campaign or record file", bounds.CAMPAIGN_BYTES, bounds.CAMPAIGN_VALUES)


def read_json(path: AnyPath, what: str = "report.json") -> Any:
    """The value of a JSON file, checked like a TOML file; NaN and Infinity are refused."""
    where, text = shown_path(path), read_text(path, what, bounds.REPORT_BYTES)
    if not text.strip():
        raise InputError(f"is empty; allowed: a {what}", where=where)
    return parse_json(text, where)


def parse_toml(text: str, where: str, *, size: Bound = TOML_BYTES, values: Bound = TOML_VALUES) -> Tree:
    """The tree of a TOML text, refused with line and column where the syntax is wrong."""
    with in_file(where):
        if len(text) > size.most:
            raise InputError(f"is larger than allowed: {size.allowed}")
        for number, line in enumerate(text.splitlines(), 1):
            head = line.partition("=")[0]
            if head.count(".") > bounds.KEY_PARTS.most and not head.lstrip().startswith("#"):
                raise InputError(f"line {number}: a key {_too_deep('', TOML_DEPTH)}")
        try:
            tree = tomllib.loads(text)
        except RecursionError:
            raise InputError(_too_deep("", TOML_DEPTH)) from None
        except (ValueError, OverflowError) as error:
            raise InputError(f"not TOML: {_plain(str(error), 200)}{_hint(text, error)}") from None
        _walk(tree, TOML_DEPTH, values, bounds.TEXT_CHARACTERS)
    return tree


_UNQUOTED = re.compile(
    r"\s*([A-Za-z_][\w.]*)\s*=\s*([+-]?[0-9][0-9.,eE+-]*\s*[A-Za-zµΩ%/°][^#\"\n]*?)\s*(#.*)?$"
)
_COMMA = re.compile(r"\s*([A-Za-z_][\w.]*)\s*=\s*([+-]?[0-9]+,[0-9]+)\s*(#.*)?$")
_HINT_CHARACTERS = 300  # the expressions take the square of the length of a line


def _hint(text: str, error: Exception) -> str:
    """What the line at fault most likely wants: quotes around a quantity, a decimal point."""
    place = re.search(r"line ([0-9]+)", str(error))
    lines = text.splitlines()
    if place is None or not 0 < int(place[1]) <= len(lines):
        return ""
    line = lines[int(place[1]) - 1]
    if len(line) > _HINT_CHARACTERS:
        return ""
    if "\u201c" in line or "\u201d" in line or "\u201e" in line:
        return '; use straight quotes: "'
    if re.search(r";\s*(#.*)?$", line):
        return "; no semicolon at the end of a line"
    if text.lstrip()[:1] in "{[" and text.lstrip()[:2] not in ("[[",) and ":" in line:
        return "; this looks like JSON, TOML is wanted"
    if re.match(r"[^=\[#]*[,;\t][^=\[#]*$", lines[0]):
        return "; this looks like a table of numbers, TOML is wanted: a record, and no design?"
    if "Illegal character" in str(error) and line.partition("#")[0].count('"') % 2:
        return "; a quote that is opened in this line is not closed"
    if result := _COMMA.match(line):
        return f"; use a decimal point: {result[1]} = {result[2].replace(',', '.')}"
    if result := _UNQUOTED.match(line):
        return f'; put a quantity in quotes: {result[1]} = "{_plain(result[2].replace(",", "."))}"'
    return ""


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not allowed")


def parse_json(text: str, where: str, constant: Callable[[str], float] = _refuse_constant) -> Any:
    """The value of a JSON text: no NaN and Infinity unless they are read by ``constant``, no key twice,
    bounded depth, no control characters.
    """
    with in_file(where):
        try:
            hooks: Any = {"parse_float": _finite, "object_pairs_hook": _no_key_twice}
            value = json.loads(text, parse_constant=constant, **hooks)
        except RecursionError:
            raise InputError(_too_deep("", bounds.JSON_DEPTH)) from None
        except (ValueError, OverflowError) as error:
            raise InputError(f"not JSON: {_plain(str(error), 200)}") from None
        _walk(value, bounds.JSON_DEPTH, None, None)
    return value


def _finite(digits: str) -> float:
    value = float(digits)
    if value - value != 0.0:
        raise ValueError(f"{digits[:20]} is beyond the range of floats")
    return value


def _no_key_twice(pairs: list[tuple[str, Any]]) -> Tree:
    twice = next((key for key, count in Counter(key for key, _ in pairs).items() if count > 1), None)
    if twice is not None:
        raise ValueError(f"the key {shown(twice)} stands twice in one table")
    return dict(pairs)


def _plain(text: str, longest: int = 60) -> str:
    return shown(text, longest)[1:-1]


def _too_deep(path: str, depth: Bound) -> str:
    at = f"{_plain(path)}: " if path else ""
    return f"{at}nested too deeply; allowed: {depth.most} levels"


def _walk(tree: Any, depths: Bound, values: Bound | None, length: Bound | None) -> None:
    """Refuse deep nesting, too many values, long texts, huge integers and control characters."""
    stack: list[tuple[str, Any, int]] = [("", tree, 0)]
    count = 0
    while stack:
        path, value, depth = stack.pop()
        count += 1
        if depth > depths.most:
            raise InputError(_too_deep(path, depths))
        if values is not None and count > values.most:
            raise InputError(f"more values than allowed: {values.allowed}")
        if isinstance(value, dict):
            for key, item in value.items():
                _check_text(key, f"a key of {path or 'the file'}", _CONTROL_OF_KEYS, length)
                stack.append((f"{path}.{key}" if path else key, item, depth + 1))
        elif isinstance(value, list):
            stack.extend(
                (f"{path}[{i + 1}]", item, depth + 1)
                for i, item in enumerate(value)
                if values is not None or type(item) not in _HARMLESS
            )
        elif isinstance(value, str):
            _check_text(value, path, _CONTROL, length)
        elif isinstance(value, int) and value not in INTEGERS:
            raise InputError(f"{_plain(path)} = {shown(value)}: allowed: whole numbers of 64 bits")


def _check_text(text: str, path: str, refused: tuple[str, ...], length: Bound | None) -> None:
    """Refuse a long text, and characters of some Unicode categories; line break and tab may stand."""
    if length is not None and len(text) > length.most:
        raise InputError(f"{_plain(path)}: {len(text)} characters; allowed: {length.allowed}")
    for character in () if text.isprintable() else text:
        if unicodedata.category(character) in refused and character not in "\n\t":
            held = f"the control character U+{ord(character):04X}"
            raise InputError(f"{_plain(path)} = {shown(text)}: holds {held}; allowed: printable text")
