"""Frames of the SDO protocol, bit by bit (CiA 301, 7.2.4.3)."""

from __future__ import annotations

import struct
from enum import IntEnum

from drivetwin.emulator.canopen.abort_codes import AbortCode
from drivetwin.foundation.enums import quick

FRAME_LENGTH = 8
SEGMENT_LENGTH = 7

# command specifiers of the client, bits 5..7 of the first byte
DOWNLOAD_SEGMENT = 0
DOWNLOAD_INITIATE = 1
UPLOAD_INITIATE = 2
UPLOAD_SEGMENT = 3
ABORT = 4
BLOCK_UPLOAD = 5
BLOCK_DOWNLOAD = 6

ABORT_COMMAND = 0x80
"""First byte of an abort, also among the segments of a block, whose sequence numbers begin with 1."""

TOGGLE = 0x10
LAST_SEGMENT = 0x01

BLOCK_CRC = 0x04
BLOCK_SIZE_INDICATED = 0x02
LAST_BLOCK_SEGMENT = 0x80


@quick
class BlockCommand(IntEnum):
    """First byte of the frames with which a client goes on in a block transfer; the end carries a count beside it."""

    UPLOAD_CONFIRM = 0xA1
    UPLOAD_ACKNOWLEDGE = 0xA2
    UPLOAD_START = 0xA3
    DOWNLOAD_END = 0xC1


_HEAD = struct.Struct("<BHBI")
_ADDRESS = struct.Struct("<HB")
_BYTES = tuple(bytes((number,)) for number in range(256))


def address(frame: bytes) -> tuple[int, int]:
    """Index and sub-index that a frame names (the multiplexer)."""
    index, subindex = _ADDRESS.unpack_from(frame, 1)
    return index, subindex


def abort_frame(index: int, subindex: int, code: AbortCode) -> bytes:
    """Abort SDO transfer."""
    return _HEAD.pack(0x80, index, subindex, code)


def download_initiated(index: int, subindex: int) -> bytes:
    """Initiate download response: an expedited download is done, a segmented one may begin."""
    return _HEAD.pack(0x60, index, subindex, 0)


def download_segment_taken(toggle: int) -> bytes:
    """Download segment response."""
    return bytes((0x20 | toggle, 0, 0, 0, 0, 0, 0, 0))


def expedited_command(length: int) -> int:
    """First byte of an upload response that carries one to four bytes."""
    return 0x43 | (4 - length) << 2


def upload_expedited(index: int, subindex: int, data: bytes) -> bytes:
    """Initiate upload response that carries one to four bytes."""
    return _HEAD.pack(expedited_command(len(data)), index, subindex, int.from_bytes(data, "little"))


def upload_initiated(index: int, subindex: int, length: int) -> bytes:
    """Initiate upload response that announces the number of bytes to come in segments."""
    return _HEAD.pack(0x41, index, subindex, length)


def upload_segment(toggle: int, data: bytes, last: int) -> bytes:
    """Upload segment response with up to seven bytes; `last` is LAST_SEGMENT or 0."""
    unused = SEGMENT_LENGTH - len(data)
    return bytes((toggle | unused << 1 | last,)) + data + bytes(unused)


def block_download_initiated(index: int, subindex: int, block_size: int, checked: int) -> bytes:
    """Initiate block download response: `block_size` segments a sub-block; `checked` is BLOCK_CRC or 0."""
    return _HEAD.pack(0xA0 | checked, index, subindex, block_size)


def block_download_acknowledged(sequence: int, block_size: int) -> bytes:
    """Block download response: the last segment that came in sequence, and the size of the next sub-block."""
    return bytes((0xA2, sequence, block_size, 0, 0, 0, 0, 0))


def block_download_ended() -> bytes:
    """End block download response."""
    return bytes((0xA1, 0, 0, 0, 0, 0, 0, 0))


def block_upload_initiated(index: int, subindex: int, length: int, checked: int) -> bytes:
    """Initiate block upload response: announces the number of bytes; `checked` is BLOCK_CRC or 0."""
    return _HEAD.pack(0xC0 | checked | BLOCK_SIZE_INDICATED, index, subindex, length)


def block_segment(head: int, data: bytes) -> bytes:
    """Segment of a block: sequence number and LAST_BLOCK_SEGMENT in its head, up to seven bytes of data."""
    return (_BYTES[head] + data).ljust(FRAME_LENGTH, b"\0")


def block_upload_ended(unused: int, crc: int) -> bytes:
    """End block upload: the bytes of the last segment that hold no data, and the CRC."""
    return struct.pack("<BH5x", 0xC1 | unused << 2, crc)
