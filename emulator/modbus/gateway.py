"""SDO services inside Modbus: function 43, MEI type 13, 'CANopen general reference' (CiA 309-2, clause 5).

    request  2B 0D | options (2) | node-ID | index (2) | sub-index | starting address (2) | number of bytes (2) | data
    response the same, with the bytes that were read; after a write their number is 0
    refused  AB FF | 00 06 | 0D CE | SDO abort code (4)

The first option byte is 0 to read and 1 to write. Fields of the protocol have the high byte first, the data are those of
an SDO: low byte first (CiA 301, 7.1.4). Starting address and number of bytes let a long value be read in parts.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.modbus.exception_codes import EXCEPTION_BIT, ExceptionCode, ModbusException

FUNCTION = 0x2B
MEI_TYPE = 0x0D
CANOPEN_EXCEPTION = 0xCE
"""MEI-specific exception code that says: an SDO abort code follows."""

READ, WRITE = 0, 1

_HEAD = struct.Struct(">BBBBBHBHH")
_REFUSED = struct.Struct(">BBHBBI")

MOST_DATA = 253 - _HEAD.size
"""Bytes of data that fit a Modbus PDU (V1.1b3, clause 4.1)."""


@dataclass(frozen=True)
class Telegram:
    """A request or a response, without what every one has (function code and MEI type)."""

    access: int
    reserved: int
    node_id: int
    index: int
    subindex: int
    start: int
    count: int
    data: bytes = b""

    def encode(self) -> bytes:
        """The PDU."""
        head = (self.access, self.reserved, self.node_id, self.index, self.subindex, self.start, self.count)
        return _HEAD.pack(FUNCTION, MEI_TYPE, *head) + self.data


def decode(pdu: bytes) -> Telegram:
    """The telegram of a PDU of function 43. Raises ModbusException 01 for another MEI type, 03 for a wrong length."""
    if len(pdu) > 1 and pdu[1] != MEI_TYPE:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
    if len(pdu) < _HEAD.size:
        raise ModbusException(ExceptionCode.ILLEGAL_DATA_VALUE)
    _, _, access, reserved, node_id, index, subindex, start, count = _HEAD.unpack_from(pdu)
    telegram = Telegram(access, reserved, node_id, index, subindex, start, count, pdu[_HEAD.size :])
    expected = telegram.count if telegram.access == WRITE else 0
    if telegram.access not in (READ, WRITE) or len(telegram.data) != expected:
        raise ModbusException(ExceptionCode.ILLEGAL_DATA_VALUE)
    return telegram


def answer(request: Telegram, dictionary: ObjectDictionary) -> bytes:
    """Do what a telegram asks of a drive's dictionary; the PDU of the response, which may be a refusal."""
    try:
        serve = _write if request.access == WRITE else _read
        return serve(request, dictionary).encode()
    except SdoAbort as refusal:
        return _REFUSED.pack(FUNCTION | EXCEPTION_BIT, ExceptionCode.EXTENDED, 6, MEI_TYPE, CANOPEN_EXCEPTION, refusal.code)


def _read(request: Telegram, dictionary: ObjectDictionary) -> Telegram:
    """As many bytes as were asked for (0: all) from the starting address on, or as there are."""
    variable = dictionary.find(request.index, request.subindex)
    if not variable.access.readable:
        raise SdoAbort(AbortCode.WRITE_ONLY)
    data = variable.encode()
    if request.start > len(data):
        raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
    most = min(request.count or MOST_DATA, MOST_DATA)
    part = data[request.start : request.start + most]
    return replace(request, count=len(part), data=part)


def _write(request: Telegram, dictionary: ObjectDictionary) -> Telegram:
    """A value is written whole: a starting address other than 0 is refused."""
    variable = dictionary.find(request.index, request.subindex)
    if not variable.access.writable:
        raise SdoAbort(AbortCode.READ_ONLY)
    if request.start != 0:
        raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)
    variable.decode_and_write(request.data)
    return replace(request, count=0, data=b"")
