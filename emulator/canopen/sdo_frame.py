"""Frames of the SDO protocol, bit by bit (CiA 301, 7.2.4.3)."""

from __future__ import annotations

import struct

from emulator.canopen.abort_codes import AbortCode

FRAME_LENGTH = 8
SEGMENT_LENGTH = 7

# command specifiers of the client, bits 5..7 of the first byte
DOWNLOAD_SEGMENT = 0
DOWNLOAD_INITIATE = 1
UPLOAD_INITIATE = 2
UPLOAD_SEGMENT = 3
ABORT = 4

TOGGLE = 0x10
LAST_SEGMENT = 0x01

_HEAD = struct.Struct("<BHBI")
_ADDRESS = struct.Struct("<HB")


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


def upload_expedited(index: int, subindex: int, data: bytes) -> bytes:
    """Initiate upload response that carries one to four bytes."""
    return _HEAD.pack(0x43 | (4 - len(data)) << 2, index, subindex, int.from_bytes(data, "little"))


def upload_initiated(index: int, subindex: int, length: int) -> bytes:
    """Initiate upload response that announces the number of bytes to come in segments."""
    return _HEAD.pack(0x41, index, subindex, length)


def upload_segment(toggle: int, data: bytes, last: int) -> bytes:
    """Upload segment response with up to seven bytes; `last` is LAST_SEGMENT or 0."""
    unused = SEGMENT_LENGTH - len(data)
    return bytes((toggle | unused << 1 | last,)) + data + bytes(unused)
