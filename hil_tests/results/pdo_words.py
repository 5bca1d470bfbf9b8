"""The content of a PDO in words, by the bench's mapping and the data types of the drive type's objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin.drive_profiles import DataType
from drivetwin.emulator.canopen.data_types import Value, decode, size
from drivetwin.hil_tests.bench import Bench

_BIT_FIELDS = frozenset({DataType.BOOL, DataType.U8, DataType.U16, DataType.U32})
"""Shown in hexadecimal, as statusword and controlword are read."""
_TYPELESS = {1: DataType.U8, 2: DataType.U16, 4: DataType.U32}


@dataclass(frozen=True)
class MappedObject:
    """An object of a PDO."""

    index: int
    subindex: int
    data_type: DataType

    @property
    def length(self) -> int:
        """[byte]"""
        return size(self.data_type) or 0

    def said(self, data: bytes) -> str:
        """`60C1h:01 = -3200`."""
        name = f"{self.index:04X}h:{self.subindex:02X}" if self.subindex else f"{self.index:04X}h"
        return f"{name} = {_shown(decode(self.data_type, data), self)}"


PdoMapping = Mapping[str, tuple[MappedObject, ...]]
"""By the service's name, `RPDO 1`."""


def ordered_pdos(bench: Bench) -> PdoMapping:
    """The PDOs of a bench whose objects are whole bytes."""
    types = {(entry.index, entry.subindex): entry.data_type for entry in bench.drive_type.objects}
    found = {}
    for name, pdo in bench.pdo.items():
        objects = [_mapped(entry, types) for entry in pdo.entries]
        if all(each is not None for each in objects):
            found[name.upper()] = tuple(each for each in objects if each is not None)
    return found


def _mapped(entry: int, types: Mapping[tuple[int, int], DataType]) -> MappedObject | None:
    """Of an entry of 1600h or 1A00h; None where the object is not of the length that is ordered."""
    index, subindex, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
    data_type = types.get((index, subindex), _TYPELESS.get(bits // 8, DataType.DOMAIN))
    length = size(data_type)
    return MappedObject(index, subindex, data_type) if length is not None and 8 * length == bits else None


def pdo_words(objects: tuple[MappedObject, ...], data: bytes) -> str:
    """`6040h = 001Fh, 60C1h:01 = -3200`; a PDO of another length than is mapped says so."""
    mapped = sum(each.length for each in objects)
    if mapped != len(data):
        return f"{len(data)} bytes, {mapped} are ordered"
    said, at = [], 0
    for each in objects:
        said.append(each.said(data[at : at + each.length]))
        at += each.length
    return ", ".join(said)


def _shown(value: Value, of: MappedObject) -> str:
    if of.data_type in _BIT_FIELDS:
        return f"{int(value):0{2 * of.length}X}h"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
