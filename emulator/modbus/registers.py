"""One drive's objects as 16-bit registers. A 32-bit value is two of them, high word first; within a word high byte first.

Addresses are those of the request, from 0 (MODBUS Application Protocol V1.1b3, clause 4.4).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivetwin.drive_profiles import DataType
from drivetwin.drive_profiles.modbus_map import REGISTERS, ModbusMap
from drivetwin.emulator.canopen.abort_codes import SdoAbort
from drivetwin.emulator.canopen.data_types import FORMATS, Value, saturate
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.modbus.exception_codes import ExceptionCode, ModbusException, of_abort

_WIDENED = {DataType.BOOL: "H", DataType.U8: "H", DataType.I8: "h"}
"""Values of less than 16 bits take a whole register, with their sign."""

_STRUCTS = {data_type: struct.Struct(">" + _WIDENED.get(data_type, code)) for data_type, code in FORMATS.items()}


@dataclass(frozen=True)
class _Slot:
    address: int
    count: int
    variable: Variable


class Registers:
    """The registers of one drive. `permit` is asked before anything is written and may raise SdoAbort.

    A drive with objects of its own (from an EDS) leaves those addresses empty whose object it lacks or has in another size.
    """

    def __init__(
        self, mapped: ModbusMap, dictionary: ObjectDictionary, permit: Callable[[Variable, Value], None]
    ) -> None:
        self._permit = permit
        self._slots: dict[int, _Slot] = {}
        for register in mapped.registers:
            key = register.entry.index, register.entry.subindex
            if key not in dictionary or REGISTERS.get(dictionary[key].data_type) != register.count:
                continue
            slot = _Slot(register.address, register.count, dictionary[key])
            self._slots.update(dict.fromkeys(range(slot.address, slot.address + slot.count), slot))

    def read(self, address: int, count: int) -> list[int]:
        """Values of `count` registers, all of one instant. Raises ModbusException 02 where one of them is not mapped."""
        words: list[int] = []
        at = address
        while at < address + count:
            slot = self._slot(at)
            if not slot.variable.access.readable:
                raise ModbusException(ExceptionCode.ILLEGAL_DATA_ADDRESS)
            last = min(slot.address + slot.count, address + count)
            words += _words(slot.variable)[at - slot.address : last - slot.address]
            at = last
        return words

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write registers: every object whole, all of them or none, commands (the controlword) last.

        Raises ModbusException 02 where a register is not mapped, is read-only, or where half an object would be written;
        03, 04 or 06 where an object refuses. Nothing is written then, unless an object refuses for the drive's state only
        at its own turn.
        """
        writes = self._writes(address, words)
        try:
            for variable, value in writes:
                variable.check(value)
                self._permit(variable, value)
            for variable, value in sorted(writes, key=lambda write: write[0].is_command):
                variable.write(value)
        except SdoAbort as refusal:
            raise ModbusException(of_abort(refusal.code)) from refusal

    def _writes(self, address: int, words: Sequence[int]) -> list[tuple[Variable, Value]]:
        writes: list[tuple[Variable, Value]] = []
        at, end = address, address + len(words)
        while at < end:
            slot = self._slot(at)
            whole = slot.address == at and at + slot.count <= end
            if not whole or not slot.variable.access.writable:
                raise ModbusException(ExceptionCode.ILLEGAL_DATA_ADDRESS)
            writes.append((slot.variable, _value(slot.variable, words[at - address : at - address + slot.count])))
            at += slot.count
        return writes

    def _slot(self, address: int) -> _Slot:
        slot = self._slots.get(address)
        if slot is None:
            raise ModbusException(ExceptionCode.ILLEGAL_DATA_ADDRESS)
        return slot


def _words(variable: Variable) -> tuple[int, ...]:
    data = _STRUCTS[variable.data_type].pack(saturate(variable.data_type, variable.read()))
    return struct.unpack(f">{len(data) // 2}H", data)


def _value(variable: Variable, words: Sequence[int]) -> Value:
    value: Value = _STRUCTS[variable.data_type].unpack(struct.pack(f">{len(words)}H", *words))[0]
    return value
