"""Every abort code of CiA 301 (7.2.4.3.17): what brings it, or why this server never says it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from canopen_bench import NODE, Bench

from drivetwin.drive_profiles import Access, DataType, ObjectEntry, load_profile
from drivetwin.emulator.canopen import AbortCode

CAUSES: dict[AbortCode, tuple[tuple[str, ...], ...]] = {
    AbortCode.TOGGLE_BIT: (
        ("40 08 10 00 00 00 00 00", "70 00 00 00 00 00 00 00"),
        ("21 00 2F 00 09 00 00 00", "10 61 62 63 64 65 66 67"),
    ),
    AbortCode.COMMAND_SPECIFIER: (
        ("E0 00 10 00 00 00 00 00",),
        ("60 00 00 00 00 00 00 00",),
        ("00 61 62 63 64 65 66 67",),
        ("A3 00 00 00 00 00 00 00",),
        ("C1 00 00 00 00 00 00 00",),
    ),
    AbortCode.BLOCK_SIZE: (("A0 08 10 00 00 00 00 00",), ("A0 08 10 00 80 00 00 00",)),
    AbortCode.SEQUENCE_NUMBER: (("C0 00 2F 00 00 00 00 00", "00 61 62 63 64 65 66 67"),),
    AbortCode.CRC: (("C4 00 2F 00 00 00 00 00", "81 61 62 63 64 65 66 67", "C1 FF FF 00 00 00 00 00"),),
    AbortCode.OUT_OF_MEMORY: (("21 00 2F 00 00 00 00 10",), ("C2 00 2F 00 00 00 00 10",)),
    AbortCode.WRITE_ONLY: (("40 01 2F 00 00 00 00 00",), ("A0 01 2F 00 7F 00 00 00",)),
    AbortCode.READ_ONLY: (
        ("23 00 10 00 00 00 00 00",),
        ("2B 41 60 00 00 00 00 00",),
        ("21 08 10 00 09 00 00 00",),
        ("C0 08 10 00 00 00 00 00",),
    ),
    AbortCode.NO_SUCH_OBJECT: (("40 99 29 00 00 00 00 00",), ("2F 99 29 00 00 00 00 00",), ("A0 99 29 00 7F 00 00 00",)),
    AbortCode.NO_SUCH_SUBINDEX: (("40 18 10 09 00 00 00 00",), ("2F 41 60 01 00 00 00 00",)),
    AbortCode.NOT_MAPPABLE: (
        ("2F 01 1A 00 00 00 00 00", "23 01 1A 01 20 00 17 10"),  # 1017h
        ("2F 01 1A 00 00 00 00 00", "23 01 1A 01 08 00 64 60"),  # 8 bits of 6064h
        ("2F 01 16 00 00 00 00 00", "23 01 16 01 10 00 41 60"),  # 6041h to be received
    ),
    AbortCode.PDO_LENGTH: (
        (
            "2F 01 1A 00 00 00 00 00",
            *(f"23 01 1A {place:02X} 20 00 64 60" for place in (1, 2, 3)),
            "2F 01 1A 00 03 00 00 00",
        ),
        ("2F 01 1A 00 09 00 00 00",),
    ),
    AbortCode.PARAMETER_INCOMPATIBLE: (("23 16 10 01 64 00 11 00", "23 16 10 02 64 00 11 00"),),
    AbortCode.HARDWARE: (("23 10 10 01 73 61 76 65",), ("23 11 10 01 6C 6F 61 64",)),
    AbortCode.LENGTH_TOO_HIGH: (
        ("23 17 10 00 00 00 00 00",),
        ("21 17 10 00 04 00 00 00",),
        ("20 17 10 00 00 00 00 00", "01 01 02 03 04 05 06 07"),
    ),
    AbortCode.LENGTH_TOO_LOW: (
        ("2F 17 10 00 00 00 00 00",),
        ("21 7A 60 00 03 00 00 00",),
        ("20 7A 60 00 00 00 00 00", "0D 01 00 00 00 00 00 00"),
    ),
    AbortCode.INVALID_VALUE: (
        ("2F 03 10 00 01 00 00 00",),
        ("23 05 10 00 80 00 00 40",),
        ("2F 00 14 02 FA 00 00 00",),  # transmission type 250
        ("2F 19 10 00 01 00 00 00",),
    ),
    AbortCode.VALUE_TOO_HIGH: (("2F 29 10 01 03 00 00 00",), ("2B 5D 60 00 09 00 00 00",)),
    AbortCode.VALUE_TOO_LOW: (("2B 5D 60 00 00 00 00 00",),),
    AbortCode.NOT_STORED: (("23 10 10 01 6C 6F 61 64",), ("23 11 10 02 73 61 76 65",)),
    AbortCode.DEVICE_STATE: (
        ("2F 00 1A 00 00 00 00 00",),
        ("23 00 18 01 86 01 00 00",),
        ("2B 00 18 03 0A 00 00 00",),
        ("23 14 10 00 90 00 00 00",),
    ),
    AbortCode.NO_DATA: (("40 03 10 01 00 00 00 00",),),
}
"""Frames of a client by the code with which the last of them is refused; the others are accepted."""

NEVER = {
    AbortCode.UNSUPPORTED_ACCESS: "read-only and write-only say more exactly what is wrong",
    AbortCode.LENGTH: "too high and too low say more exactly what is wrong",
    AbortCode.INTERNAL_INCOMPATIBLE: "no object depends on the inside of the device",
    AbortCode.RESOURCE: "the default SDO is always there",
    AbortCode.GENERAL: "every cause has a code of its own",
    AbortCode.LOCAL_CONTROL: "the drive has no keypad",
    AbortCode.NO_DICTIONARY: "the dictionary is never generated while the drive runs",
}
ELSEWHERE = {
    AbortCode.TIME_OUT: "tests/emulator/canopen/test_sdo_block.py::test_a_transfer_that_the_client_leaves_times_out",
    AbortCode.MAX_LESS_THAN_MIN: "objects of CiA 402",
}


def bench() -> Bench:
    profile = load_profile("cia402-full")
    text = ObjectEntry(0x2F00, 0, "Text", DataType.VSTR, Access.RW, False, False, "", False, None, None)
    command = replace(text, index=0x2F01, name="Command", data_type=DataType.U8, access=Access.WO, default=0)
    return Bench(replace(profile, objects=(*profile.objects, text, command))).boot()


@pytest.mark.parametrize(
    ("code", "frames"),
    [pytest.param(code, frames, id=f"{code.name}-{place}") for code in CAUSES for place, frames in enumerate(CAUSES[code])],
)
def test_cause(code: AbortCode, frames: tuple[str, ...]) -> None:
    one = bench()
    for frame in frames[:-1]:
        one.device.receive(0x600 + NODE, bytes.fromhex(frame))
        assert all(data[0] != 0x80 for _, data in one.take())
    one.device.receive(0x600 + NODE, bytes.fromhex(frames[-1]))
    ((cob_id, answer),) = one.take()
    assert (cob_id, answer[0], int.from_bytes(answer[4:], "little")) == (0x580 + NODE, 0x80, code)


def test_every_code_has_its_cause_or_its_reason() -> None:
    assert {*CAUSES, *NEVER, *ELSEWHERE} == set(AbortCode)
    assert len(CAUSES) + len(NEVER) + len(ELSEWHERE) == len(AbortCode)
