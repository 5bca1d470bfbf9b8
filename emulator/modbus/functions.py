"""The functions on registers: 3, 4, 6, 16 and 23 (MODBUS Application Protocol V1.1b3, clauses 6.3 to 6.17).

Each takes a PDU and one drive's registers, and returns the PDU of the answer. Functions 3 and 4 see the same registers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from drivetwin.emulator.modbus.exception_codes import ExceptionCode, ModbusException
from drivetwin.emulator.modbus.registers import Registers

MOST_READ = 125
MOST_WRITTEN = 123
MOST_WRITTEN_WITH_READ = 121

_TWO = struct.Struct(">HH")
_WRITE = struct.Struct(">HHB")
_READ_WRITE = struct.Struct(">HHHHB")


def read_registers(pdu: bytes, registers: Registers) -> bytes:
    """3 'Read holding registers' and 4 'Read input registers' (6.3, 6.4)."""
    address, count = _unpack(_TWO, pdu, exact=True)
    _check(1 <= count <= MOST_READ)
    return _values(pdu[0], registers.read(address, count))


def write_single_register(pdu: bytes, registers: Registers) -> bytes:
    """6 'Write single register' (6.6); the answer is the request."""
    address, word = _unpack(_TWO, pdu, exact=True)
    registers.write(address, (word,))
    return pdu


def write_multiple_registers(pdu: bytes, registers: Registers) -> bytes:
    """16 'Write multiple registers' (6.12)."""
    address, count, _ = _unpack(_WRITE, pdu)
    words = _written(pdu[_WRITE.size :], count, MOST_WRITTEN)
    registers.write(address, words)
    return bytes((pdu[0],)) + _TWO.pack(address, count)


def read_write_multiple_registers(pdu: bytes, registers: Registers) -> bytes:
    """23 'Read/write multiple registers' (6.17): writes, then reads."""
    read_from, read_count, address, count, _ = _unpack(_READ_WRITE, pdu)
    _check(1 <= read_count <= MOST_READ)
    words = _written(pdu[_READ_WRITE.size :], count, MOST_WRITTEN_WITH_READ)
    registers.read(read_from, read_count)  # what cannot be read is refused before anything is written
    registers.write(address, words)
    return _values(pdu[0], registers.read(read_from, read_count))


FUNCTIONS: dict[int, Callable[[bytes, Registers], bytes]] = {
    3: read_registers,
    4: read_registers,
    6: write_single_register,
    16: write_multiple_registers,
    23: read_write_multiple_registers,
}

WRITING = frozenset((6, 16))
"""Functions that a broadcast may carry (MODBUS over Serial Line V1.02, clause 2.1)."""


def _unpack(fields: struct.Struct, pdu: bytes, exact: bool = False) -> tuple[int, ...]:
    given = len(pdu) - 1
    _check(given == fields.size if exact else given >= fields.size)
    return fields.unpack_from(pdu, 1)


def _written(data: bytes, count: int, most: int) -> Sequence[int]:
    """The words behind a byte count, which has to agree with the count of registers and with what came."""
    _check(1 <= count <= most and data[0] == 2 * count == len(data) - 1)
    return struct.unpack(f">{count}H", data[1:])


def _values(function: int, words: Sequence[int]) -> bytes:
    return struct.pack(f">BB{len(words)}H", function, 2 * len(words), *words)


def _check(right: bool) -> None:
    if not right:
        raise ModbusException(ExceptionCode.ILLEGAL_DATA_VALUE)
