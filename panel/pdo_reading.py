"""What a PDO of a drive carries: its mapping, read by SDO, and the values of a frame (CiA 301, 7.5.2.33 to 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivetwin.drive_profiles.profile import BITS, DataType
from drivetwin.foundation.errors import UserError
from drivetwin.panel.values import Value, decode

Address = tuple[int, int]
"""Index and subindex of an object."""

INVALID = 1 << 31
"""Bit of 14xxh:01 and 18xxh:01: the PDO does not exist."""

FIRST = (0x1800, 0x1400)
"""Communication parameters of TPDO 1 and RPDO 1; the mapping stands 200h above."""

MOST_PDOS = 4
"""PDOs of each direction that are looked at."""


@dataclass(frozen=True)
class Field:
    """An object in a PDO: where it stands among the frame's bytes."""

    address: Address
    data_type: DataType
    start: int
    end: int


@dataclass(frozen=True)
class Pdo:
    """A PDO that exists: its COB-ID, and what it carries."""

    cob_id: int
    transmits: bool
    fields: tuple[Field, ...]

    def values(self, data: bytes) -> list[tuple[Address, Value]]:
        """The objects of a frame; those that it is too short for are left out."""
        told = ((field.address, decode(field.data_type, data[field.start : field.end])) for field in self.fields)
        return [(address, value) for address, value in told if value is not None]


def read_pdos(read: Callable[[int, int], bytes], types: Mapping[Address, DataType]) -> dict[int, Pdo]:
    """The PDOs of a drive by COB-ID; `types` are its objects. A PDO that the drive does not have is passed over."""
    found = (_read(read, types, first + number, first == FIRST[0]) for first in FIRST for number in range(MOST_PDOS))
    return {pdo.cob_id: pdo for pdo in found if pdo is not None}


def _read(read: Callable[[int, int], bytes], types: Mapping[Address, DataType], index: int, transmits: bool) -> Pdo | None:
    if (index, 1) not in types:
        return None
    try:
        cob_id = int.from_bytes(read(index, 1), "little")
        if cob_id & INVALID:
            return None
        mapped = [read(index + 0x200, entry + 1) for entry in range(read(index + 0x200, 0)[0])]
    except UserError:
        return None
    return Pdo(cob_id & 0x7FF, transmits, _fields(mapped, types))


def _fields(mapped: list[bytes], types: Mapping[Address, DataType]) -> tuple[Field, ...]:
    """Whole bytes only; an object of no known type is passed over, with its bytes."""
    fields, start = [], 0
    for entry in mapped:
        bits, subindex, index = entry[0], entry[1], int.from_bytes(entry[2:4], "little")
        data_type = types.get((index, subindex))
        if data_type is not None and BITS.get(data_type) == bits:
            fields.append(Field((index, subindex), data_type, start // 8, (start + bits) // 8))
        start += bits
    return tuple(fields)
