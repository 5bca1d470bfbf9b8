"""A drive type's Modbus registers as data: drive_profiles/<name>/modbus.yaml maps addresses to objects.

What an object is (type, access, limits) stays in objects.csv; this file only gives it an address.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from pydantic import Field

from drivetwin.drive_profiles.profile import DataType, ObjectEntry, load_profile_from, profile_folders
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed

REGISTERS: dict[DataType, int] = {
    DataType.BOOL: 1,
    DataType.I8: 1,
    DataType.U8: 1,
    DataType.I16: 1,
    DataType.U16: 1,
    DataType.I32: 2,
    DataType.U32: 2,
    DataType.R32: 2,
    DataType.I64: 4,
    DataType.U64: 4,
}
"""Registers of 16 bits that a value takes; other types have no fixed length and go by the gateway (function 43) only."""

LAST_ADDRESS = 0xFFFF


@dataclass(frozen=True)
class Register:
    """An object at `address` (as it stands in the request, from 0) and the `count - 1` registers after it."""

    address: int
    count: int
    entry: ObjectEntry


@dataclass(frozen=True)
class ModbusMap:
    """The registers of a drive type by address, and which objects beside CiA 402's set-points only one master may write."""

    registers: tuple[Register, ...] = ()
    arbitrated: tuple[tuple[int, int], ...] = ()


def load_modbus_map(name: str) -> ModbusMap:
    """The map of the drive type of that name; an empty one (gateway only) where there is none.

    Raises UserError naming the file and what is wrong with which register.
    """
    folder = profile_folders().get(name)
    return ModbusMap() if folder is None else load_modbus_map_from(folder)


@cache
def load_modbus_map_from(folder: Path) -> ModbusMap:
    """The map of the drive type that `folder` describes. Raises UserError as `load_modbus_map`."""
    path = folder / "modbus.yaml"
    if not path.is_file():
        return ModbusMap()
    data = typed(_Map, read_yaml(path), path)
    objects = {(entry.index, entry.subindex): entry for entry in load_profile_from(folder).objects}
    registers: list[Register] = []
    for given in sorted(data.registers, key=lambda row: row.address):
        register = _register(path, given, objects)
        if registers and register.address < registers[-1].address + registers[-1].count:
            raise UserError(f"{path}: {given.object} at {given.address:04X}h stands on {_name(registers[-1].entry)}")
        registers.append(register)
    arbitrated = tuple(_address(text) for text in data.arbitrated)
    for text, address in zip(data.arbitrated, arbitrated, strict=True):
        if address not in objects:
            raise UserError(f"{path}: arbitrated: objects.csv has no {text}")
    return ModbusMap(tuple(registers), arbitrated)


_OBJECT = r"^[0-9A-F]{4}(:[0-9A-F]{2})?$"


class _Register(Strict):
    address: int = Field(ge=0, le=LAST_ADDRESS)
    object: str = Field(pattern=_OBJECT)


class _Map(Strict):
    registers: list[_Register]
    arbitrated: list[str] = Field(default_factory=list)


def _register(path: Path, given: _Register, objects: dict[tuple[int, int], ObjectEntry]) -> Register:
    entry = objects.get(_address(given.object))
    if entry is None:
        raise UserError(f"{path}: register {given.address:04X}h: objects.csv has no {given.object}")
    count = REGISTERS.get(entry.data_type)
    if count is None:
        raise UserError(f"{path}: register {given.address:04X}h: {given.object} is {entry.data_type.name}, of no fixed length")
    if given.address + count - 1 > LAST_ADDRESS:
        raise UserError(f"{path}: register {given.address:04X}h: {given.object} reaches beyond {LAST_ADDRESS:04X}h")
    return Register(given.address, count, entry)


def _address(text: str) -> tuple[int, int]:
    index, _, subindex = text.partition(":")
    return int(index, 16), int(subindex or "0", 16)


def _name(entry: ObjectEntry) -> str:
    return f"{entry.index:04X}:{entry.subindex:02X}"
