"""Values of objects: bytes on the bus, text of a person, and back (CiA 301, 7.1.6: little endian)."""

from __future__ import annotations

import struct
from math import isfinite

from drivetwin.drive_profiles import ObjectEntry
from drivetwin.drive_profiles.profile import BITS, BYTE_TYPES, FLOATS, SIGNED, DataType
from drivetwin.foundation.errors import UserError

Value = int | float | str

_FLOAT = {DataType.R32: struct.Struct("<f"), DataType.R64: struct.Struct("<d")}


def decode(data_type: DataType, data: bytes) -> Value | None:
    """The value of bytes; None where they have not the type's length or are no finite number."""
    if data_type not in BITS:
        return data.hex(" ") if data_type in BYTE_TYPES else data.rstrip(b"\0").decode("latin-1")
    if len(data) != -(-BITS[data_type] // 8):
        return None
    if data_type in FLOATS:
        (number,) = _FLOAT[data_type].unpack(data)
        return float(number) if isfinite(number) else None
    return int.from_bytes(data, "little", signed=data_type in SIGNED)


def encode(entry: ObjectEntry, text: str) -> bytes:
    """The bytes of what a person wrote: a number (also 0x...), or text. Raises UserError for what the object cannot hold."""
    try:
        if entry.data_type in BYTE_TYPES:
            return bytes.fromhex(text)
        if entry.data_type not in BITS:
            return text.encode("latin-1", "replace")
        number = float(text) if entry.data_type in FLOATS else int(text, 0)
    except ValueError:
        raise UserError(f"{entry.name}: {text!r} is not {_kind(entry)}") from None
    low, high = limits(entry)
    if not low <= number <= high:
        raise UserError(f"{entry.name}: {number:g} is outside {low:g} to {high:g}")
    return pack(entry.data_type, number)


def pack(data_type: DataType, number: int | float) -> bytes:
    """The bytes of a number that the type can hold."""
    if data_type in FLOATS:
        return _FLOAT[data_type].pack(number)
    return int(number).to_bytes(-(-BITS[data_type] // 8), "little", signed=data_type in SIGNED)


def limits(entry: ObjectEntry) -> tuple[int | float, int | float]:
    """Smallest and largest value: those of the drive type, else those of the data type."""
    if entry.data_type in FLOATS:
        most: int | float = 3.4028234663852886e38 if entry.data_type is DataType.R32 else 1.7976931348623157e308
        least = -most
    else:
        bits = BITS[entry.data_type]
        most = (1 << bits - (entry.data_type in SIGNED)) - 1
        least = -most - 1 if entry.data_type in SIGNED else 0
    return (least if entry.low is None else entry.low), (most if entry.high is None else entry.high)


def _kind(entry: ObjectEntry) -> str:
    if entry.data_type in BYTE_TYPES:
        return "bytes in hexadecimal"
    return "a number" if entry.data_type in FLOATS else "an integer (decimal, or 0x and hexadecimal)"
