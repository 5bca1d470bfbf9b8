"""Why an SDO transfer was refused, so that a master can say it: abort codes of CiA 301, 7.2.4.3.17 (table 22)."""

from __future__ import annotations

from enum import IntEnum


class AbortCode(IntEnum):
    """SDO abort codes with the standard's text."""

    text: str

    def __new__(cls, code: int, text: str) -> AbortCode:
        """A member is its number; the text rides along."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member

    TOGGLE_BIT = 0x05030000, "Toggle bit not alternated"
    TIME_OUT = 0x05040000, "SDO protocol timed out"
    COMMAND_SPECIFIER = 0x05040001, "Client/server command specifier not valid or unknown"
    BLOCK_SIZE = 0x05040002, "Invalid block size (block mode only)"
    SEQUENCE_NUMBER = 0x05040003, "Invalid sequence number (block mode only)"
    CRC = 0x05040004, "CRC error (block mode only)"
    OUT_OF_MEMORY = 0x05040005, "Out of memory"
    UNSUPPORTED_ACCESS = 0x06010000, "Unsupported access to an object"
    WRITE_ONLY = 0x06010001, "Attempt to read a write only object"
    READ_ONLY = 0x06010002, "Attempt to write a read only object"
    NO_SUCH_OBJECT = 0x06020000, "Object does not exist in the object dictionary"
    NOT_MAPPABLE = 0x06040041, "Object cannot be mapped to the PDO"
    PDO_LENGTH = 0x06040042, "The number and length of the objects to be mapped would exceed PDO length"
    PARAMETER_INCOMPATIBLE = 0x06040043, "General parameter incompatibility reason"
    INTERNAL_INCOMPATIBLE = 0x06040047, "General internal incompatibility in the device"
    HARDWARE = 0x06060000, "Access failed due to a hardware error"
    LENGTH = 0x06070010, "Data type does not match, length of service parameter does not match"
    LENGTH_TOO_HIGH = 0x06070012, "Data type does not match, length of service parameter too high"
    LENGTH_TOO_LOW = 0x06070013, "Data type does not match, length of service parameter too low"
    NO_SUCH_SUBINDEX = 0x06090011, "Sub-index does not exist"
    INVALID_VALUE = 0x06090030, "Invalid value for parameter (download only)"
    VALUE_TOO_HIGH = 0x06090031, "Value of parameter written too high (download only)"
    VALUE_TOO_LOW = 0x06090032, "Value of parameter written too low (download only)"
    MAX_LESS_THAN_MIN = 0x06090036, "Maximum value is less than minimum value"
    RESOURCE = 0x060A0023, "Resource not available: SDO connection"
    GENERAL = 0x08000000, "General error"
    NOT_STORED = 0x08000020, "Data cannot be transferred or stored to the application"
    LOCAL_CONTROL = 0x08000021, "Data cannot be transferred or stored to the application because of local control"
    DEVICE_STATE = 0x08000022, "Data cannot be transferred or stored because of the present device state"
    NO_DICTIONARY = 0x08000023, "Object dictionary dynamic generation fails or no object dictionary is present"
    NO_DATA = 0x08000024, "No data available"


class SdoAbort(Exception):  # noqa: N818  # the standard's name
    """Raised by an object that refuses an access; the SDO server answers with the code."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(f"{code:08X}h {code.text}")
        self.code = code
