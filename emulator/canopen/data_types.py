"""Values as bytes on the bus and back: the data types of CiA 301, 7.1.4 and 7.1.6 (little endian)."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from math import isfinite
from typing import Protocol

from drivetwin.drive_profiles.profile import BITS, FLOATS, SIGNED, DataType

Value = int | float | str

FORMATS: dict[DataType, str] = {
    DataType.BOOL: "?",
    DataType.I8: "b",
    DataType.I16: "h",
    DataType.I32: "i",
    DataType.I64: "q",
    DataType.U8: "B",
    DataType.U16: "H",
    DataType.U32: "I",
    DataType.U64: "Q",
    DataType.R32: "f",
    DataType.R64: "d",
}
"""`struct` codes of the types that it has; the others are integers of 24, 40, 48 or 56 bits, and text."""

_STRUCTS = {data_type: struct.Struct("<" + code) for data_type, code in FORMATS.items()}

_MOST = {DataType.R32: 3.4028234663852886e38, DataType.R64: 1.7976931348623157e308}
"""Largest number of the floating-point types."""


def size(data_type: DataType) -> int | None:
    """Length in bytes; None where each value has its own."""
    return -(-BITS[data_type] // 8) if data_type in BITS else None


def type_range(data_type: DataType) -> tuple[int | float, int | float]:
    """Smallest and largest value of a type with a fixed length."""
    if data_type in FLOATS:
        return -_MOST[data_type], _MOST[data_type]
    bits = BITS[data_type]
    return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if data_type in SIGNED else (0, (1 << bits) - 1)


def encode(data_type: DataType, value: Value) -> bytes:
    """Bytes of a value that fits its type; text is ISO 8859-1 (a superset of VISIBLE_STRING, and any OCTET_STRING)."""
    if isinstance(value, str):
        return value.encode("latin-1", "replace")
    if data_type in _STRUCTS:
        return _STRUCTS[data_type].pack(value)
    return int(value).to_bytes(BITS[data_type] // 8, "little", signed=data_type in SIGNED)


def encode_nearest(data_type: DataType, value: Value) -> bytes:
    """Bytes of a value; of one beyond its type those of the nearest that the type has."""
    try:
        return encode(data_type, value)
    except (struct.error, OverflowError):
        return encode(data_type, saturate(data_type, value))


def decode(data_type: DataType, data: bytes) -> Value:
    """Value of bytes that have the type's length."""
    if data_type not in BITS:
        return data.decode("latin-1")
    if data_type not in _STRUCTS:
        return int.from_bytes(data, "little", signed=data_type in SIGNED)
    value: int | float = _STRUCTS[data_type].unpack(data)[0]
    return value


def saturate(data_type: DataType, value: Value) -> Value:
    """The nearest value that the type can say: how a drive reports a measurement beyond its scale. NaN is told as 0."""
    if isinstance(value, str):
        return value
    if value != value:  # noqa: PLR0124  # NaN
        return 0
    low, high = type_range(data_type)
    clipped = min(max(value, low), high)
    return clipped if data_type in FLOATS else int(clipped)


def is_number(value: Value) -> bool:
    """Whether a value is text or a finite number, as every object wants it."""
    return isinstance(value, str) or isfinite(value)


class Layout(Protocol):
    """How several values lie one behind the other; `struct.Struct` is one. Raises struct.error or OverflowError as it does."""

    @property
    def size(self) -> int:
        """Length in bytes."""

    def pack(self, *values: Value) -> bytes:
        """The bytes of the values."""

    def unpack_from(self, data: bytes) -> Sequence[Value]:
        """The values of bytes, what is beyond `size` left out."""


def layout(parts: Sequence[DataType | int]) -> Layout:
    """The layout of values by their types; a number stands for so many bytes that no value has."""
    if any(isinstance(part, DataType) and part not in FORMATS for part in parts):
        return _Pieces(parts)
    return struct.Struct("<" + "".join(FORMATS[part] if isinstance(part, DataType) else f"{part}x" for part in parts))


class _Pieces:
    """A layout of types some of which `struct` does not have."""

    def __init__(self, parts: Sequence[DataType | int]) -> None:
        self._parts = tuple((part if isinstance(part, DataType) else None, _length(part)) for part in parts)
        self.size = sum(length for _, length in self._parts)

    def pack(self, *values: Value) -> bytes:
        told = iter(values)
        return b"".join(bytes(length) if part is None else encode(part, next(told)) for part, length in self._parts)

    def unpack_from(self, data: bytes) -> Sequence[Value]:
        values, at = [], 0
        for part, length in self._parts:
            if part is not None:
                values.append(decode(part, data[at : at + length]))
            at += length
        return values


def _length(part: DataType | int) -> int:
    return (size(part) or 0) if isinstance(part, DataType) else part
