"""Numbers as EDS and DCF files write them (CiA 306-1, 4.6.3), with what vendors make of it."""

from __future__ import annotations

import struct
from math import isfinite

from drivetwin.drive_profiles.eds_reader import parse_number
from drivetwin.drive_profiles.profile import BITS, FLOATS, SIGNED, TEXT_TYPES, DataType


def number_of(text: str, data_type: DataType) -> int | float | None:
    """The number that a text says for a type, None where it is none or beyond the type."""
    if data_type in FLOATS:
        return _real(text, data_type)
    told = parse_number(text)
    if told is None or data_type in TEXT_TYPES:
        return None
    value, bits = told.value, BITS[data_type]
    if data_type in SIGNED:
        if value >> (bits - 1) == 1:  # two's complement, as vendors write negative numbers in hexadecimal
            value -= 1 << bits
        return value if -(1 << (bits - 1)) <= value < 1 << (bits - 1) else None
    return value if 0 <= value < 1 << bits else None


def _real(text: str, data_type: DataType) -> float | None:
    """A REAL32 or REAL64 as a number, or as the bit pattern that some tools write in hexadecimal."""
    real, pattern = ("!f", "!I") if data_type is DataType.R32 else ("!d", "!Q")
    try:
        is_pattern = text.lower().startswith("0x")
        value = struct.unpack(real, struct.pack(pattern, int(text, 16)))[0] if is_pattern else float(text)
    except (ValueError, struct.error):
        return None
    return float(value) if isfinite(value) else None
