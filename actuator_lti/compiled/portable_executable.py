"""Windows libraries without the time of their making, so that the same sources give the same bytes."""

from __future__ import annotations

import struct

_DEBUG = 6  # of the data directories


def without_time(data: bytes) -> bytes:
    """A 64-bit PE file with its time stamps and the identifier of its debug file set to zero."""
    held = bytearray(data)
    (header,) = struct.unpack_from("<I", held, 0x3C)
    if held[header : header + 4] != b"PE\0\0":
        raise ValueError("not a PE file")
    held[header + 8 : header + 12] = bytes(4)
    sections, optional = struct.unpack_from("<H12xH", held, header + 6)
    start = header + 24
    address, size = struct.unpack_from("<II", held, start + 112 + 8 * _DEBUG)
    table = start + optional
    for place in range(table, table + 40 * sections, 40):
        length, first, _, offset = struct.unpack_from("<IIII", held, place + 8)
        if size and first <= address < first + length:
            _clear_debug(held, offset + address - first, size)
    return bytes(held)


def _clear_debug(held: bytearray, begin: int, size: int) -> None:
    """Time stamps of the debug entries, and the 16 bytes and age behind each RSDS."""
    for entry in range(begin, begin + size, 28):
        held[entry + 4 : entry + 8] = bytes(4)
        _, length, _, place = struct.unpack_from("<IIII", held, entry + 12)
        if held[place : place + 4] == b"RSDS" and length >= 24:
            held[place + 4 : place + 24] = bytes(20)
