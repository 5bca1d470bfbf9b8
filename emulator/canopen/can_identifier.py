"""Which CAN identifiers a master may give to a PDO, SYNC or EMCY: restricted CAN-IDs of CiA 301, 7.3.5 (table 40)."""

from __future__ import annotations

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort

INVALID = 1 << 31
"""Bit 31 of the COB-ID of a PDO or EMCY: the object does not exist, it is neither sent nor received."""

BIT_30 = 1 << 30
"""Bit 30: of a TPDO 'no RTR allowed', of SYNC 'the device generates it'."""

CAN_ID = 0x7FF
"""The identifier itself, base frame format."""

_NOT_BASE_FRAME = 0x3FFFF800

_RESTRICTED = (
    range(0x000, 0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)


def exists(cob_id: int) -> bool:
    """Whether the object of a COB-ID parameter exists (bit 31 is 0)."""
    return not cob_id & INVALID


def check_cob_id(cob_id: int) -> None:
    """Raise SdoAbort for an extended frame, or for the CAN-ID of another service."""
    if cob_id & _NOT_BASE_FRAME or any(cob_id & CAN_ID in restricted for restricted in _RESTRICTED):
        raise SdoAbort(AbortCode.INVALID_VALUE)


def check_change(old: int, new: int) -> None:
    """Raise SdoAbort where the CAN-ID would change under an object that exists and goes on existing."""
    if exists(old) and exists(new) and (old ^ new) & CAN_ID:
        raise SdoAbort(AbortCode.DEVICE_STATE)
