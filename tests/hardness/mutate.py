# ruff: noqa: E501 (tables of tokens)
"""Damage to bytes, texts, trees and numbers, reproducible from a seed."""

import copy
import random
import re
from typing import Any

TOKENS = [
    b"\x00", b"\x1b[31m", b"\xff\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\r", b"\t", b"\xe2\x80\xae", b"\xc2\x85",
    b"nan", b"inf", b"-inf", b"1e400", b"-0.0", b"1e-320", b"9" * 400, b"9" * 5000, b"0x7fffffffffffffff", b"1_000",
    b"true", b"[]", b"{}", b"[[", b"]]", b"{", b"}", b'"', b"'", b'"""', b"=", b"#", b",", b";", b".", b"\n", b"=\n",
    b"a" * 300, b"." * 70, b"[" * 60, b"../../../etc/passwd", b"/dev/zero", b"%s%n", b"{{7*7}}", b"<script>", b"(?:(",
    b"1979-05-27", b"-1", b"0", b"1", b"9223372036854775808", b"1 rad/s", b"1 mohm", b"-3 kg*m^2", b"every", b"\\u0000",
]  # fmt: skip
SCALARS: list[Any] = [
    None, True, False, 0, 1, -1, 2**63, 1e308, -1e-320, "", "x", "a" * 20_000, "\x1b[0m", "\u202e", [], {}, [[]],
    [None], {"a": 1}, "pass", "fail", "table", "sig:3", "sig:999", "fix:-1", "1979-05-27", "NaN", 10**30,
]  # fmt: skip
_WINDOW = 16_384
NUMBERS = (b"0", b"-1", b"1e300", b"1e-300", b"nan", b"inf", b"1e400", b"3.5", b"2147483648")
NUMBER = re.compile(rb"(?<![\w.\"])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
QUANTITY = re.compile(rb'"([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)( [^"\n]*)?"')


def damaged(data: bytes, draw: random.Random) -> bytes:
    """Bytes with one to eight faults."""
    out = bytearray(data)
    for _ in range(draw.choice((1, 1, 1, 2, 3, 8))):
        place = draw.randrange(len(out) + 1)
        length = draw.choice((0, 1, 2, 8, 64))
        kind = draw.randrange(6)
        if kind == 0:
            out[place : place + length] = draw.randbytes(draw.randrange(1, 9))
        elif kind == 1:
            out[place : place + length] = draw.choice(TOKENS)
        elif kind == 2:
            del out[place : place + max(length, 1)]
        elif kind == 3:
            other = draw.randrange(len(out) + 1)
            out[place:place] = out[other : other + draw.choice((1, 8, 64, 512))]
        else:
            out = bytearray((_line_fault if kind == 4 else _number_fault)(bytes(out), draw))
    if draw.random() < 0.05:
        del out[draw.randrange(len(out) + 1) :]
    return bytes(out)


def _line_fault(data: bytes, draw: random.Random) -> bytes:
    """A line twice, away, or in another place; or its value replaced."""
    lines = data.split(b"\n")
    k = draw.randrange(len(lines))
    kind = draw.randrange(4)
    if kind == 0:
        lines.insert(draw.randrange(len(lines) + 1), lines[k])
    elif kind == 1:
        del lines[k]
    elif kind == 2:
        lines.insert(draw.randrange(len(lines)), lines.pop(k))
    else:
        key, equals, _ = lines[k].partition(b"=")
        lines[k] = key + equals + b" " + draw.choice(TOKENS)
    return b"\n".join(lines)


def _number_fault(data: bytes, draw: random.Random) -> bytes:
    """One number scaled, negated or replaced; of a large file, one within a few pages of it."""
    begin = draw.randrange(len(data) - _WINDOW) if len(data) > _WINDOW else 0
    part = data[begin : begin + _WINDOW]
    result = list(NUMBER.finditer(part)) + list(QUANTITY.finditer(part))
    if not result:
        return data
    spot = draw.choice(result)
    group = 1 if spot.re is QUANTITY else 0
    return data[: begin + spot.start(group)] + _number(spot[group], draw) + data[begin + spot.end(group) :]


def _number(text: bytes, draw: random.Random) -> bytes:
    if draw.random() < 0.3:
        return draw.choice(NUMBERS)
    return f"{float(text[:300]) * 10.0 ** draw.uniform(-9.0, 9.0):.6g}".encode()


def extreme(text: bytes, draw: random.Random) -> bytes:
    """A design with some quantities moved over decades: most of them are still designs."""
    spread = draw.choice((0.3, 1.0, 3.0, 6.0))
    chance = draw.choice((0.03, 0.1, 0.5))

    def moved(spot: re.Match[bytes]) -> bytes:
        if draw.random() > chance:
            return spot[0]
        value = float(spot[1]) * 10.0 ** draw.uniform(-spread, spread)
        return f'"{value:.6g}'.encode() + (spot[2] or b"") + b'"'

    return QUANTITY.sub(moved, text)


def damaged_tree(tree: Any, draw: random.Random) -> Any:
    """Plain data with one to five nodes replaced, removed, renamed or doubled."""
    tree = copy.deepcopy(tree)
    for _ in range(draw.choice((1, 1, 2, 5))):
        parent, key = tree, None
        while isinstance(parent, dict | list) and parent:
            key = draw.choice(list(parent)) if isinstance(parent, dict) else draw.randrange(len(parent))
            if not isinstance(parent[key], dict | list) or not parent[key] or draw.random() < 0.25:
                break
            parent = parent[key]
        if key is None:
            return draw.choice(SCALARS)
        kind = draw.randrange(4)
        if kind == 0:
            del parent[key]
        elif kind == 1 and isinstance(parent, dict):
            parent[str(draw.choice(SCALARS))[:50]] = parent.pop(key)
        elif kind == 2 and isinstance(parent, list):
            parent.insert(key, copy.deepcopy(parent[key]))
        else:
            parent[key] = copy.deepcopy(draw.choice(SCALARS))
    return tree
