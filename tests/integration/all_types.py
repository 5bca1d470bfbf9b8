"""An EDS with an object of every data type of a fixed length (CiA 301, table 44), a text, a DOMAIN, and what they may hold."""

from __future__ import annotations

import random
from pathlib import Path

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_writer import eds_text

INTEGERS = {
    0x02: (8, True), 0x03: (16, True), 0x10: (24, True), 0x04: (32, True),
    0x12: (40, True), 0x13: (48, True), 0x14: (56, True), 0x15: (64, True),
    0x05: (8, False), 0x06: (16, False), 0x16: (24, False), 0x07: (32, False),
    0x18: (40, False), 0x19: (48, False), 0x1A: (56, False), 0x1B: (64, False),
}  # fmt: skip
"""Length in bits and sign by the type's code."""

REALS = {0x08: "<f", 0x11: "<d"}
TIMES = {0x0C: "TIME_OF_DAY", 0x0D: "TIME_DIFFERENCE"}
TEXT, DOMAIN = 0x09, 0x0F
ALL = (*INTEGERS, *REALS, *TIMES, TEXT, DOMAIN)
VALUE = "DefaultValue={}\nPDOMapping=1\n"
"""What npm's `canopen` takes of no DOMAIN."""

FIRST = 0x2F00
"""The object of a type is FIRST plus the type's code."""

LARGE = random.Random(1).randbytes(1_100_000)
"""More than a megabyte, for a DOMAIN."""

MINUTES = 1200.0
"""Longest that a client may take for it [s]: 157,143 segments; no test asserts on how long it took."""

SEVEN_O_CLOCK = bytes.fromhex("40 87 80 01 39 3A")
"""A time: 25,200,448 ms after midnight, 14,905 days."""


def least_and_most(code: int) -> tuple[int, int]:
    """The ends of an integer type."""
    bits, signed = INTEGERS[code]
    return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if signed else (0, (1 << bits) - 1)


def write_eds(path: Path) -> Path:
    """cia402-full with those objects; integers hold 1 at power-on."""
    sections = [
        f"[{FIRST + code:04X}]\nParameterName=Object {code:02X}\nObjectType=0x{2 if code == DOMAIN else 7}\n"
        f"DataType=0x{code:04X}\nAccessType=rw\n" + ("" if code == DOMAIN else VALUE.format(1 if code in INTEGERS else ""))
        for code in ALL
    ]
    text = eds_text(load_profile("cia402-full"), path.name)
    head, listed, rest = text.partition("[ManufacturerObjects]\n")
    counted, _, rest = rest.partition("\n\n")
    entries = counted.splitlines()[1:] + [f"=0x{FIRST + code:04X}" for code in ALL]
    numbered = [f"{number}={entry.partition('=')[2]}" for number, entry in enumerate(entries, 1)]
    listing = "\n".join((f"SupportedObjects={len(numbered)}", *numbered))
    path.write_text(f"{head}{listed}{listing}\n\n{rest}" + "\n".join(sections), encoding="utf-8")
    return path
