"""Why a Modbus request was refused: exception codes (MODBUS Application Protocol V1.1b3, clause 7)."""

from __future__ import annotations

from enum import IntEnum

from drivetwin.emulator.canopen.abort_codes import AbortCode

EXCEPTION_BIT = 0x80
"""Set in the function code of a refusal (clause 4.1)."""


class ExceptionCode(IntEnum):
    """Exception codes that a drive or its gateway answers with."""

    ILLEGAL_FUNCTION = 0x01
    ILLEGAL_DATA_ADDRESS = 0x02
    ILLEGAL_DATA_VALUE = 0x03
    SERVER_DEVICE_FAILURE = 0x04
    SERVER_DEVICE_BUSY = 0x06
    GATEWAY_TARGET_DEVICE_FAILED_TO_RESPOND = 0x0B
    EXTENDED = 0xFF


class ModbusException(Exception):  # noqa: N818  # the standard's name
    """Raised by what refuses a request; the answer carries the code."""

    def __init__(self, code: ExceptionCode) -> None:
        super().__init__(f"{code:02X}h {code.name}")
        self.code = code


def refusal(function: int, code: ExceptionCode) -> bytes:
    """The exception response (clause 7)."""
    return bytes((function | EXCEPTION_BIT, code))


_ADDRESS = (AbortCode.READ_ONLY, AbortCode.WRITE_ONLY, AbortCode.NO_SUCH_OBJECT, AbortCode.NO_SUCH_SUBINDEX)
_VALUE = (
    AbortCode.INVALID_VALUE,
    AbortCode.VALUE_TOO_HIGH,
    AbortCode.VALUE_TOO_LOW,
    AbortCode.MAX_LESS_THAN_MIN,
    AbortCode.PARAMETER_INCOMPATIBLE,
    AbortCode.LENGTH,
    AbortCode.LENGTH_TOO_HIGH,
    AbortCode.LENGTH_TOO_LOW,
)


def of_abort(code: AbortCode) -> ExceptionCode:
    """What an SDO abort is on registers: 02 the address, 03 the value, 06 another master has control, 04 any other."""
    if code is AbortCode.LOCAL_CONTROL:
        return ExceptionCode.SERVER_DEVICE_BUSY
    if code in _ADDRESS:
        return ExceptionCode.ILLEGAL_DATA_ADDRESS
    return ExceptionCode.ILLEGAL_DATA_VALUE if code in _VALUE else ExceptionCode.SERVER_DEVICE_FAILURE
