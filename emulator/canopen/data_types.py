"""Values as bytes on the bus and back: the basic data types of CiA 301, 7.1.4 (little endian)."""

from __future__ import annotations

import struct
from math import isfinite

from drive_profiles import DataType

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
}
"""`struct` codes of the types with a fixed length; the others are text."""

_STRUCTS = {data_type: struct.Struct("<" + code) for data_type, code in FORMATS.items()}

FLOAT_MAX = 3.4028234663852886e38
"""Largest REAL32."""


def size(data_type: DataType) -> int | None:
    """Length in bytes; None where each value has its own."""
    return _STRUCTS[data_type].size if data_type in _STRUCTS else None


def type_range(data_type: DataType) -> tuple[int | float, int | float]:
    """Smallest and largest value of a type with a fixed length."""
    if data_type is DataType.BOOL:
        return 0, 1
    if data_type is DataType.R32:
        return -FLOAT_MAX, FLOAT_MAX
    bits = 8 * _STRUCTS[data_type].size
    signed = FORMATS[data_type].islower()
    return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)


def encode(data_type: DataType, value: Value) -> bytes:
    """Bytes of a value that fits its type; text is ISO 8859-1 (a superset of VISIBLE_STRING, and any OCTET_STRING)."""
    if isinstance(value, str):
        return value.encode("latin-1", "replace")
    return _STRUCTS[data_type].pack(value)


def decode(data_type: DataType, data: bytes) -> Value:
    """Value of bytes that have the type's length."""
    if data_type not in _STRUCTS:
        return data.decode("latin-1")
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
    return clipped if data_type is DataType.R32 else int(clipped)


def is_number(value: Value) -> bool:
    """Whether a value is text or a finite number, as every object wants it."""
    return isinstance(value, str) or isfinite(value)
