"""Real numeric arrays out of a MATLAB level 5 file, by a small reader that trusts nothing in it.

A reader of its own because the usual one can crash the interpreter on a damaged file. Source of the layout:
MathWorks, "MAT-File Format" (R2019b), chapter 1. Texts and cells of texts are read as lists of names, numeric
fields of a structure as ``name.field``; all else (sparse, objects) is passed over and named. So are complex
arrays, which stand beside the real ones for whoever asks for them.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from actuator_lti.bounds import MAT_DIMENSIONS, MAT_VALUES
from actuator_lti.errors import InputError

FloatArray = NDArray[np.float64]

HEADER = 128
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
CELL, STRUCTURE, TEXT = 1, 2, 4
NUMERIC_CLASSES = range(6, 16)
COMPLEX_FLAG = 0x08
MAX_BYTES = 8 * MAT_VALUES.most  # unpacked
MAX_DIMENSIONS = MAT_DIMENSIONS.most


@dataclass
class MatContent:
    """Arrays by name, lists of texts by name, and the names (or kinds) of what was passed over."""

    arrays: dict[str, FloatArray] = field(default_factory=dict)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    passed_over: list[str] = field(default_factory=list)
    complexes: dict[str, NDArray[np.complex128]] = field(default_factory=dict)


def read_mat5(data: bytes) -> MatContent:
    """Read the numeric arrays of a level 5 file.

    Raises
    ------
    InputError
        Without the file's name: what is wrong, and at which byte.

    Examples
    --------
    >>> read_mat5(b"MATLAB")
    Traceback (most recent call last):
    ...
    actuator_lti.errors.InputError: 6 bytes: too short for a MATLAB file
    """
    if len(data) < HEADER:
        raise InputError(f"{len(data)} bytes: too short for a MATLAB file")
    mark, version = data[126:128], data[124:126]
    order = {b"IM": "<", b"MI": ">"}.get(mark)
    if order is None:
        raise InputError("no MATLAB level 5 file (level 4 and other formats are not read; save it with -v7)")
    if struct.unpack(f"{order}H", version)[0] == 0x0200 or data[HEADER : HEADER + 4] == b"\x89HDF":
        raise InputError("is a MATLAB 7.3 (HDF5) file; save it with -v7")
    content = MatContent()
    for kind, body, place in _elements(data, HEADER, len(data), order):
        if kind == COMPRESSED:
            inflated = _inflated(body, place)
            for inner, inner_body, inner_place in _elements(inflated, 0, len(inflated), order):
                _take(inner, inner_body, inner_place, order, content)
        else:
            _take(kind, body, place, order, content)
    return content


def _take(kind: int, body: bytes, place: int, order: str, content: MatContent) -> None:
    """Add one top-level element to the content."""
    if kind != MATRIX:
        content.passed_over.append(f"element of type {kind} at byte {place}")
        return
    parts = list(_elements(body, 0, len(body), order))
    if len(parts) < 3 or len(parts[0][1]) < 8:
        content.passed_over.append(f"incomplete array at byte {place}")
        return
    flags = struct.unpack(f"{order}I", parts[0][1][:4])[0]
    name = parts[2][1].decode("latin-1")
    special = {CELL: _take_cell, STRUCTURE: _take_structure, TEXT: _take_text}.get(flags & 0xFF)
    if special is not None:
        special(name, parts, order, content)
        return
    is_complex = bool((flags >> 8) & COMPLEX_FLAG)
    if is_complex or (flags & 0xFF) not in NUMERIC_CLASSES or len(parts) < 4:
        content.passed_over.append(name)
        if not is_complex or len(parts) < 5:
            return
    shape = _numbers(parts[1][0], parts[1][1], order)
    values = _numbers(parts[3][0], parts[3][1], order)
    if shape is None or values is None or not 0 < len(shape) <= MAX_DIMENSIONS:
        raise InputError(f'array "{name}" at byte {place}: no numbers in it')
    dimensions = [int(n) for n in shape]
    count = 1
    for n in dimensions:
        count *= n
    if min(dimensions) < 0 or count != len(values):
        raise InputError(f'array "{name}" at byte {place}: {len(values)} numbers for the shape {dimensions}')
    if is_complex:
        imaginary = _numbers(parts[4][0], parts[4][1], order)
        if imaginary is None or len(imaginary) != count:
            raise InputError(f'array "{name}" at byte {place}: no imaginary part for the shape {dimensions}')
        content.complexes[name] = (values + 1j * imaginary).reshape(dimensions, order="F")
    else:
        content.arrays[name] = values.reshape(dimensions, order="F")


Parts = list[tuple[int, bytes, int]]


def _take_text(name: str, parts: Parts, order: str, content: MatContent) -> None:
    """A text: one name for each row of a character array."""
    shape = _numbers(parts[1][0], parts[1][1], order)
    if len(parts) < 4 or shape is None or len(shape) != 2:
        content.passed_over.append(name)
        return
    rows, columns = int(shape[0]), int(shape[1])
    kind, body = parts[3][0], parts[3][1]
    codes = _numbers({16: 2, 17: 4}.get(kind, kind), body, order)
    if codes is None or len(codes) != rows * columns or np.any(codes > 0x10FFFF) or np.any(codes < 0):
        content.passed_over.append(name)
        return
    table = codes.astype(int).reshape((rows, columns), order="F")
    content.texts[name] = tuple("".join(map(chr, row)).strip() for row in table.tolist())


def _take_cell(name: str, parts: Parts, order: str, content: MatContent) -> None:
    """A cell array whose cells are all texts of one row."""
    inner = MatContent()
    result: list[str] = []
    for kind, body, place in parts[3:]:
        inner.texts.clear()
        if kind == MATRIX and _class_of(body, order) == TEXT:
            _take(kind, body, place, order, inner)
        texts = [text for rows in inner.texts.values() for text in rows]
        if len(texts) != 1:
            content.passed_over.append(name)
            return
        result += texts
    content.texts[name] = tuple(result)


def _take_structure(name: str, parts: Parts, order: str, content: MatContent) -> None:
    """The numeric fields of a single structure, as ``name.field``."""
    shape = _numbers(parts[1][0], parts[1][1], order)
    if len(parts) < 5 or shape is None or np.prod(shape) != 1:
        content.passed_over.append(name)
        return
    length = _numbers(parts[3][0], parts[3][1], order)
    size = 0 if length is None or not len(length) else int(length[0])
    text = parts[4][1]
    if not 0 < size <= 64 or len(text) % size:
        content.passed_over.append(name)
        return
    fields = [text[k : k + size].split(b"\0")[0].decode("latin-1") for k in range(0, len(text), size)]
    for field_name, (kind, body, place) in zip(fields, parts[5:], strict=False):
        if kind != MATRIX or _class_of(body, order) not in NUMERIC_CLASSES:
            content.passed_over.append(f"{name}.{field_name}")
            continue
        inner = MatContent()
        _take(kind, body, place, order, inner)
        content.arrays |= {f"{name}.{field_name}": values for values in inner.arrays.values()}
        content.complexes |= {f"{name}.{field_name}": values for values in inner.complexes.values()}


def _class_of(body: bytes, order: str) -> int:
    """The class of an array; 0 where it is incomplete."""
    first = next(iter(_elements(body, 0, len(body), order)), None)
    if first is None or len(first[1]) < 4:
        return 0
    return int(struct.unpack(f"{order}I", first[1][:4])[0]) & 0xFF


def _elements(data: bytes, start: int, stop: int, order: str) -> Iterator[tuple[int, bytes, int]]:
    """Data elements (type, content, place) between two places, each within them."""
    place = start
    while place + 8 <= stop:
        first, size = struct.unpack_from(f"{order}II", data, place)
        if first >> 16:
            kind, size, begin, following = first & 0xFFFF, first >> 16, place + 4, place + 8
            if size > 4:
                raise InputError(f"damaged at byte {place}: a small element of {size} bytes")
        else:
            kind, begin = first, place + 8
            padded = size if kind == COMPRESSED else -(-size // 8) * 8
            following = begin + padded
        if begin + size > stop:
            raise InputError(f"damaged at byte {place}: {size} bytes announced, {stop - begin} there")
        yield kind, data[begin : begin + size], place
        place = following


def _inflated(body: bytes, place: int) -> bytes:
    """A compressed element, unpacked within bounds."""
    unpack = zlib.decompressobj()
    try:
        inflated = unpack.decompress(body, MAX_BYTES)
    except zlib.error as error:
        raise InputError(f"damaged at byte {place}: {error}") from None
    if not unpack.eof and len(inflated) >= MAX_BYTES:
        raise InputError(f"at byte {place}: unpacks to more than allowed: {MAT_VALUES.allowed} numbers")
    if unpack.unconsumed_tail or not unpack.eof:
        raise InputError(f"damaged at byte {place}: compressed data do not end")
    return inflated


def _numbers(kind: int, body: bytes, order: str) -> FloatArray | None:
    """Numbers of one element as floats; None for a type that is no number."""
    code = NUMBERS.get(kind)
    if code is None:
        return None
    dtype = np.dtype(f"{order}{code}")
    if len(body) % dtype.itemsize:
        return None
    MAT_VALUES.check(len(body) // dtype.itemsize)
    return np.frombuffer(body, dtype=dtype).astype(np.float64)
