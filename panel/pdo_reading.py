"""What a PDO of a drive carries: its mapping, read by SDO, and the values of a frame (CiA 301, 7.5.2.33 to 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.drive_profiles.profile import BITS, FLOATS, SIGNED, DataType
from drivetwin.panel.door import ObjectRefusedError
from drivetwin.panel.frames import Places
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

    def column(self, lengths: NDArray[np.uint8], data: NDArray[np.uint8]) -> tuple[Places, NDArray[np.generic]]:
        """Its values (m,) in frames of `lengths` (n,) and `data` (n, 8), and in which (m,).

        Those that are too short, and what is no finite number, are left out.
        """
        there = np.flatnonzero(lengths >= self.end)
        values = _numbers(self.data_type, np.ascontiguousarray(data[there, self.start : self.end]))
        if self.data_type in FLOATS:
            finite = np.isfinite(values)
            return there[finite], values[finite]
        return there, values


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


def _numbers(data_type: DataType, raw: NDArray[np.uint8]) -> NDArray[Any]:
    """Little-endian numbers (n,) of their bytes (n, size)."""
    kind = "f" if data_type in FLOATS else "i" if data_type in SIGNED else "u"
    rows, size = raw.shape
    if size in (1, 2, 4, 8):
        return raw.view(f"<{kind}{size}")[:, 0]
    wide = np.zeros((rows, 8), np.uint8)
    wide[:, 8 - size :] = raw  # in the upper bytes: the shift back brings the sign
    return np.asarray(wide.view(f"<{kind}8")[:, 0] >> 8 * (8 - size))


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
    except ObjectRefusedError:
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
