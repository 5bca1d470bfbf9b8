"""What a person writes becomes the bytes that canopen, another stack, would send; what the drive type forbids is refused."""

from __future__ import annotations

from dataclasses import replace

import canopen
import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.profile import BITS, DataType
from drivetwin.foundation.errors import UserError
from drivetwin.panel.values import decode, encode

ENTRIES = {(entry.index, entry.subindex): entry for entry in load_profile("servoone").objects}


def canopen_bytes(data_type: DataType, value: float) -> bytes:
    variable = canopen.objectdictionary.ODVariable("any", 0x2000)
    variable.data_type = int(data_type)
    return bytes(variable.encode_raw(value))


@pytest.mark.parametrize(
    ("address", "text", "value"),
    [((0x6060, 0), "-3", -3), ((0x6085, 0), "0x10000", 65536), ((0x2168, 0), "12.5", 12.5), ((0x607A, 0), "-70000", -70000)],
)
def test_numbers(address: tuple[int, int], text: str, value: float) -> None:
    entry = ENTRIES[address]
    data = encode(entry, text)
    assert data == canopen_bytes(entry.data_type, value)
    assert decode(entry.data_type, data) == value


@pytest.mark.parametrize(
    ("address", "text", "why"),
    [
        ((0x2172, 0), "3", "outside 0 to 2"),
        ((0x6060, 0), "128", "outside"),
        ((0x6060, 0), "1.5", "integer"),
        ((0x2168, 0), "fast", "number"),
        ((0x2168, 0), "nan", "outside"),
        ((0x2168, 0), "-1", "outside 0"),
    ],
)
def test_what_an_object_cannot_hold_is_refused(address: tuple[int, int], text: str, why: str) -> None:
    with pytest.raises(UserError, match=why):
        encode(ENTRIES[address], text)


def test_bytes_of_another_length_are_no_value() -> None:
    assert all(decode(data_type, b"") is None for data_type in BITS)
    assert decode(DataType.VSTR, b"ServoOne\0") == "ServoOne"


def test_bytes_are_hexadecimal() -> None:
    entry = replace(ENTRIES[0x6060, 0], data_type=DataType.OSTR)
    assert encode(entry, "01 ff") == b"\x01\xff"
    with pytest.raises(UserError, match="'0g' is not bytes in hexadecimal"):
        encode(entry, "0g")
