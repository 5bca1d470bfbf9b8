"""Frames that no honest master sends: recorded ones spoiled, and ones out of thin air that are addressed well."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import can

from drivetwin.drive_profiles import DataType, DriveProfile, ObjectEntry
from drivetwin.emulator.canopen.data_types import size
from fuzzing.target import Event

NODES = (1, 2, 3)

INTERESTING = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 1000, 10_000)
"""Values at the edges of the types, and some that a parameter may have."""

FLOATS = ("00000000", "00000080", "0000807F", "000080FF", "0000C07F", "FFFF7F7F", "01000000", "0000803F", "CDCC4C3D")
"""REAL32: both zeros, both infinities, NaN, the largest, the smallest, 1, 0.05."""

CONTROLWORDS = (0x00, 0x02, 0x06, 0x07, 0x0B, 0x0F, 0x1F, 0x2F, 0x3F, 0x4F, 0x5F, 0x7F, 0x80, 0x8F, 0x10F, 0x11F, 0xFFFF)

INITIATIONS = (0x21, 0x20, 0xA0, 0xA4, 0xC2, 0xC6)
CONTINUATIONS = (0x00, 0x10, 0x01, 0x0D, 0x60, 0x70, 0xA3, 0xA2, 0xA1, 0xC1, 0x80)
"""First bytes of segmented and block transfers (CiA 301, 7.2.4.3)."""

_FAULTS = ("remote", "extended", "error", "fd")


class Mutation:
    """Draws events by `dice` for drives of a type, each with its kind, for the summary."""

    def __init__(self, profile: DriveProfile, dice: Random) -> None:
        self._dice = dice
        self._objects = profile.objects
        self._writable = [entry for entry in profile.objects if entry.access.writable and size(entry.data_type) is not None]
        self._random: tuple[tuple[str, int, Callable[[], Event]], ...] = (
            ("any identifier", 10, self._noise),
            ("a service, any data", 10, self._addressed),
            ("SDO download of an object", 22, self._download),
            ("SDO upload of an object", 8, self._upload),
            ("SDO, long transfers", 10, self._transfer),
            ("RPDO", 14, self._rpdo),
            ("NMT", 4, self._nmt),
            ("LSS", 5, self._lss),
            ("SYNC", 12, self._sync),
            ("time passes", 7, lambda: None),
        )
        self._weights = [weight for _, weight, _ in self._random]

    def random_event(self) -> tuple[str, Event]:
        """One out of thin air, with its kind."""
        (name, _, draw) = self._dice.choices(self._random, self._weights)[0]
        return name, draw()

    def mutated(self, message: can.Message) -> tuple[str, Event]:
        """A recorded frame spoiled in one way or more, with the way of the first."""
        dice = self._dice
        data, cob_id = bytearray(message.data), message.arbitration_id
        ways = ["bits", "byte", "shorter", "longer", "another identifier", "another node", "object", "value", *_FAULTS]
        first = dice.choice(ways)
        fault = ""
        for way in (first, *(dice.choice(ways[:6]) for _ in range(dice.choice((0, 0, 1, 2))))):
            if way in _FAULTS:
                fault = way
            elif way == "another identifier":
                cob_id = dice.choice((cob_id ^ 1 << dice.randrange(11), (cob_id + dice.choice((-0x80, 0x80))) % 0x800))
            elif way == "another node":
                cob_id = cob_id & 0x780 | dice.choice((0, *NODES, 127))
            else:
                self._spoil(way, data)
        return f"mutated: {first}", _message(cob_id, bytes(data), fault)

    def _spoil(self, way: str, data: bytearray) -> None:
        dice = self._dice
        if way == "longer":
            data += dice.randbytes(dice.randint(1, 8))
            del data[8:]
        elif not data:
            return
        elif way == "bits":
            data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
        elif way == "byte":
            data[dice.randrange(len(data))] = dice.choice((0x00, 0x7F, 0x80, 0xFF, dice.randrange(256)))
        elif way == "shorter":
            del data[dice.randrange(len(data)) :]
        elif way == "object" and len(data) == 8:
            data[1:4] = self._address(dice.choice(self._objects))
        elif way == "value" and len(data) >= 4:
            data[-4:] = dice.choice(INTERESTING).to_bytes(4, "little")

    # -- out of thin air ----------------------------------------------------------------------------------------------

    def _noise(self) -> Event:
        dice = self._dice
        fault = dice.choice(_FAULTS) if dice.random() < 0.3 else ""
        return _message(dice.randrange(0x800), dice.randbytes(dice.randint(0, 8)), fault)

    def _addressed(self) -> Event:
        dice = self._dice
        base = dice.choice((0x080, 0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x500, 0x580, 0x600, 0x600, 0x700))
        return _message(base + dice.choice(NODES), dice.randbytes(dice.choice((0, 1, 2, 4, 7, 8, 8, 8))), "")

    def _download(self) -> Event:
        dice = self._dice
        entry = dice.choice(self._writable)
        length = size(entry.data_type) or 0
        if length > 4:
            return self._upload()
        head = bytes((0x23 | (4 - length) << 2,)) + self._address(entry)
        return _message(0x600 + dice.choice(NODES), head + self._value(entry, length).ljust(4, b"\0"), "")

    def _value(self, entry: ObjectEntry, length: int) -> bytes:
        dice = self._dice
        if entry.index == 0x6040:
            return dice.choice(CONTROLWORDS).to_bytes(2, "little")
        if entry.data_type is DataType.R32 and dice.random() < 0.7:
            return bytes.fromhex(dice.choice(FLOATS))
        kind = dice.randrange(3)
        if kind == 0:
            return dice.randbytes(length)
        value = dice.choice(INTERESTING) if kind == 1 else dice.randrange(20)
        return (value & (1 << 8 * length) - 1).to_bytes(length, "little")

    def _upload(self) -> Event:
        dice = self._dice
        return _message(0x600 + dice.choice(NODES), b"\x40" + self._address(dice.choice(self._objects)) + bytes(4), "")

    def _transfer(self) -> Event:
        """Initiations and continuations of segmented and block transfers, in no order."""
        dice = self._dice
        command = dice.choice((*INITIATIONS, *CONTINUATIONS))
        if command in INITIATIONS:
            tail = bytes((dice.choice((0, 1, 4, 8, 127, 128)), *dice.choice(((0, 0, 0), (255, 255, 255)))))
            data = bytes((command,)) + self._address(dice.choice(self._objects)) + tail
        else:
            data = bytes((command, dice.choice((0, 1, 2, 127)), dice.choice((0, 1, 127)))) + dice.randbytes(5)
        return _message(0x600 + dice.choice(NODES), data, "")

    def _rpdo(self) -> Event:
        dice = self._dice
        setpoint = dice.choice((dice.randrange(-100_000, 100_000), dice.choice(INTERESTING)))
        data = dice.choice(CONTROLWORDS).to_bytes(2, "little") + (setpoint & 0xFFFF_FFFF).to_bytes(4, "little")
        data += dice.choice((b"\0\0", dice.randbytes(2)))
        return _message(dice.choice((0x200, 0x200, 0x300, 0x400, 0x500)) + dice.choice(NODES), data, "")

    def _nmt(self) -> Event:
        dice = self._dice
        command = dice.choice((0x01, 0x01, 0x01, 0x02, 0x80, 0x81, 0x82, dice.randrange(256)))
        data = bytes((command, dice.choice((0, *NODES, 200)))) + dice.choice((b"", b"", b"", b"\0", bytes(6)))
        return _message(0, data, dice.choice(("", "", "", *_FAULTS)))

    def _lss(self) -> Event:
        dice = self._dice
        command = dice.choice((0x04, 0x04, 0x11, 0x13, 0x17, *range(0x40, 0x44), *range(0x46, 0x4D), 0x51, 0x5A, 0x5E))
        return _message(0x7E5, bytes((command, dice.choice((0, 1, 2, 9, 255)))) + dice.randbytes(6), "")

    def _sync(self) -> Event:
        dice = self._dice
        return _message(0x80, dice.choice((b"", b"", b"", bytes((dice.randrange(256),)), dice.randbytes(8))), "")

    def _address(self, entry: ObjectEntry) -> bytes:
        return entry.index.to_bytes(2, "little") + bytes((entry.subindex,))


def _message(cob_id: int, data: bytes, fault: str) -> can.Message:
    remote = fault == "remote"
    return can.Message(
        arbitration_id=cob_id,
        data=None if remote else data,
        dlc=len(data),
        is_extended_id=fault == "extended",
        is_remote_frame=remote,
        is_error_frame=fault == "error",
        is_fd=fault == "fd",
    )
