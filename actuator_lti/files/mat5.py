"""Real numeric arrays out of a MATLAB level 5 file, by a small reader that trusts nothing in it.

The usual one can crash the interpreter on a damaged file. Layout: MathWorks, "MAT-File Format" (R2019b),
chapter 1. Texts and cells of texts are lists of names, sparse matrices full ones, fields of a structure
``name.field``; all else is passed over and named, complex arrays too, which stand beside the real ones.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_lti.bounds import MAT_DIMENSIONS, MAT_VALUES
from actuator_lti.errors import InputError
from actuator_lti.types import Floats

HEADER = 128
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
CELL, STRUCTURE, TEXT, SPARSE = 1, 2, 4, 5
NUMERIC_CLASSES = range(6, 16)
COMPLEX_FLAG = 0x08
MAX_BYTES = 8 * MAT_VALUES.most  # unpacked
MAX_DIMENSIONS = MAT_DIMENSIONS.most


@dataclass
class MatContent:
    """Arrays by name, lists of texts by name, and the names (or kinds) of what was passed over."""

    arrays: dict[str, Floats] = field(default_factory=dict)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    passed_over: list[str] = field(default_factory=list)
    complexes: dict[str, NDArray[np.complex128]] = field(default_factory=dict)


def read_mat5(data: bytes) -> MatContent:
    """Read the numeric arrays of a level 5 file.

    An InputError says, without the file's name, what is wrong, and at which byte.

    >>> read_mat5(b"MATLAB")
    Traceback (most recent call last):
    ...
    actuator_lti.errors.InputError: 6 bytes: too short for a MATLAB file
    """
    if len(data) < HEADER:
        raise InputError(f"{len(data)} bytes: too short for a MATLAB file")
    if (order := {b"IM": "<", b"MI": ">"}.get(data[126:128])) is None:
        raise InputError("no MATLAB level 5 file (level 4 and other formats are not read; save it with -v7)")
    if struct.unpack(f"{order}H", data[124:126])[0] == 0x0200 or data[HEADER : HEADER + 4] == b"\x89HDF":
        raise InputError("is a MATLAB 7.3 (HDF5) file; save it with -v7")
    reader = _Reader(order)
    for kind, body, place in reader.elements(data, HEADER):
        held = reader.elements(_inflated(body, place)) if kind == COMPRESSED else [(kind, body, place)]
        for element in held:
            reader.take(*element)
    return reader.content


Part = tuple[int, bytes, int]  # type, content, place


class _Reader:
    def __init__(self, order: str) -> None:
        self.order, self.content = order, MatContent()

    def take(self, kind: int, body: bytes, place: int) -> None:
        parts = list(self.elements(body)) if kind == MATRIX else []
        if len(parts) < 3 or len(parts[0][1]) < 8:
            what = "incomplete array" if kind == MATRIX else f"element of type {kind}"
            self.content.passed_over.append(f"{what} at byte {place}")
            return
        name = parts[2][1].decode("latin-1")
        takers = {CELL: self._cell, STRUCTURE: self._structure, TEXT: self._text, SPARSE: self._sparse}
        if not takers.get(self._flags(parts[0]) & 0xFF, self._array)(name, parts, place):
            self.content.passed_over.append(name)

    def _array(self, name: str, parts: list[Part], place: int) -> bool:
        """A numeric array; a complex one is kept, too, but not taken for a real one."""
        flags = self._flags(parts[0])
        is_complex, at = bool((flags >> 8) & COMPLEX_FLAG), f'array "{name}" at byte {place}'
        if len(parts) < (5 if is_complex else 4) or not (is_complex or flags & 0xFF in NUMERIC_CLASSES):
            return False
        shape, values = self._numbers(parts[1]), self._numbers(parts[3])
        if shape is None or values is None or not 0 < len(shape) <= MAX_DIMENSIONS:
            raise InputError(f"{at}: no numbers in it")
        dimensions = [int(n) for n in shape]
        if min(dimensions) < 0 or prod(dimensions) != len(values):
            raise InputError(f"{at}: {len(values)} numbers for the shape {dimensions}")
        if not is_complex:
            self.content.arrays[name] = values.reshape(dimensions, order="F")
            return True
        imaginary = self._numbers(parts[4])
        if imaginary is None or len(imaginary) != len(values):
            raise InputError(f"{at}: no imaginary part for the shape {dimensions}")
        self.content.complexes[name] = (values + 1j * imaginary).reshape(dimensions, order="F")
        return False

    def _sparse(self, name: str, parts: list[Part], _place: int) -> bool:
        """A sparse matrix, which is written by columns, as a full one where that is not too large."""
        numbers = [one for part in (parts[1], *parts[3:]) if (one := self._numbers(part)) is not None]
        there = sum(array.size for array in self.content.arrays.values())
        if len(numbers) not in (4, 5) or len(numbers[0]) != 2 or there + prod(numbers[0]) > MAT_VALUES.most:
            return False
        shape, rows, starts, *values = numbers
        try:
            columns = np.repeat(np.arange(int(shape[1])), np.diff(starts.astype(int)))
            places = np.ravel_multi_index((rows[: len(columns)].astype(int), columns), shape.astype(int))
            full = np.zeros(int(prod(shape)), dtype=complex if len(values) == 2 else float)
            full[places] = sum(k * v[: len(columns)] for k, v in zip((1, 1j), values, strict=False))
        except ValueError:
            return False
        into: dict[str, Any] = self.content.complexes if len(values) == 2 else self.content.arrays
        into[name] = full.reshape(shape.astype(int))
        return len(values) == 1

    def _text(self, name: str, parts: list[Part], _place: int) -> bool:
        shape = self._numbers(parts[1])
        if len(parts) < 4 or shape is None or len(shape) != 2:
            return False
        rows, columns = int(shape[0]), int(shape[1])
        kind, body, at = parts[3]
        codes = self._numbers(({16: 2, 17: 4}.get(kind, kind), body, at))
        if codes is None or len(codes) != rows * columns or np.any(codes > 0x10FFFF) or np.any(codes < 0):
            return False
        table = codes.astype(int).reshape((rows, columns), order="F")
        self.content.texts[name] = tuple("".join(map(chr, row)).strip() for row in table.tolist())
        return True

    def _cell(self, name: str, parts: list[Part], _place: int) -> bool:
        result: list[str] = []
        for cell in parts[3:]:
            texts = self._inside(cell).texts.values() if self._class_of(cell) == TEXT else ()
            words = [text for rows in texts for text in rows]
            if len(words) != 1:
                return False
            result += words
        self.content.texts[name] = tuple(result)
        return True

    def _structure(self, name: str, parts: list[Part], _place: int) -> bool:
        """Numeric and text fields of a single structure, as ``name.field``."""
        shape = self._numbers(parts[1])
        if len(parts) < 5 or shape is None or np.prod(shape) != 1:
            return False
        length, text = self._numbers(parts[3]), parts[4][1]
        size = 0 if length is None or not len(length) else int(length[0])
        if not 0 < size <= 64 or len(text) % size:
            return False
        fields = [text[k : k + size].split(b"\0")[0].decode("latin-1") for k in range(0, len(text), size)]
        for field_name, part in zip(fields, parts[5:], strict=False):
            full = f"{name}.{field_name}"
            inner = MatContent() if self._class_of(part) == STRUCTURE else self._inside(part)
            if not (inner.arrays or inner.texts):
                self.content.passed_over.append(full)
            for kind in ("arrays", "complexes", "texts"):
                getattr(self.content, kind).update(zip([full], getattr(inner, kind).values(), strict=False))
        return True

    def _inside(self, part: Part) -> MatContent:
        reader = _Reader(self.order)
        reader.take(*part)
        return reader.content

    def _class_of(self, part: Part) -> int:
        """The class of an array; 0 where it is none, or incomplete."""
        first = next(self.elements(part[1]), None) if part[0] == MATRIX else None
        return 0 if first is None or len(first[1]) < 4 else self._flags(first) & 0xFF

    def _flags(self, part: Part) -> int:
        return int(struct.unpack(f"{self.order}I", part[1][:4])[0])

    def elements(self, data: bytes, place: int = 0) -> Iterator[Part]:
        while place + 8 <= len(data):
            first, size = struct.unpack_from(f"{self.order}II", data, place)
            if first >> 16:
                kind, size, begin, following = first & 0xFFFF, first >> 16, place + 4, place + 8
                if size > 4:
                    raise InputError(f"damaged at byte {place}: a small element of {size} bytes")
            else:
                kind, begin = first, place + 8
                following = begin + (size if kind == COMPRESSED else -(-size // 8) * 8)
            if begin + size > len(data):
                there = len(data) - begin
                raise InputError(f"damaged at byte {place}: {size} bytes announced, {there} there")
            yield kind, data[begin : begin + size], place
            place = following

    def _numbers(self, part: Part) -> Floats | None:
        """Numbers of one element as floats; None for a type that is no number."""
        if (code := NUMBERS.get(part[0])) is None:
            return None
        dtype = np.dtype(f"{self.order}{code}")
        if len(part[1]) % dtype.itemsize:
            return None
        MAT_VALUES.check(len(part[1]) // dtype.itemsize)
        return np.frombuffer(part[1], dtype=dtype).astype(np.float64)


def _inflated(body: bytes, place: int) -> bytes:
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
