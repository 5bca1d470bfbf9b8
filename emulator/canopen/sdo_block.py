"""Large values in blocks of up to 127 segments, with one answer a block and a CRC (CiA 301, 7.2.4.3.9ff).

What the receiver of a sub-block missed is sent again: it acknowledges the last segment that came in sequence, and the
sender goes on behind it, counting from 1. The server says that it has a CRC to a client that has one: some clients look
at the server's bit alone.
"""

from __future__ import annotations

from binascii import crc_hqx
from enum import Enum, auto

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.object_dictionary import Variable, check_length
from drivetwin.emulator.canopen.sdo_frame import (
    BLOCK_CRC,
    BLOCK_SIZE_INDICATED,
    LAST_BLOCK_SEGMENT,
    SEGMENT_LENGTH,
    BlockCommand,
    block_download_acknowledged,
    block_download_ended,
    block_download_initiated,
    block_segment,
    block_upload_ended,
    block_upload_initiated,
)
from drivetwin.emulator.canopen.sdo_segmented import check_announced, room
from drivetwin.foundation.enums import quick

BLOCK_SIZE = 127
"""Segments of a sub-block that the server takes, the most that the protocol has."""

_SEQUENCE = 0x7F


def crc(data: bytes) -> int:
    """CRC of a block transfer: x^16 + x^12 + x^5 + 1, initial value 0 (CiA 301, 7.2.4.3.9ff)."""
    return crc_hqx(data, 0)


@quick
class _Phase(Enum):
    START = auto()
    SEGMENTS = auto()
    END = auto()
    CONFIRM = auto()


class BlockDownload:
    """A value that comes in blocks; it is written when its end and its CRC are right."""

    def __init__(self, variable: Variable, frame: bytes) -> None:
        indicated = int.from_bytes(frame[4:8], "little") if frame[0] & BLOCK_SIZE_INDICATED else None
        check_announced(variable, indicated)
        self.index = variable.index
        self.subindex = variable.subindex
        self.finished = False
        self._variable = variable
        self._indicated = indicated
        self._checked = bool(frame[0] & BLOCK_CRC)
        self._data = bytearray()
        told = indicated if indicated is not None else variable.size
        self._most = room(variable) if told is None else min(told, room(variable))
        self._in_sequence = 0
        self._phase = _Phase.SEGMENTS

    def initiated(self) -> bytes:
        """The answer to the request that opened the transfer."""
        return block_download_initiated(self.index, self.subindex, BLOCK_SIZE, BLOCK_CRC if self._checked else 0)

    def expects(self, frame: bytes) -> bool:
        """Any frame while segments come (their first byte is a sequence number); else the end of the transfer."""
        return self._phase is _Phase.SEGMENTS or frame[0] & 0xE3 == BlockCommand.DOWNLOAD_END

    def receive(self, frame: bytes) -> tuple[bytes, ...]:
        """Take a segment, or the end."""
        return self._segment(frame) if self._phase is _Phase.SEGMENTS else self._end(frame)

    def _segment(self, frame: bytes) -> tuple[bytes, ...]:
        head = frame[0]
        number = head & _SEQUENCE
        if number == 0:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        taken = number == self._in_sequence + 1
        if taken:
            self._in_sequence = number
            self._data += frame[1:]
            if len(self._data) >= self._most + SEGMENT_LENGTH:
                raise self._too_long()
        if head == number < BLOCK_SIZE:
            return ()
        acknowledged, self._in_sequence = self._in_sequence, 0
        if taken and head != number:
            self._phase = _Phase.END
        return (block_download_acknowledged(acknowledged, BLOCK_SIZE),)

    def _too_long(self) -> SdoAbort:
        """More than was announced or the type has, or more than there is room for."""
        told = self._indicated if self._indicated is not None else self._variable.size
        longer = told is not None and len(self._data) >= told + SEGMENT_LENGTH
        return SdoAbort(AbortCode.LENGTH_TOO_HIGH if longer else AbortCode.OUT_OF_MEMORY)

    def _end(self, frame: bytes) -> tuple[bytes, ...]:
        unused = frame[0] >> 2 & 0x07
        data = bytes(self._data[: len(self._data) - unused])
        if self._checked and crc(data) != int.from_bytes(frame[1:3], "little"):
            raise SdoAbort(AbortCode.CRC)
        if self._indicated is not None:
            check_length(len(data), self._indicated)
        self._variable.decode_and_write(data)
        self.finished = True
        return (block_download_ended(),)


class BlockUpload:
    """A value that goes out in blocks, as it was when the upload began."""

    def __init__(self, variable: Variable, data: bytes, frame: bytes) -> None:
        self.index = variable.index
        self.subindex = variable.subindex
        self.finished = False
        self._data = data
        self._segments = max(1, -(-len(data) // SEGMENT_LENGTH))
        """Of the whole value; one, unused, where there is nothing to tell."""
        self._checked = frame[0] & BLOCK_CRC
        self._block_size = _checked_block_size(frame[4])
        self._at = 0
        self._sent = 0
        self._phase = _Phase.START

    def initiated(self) -> bytes:
        """The answer to the request that opened the transfer."""
        return block_upload_initiated(self.index, self.subindex, len(self._data), self._checked)

    def expects(self, frame: bytes) -> bool:
        """The client's part of a block upload but its initiation."""
        return frame[0] in (BlockCommand.UPLOAD_START, BlockCommand.UPLOAD_ACKNOWLEDGE, BlockCommand.UPLOAD_CONFIRM)

    def receive(self, frame: bytes) -> tuple[bytes, ...]:
        """Start, an acknowledgement, or the client's confirmation of the end."""
        command = frame[0]
        if self._phase is _Phase.START and command == BlockCommand.UPLOAD_START:
            return self._sub_block()
        if self._phase is _Phase.SEGMENTS and command == BlockCommand.UPLOAD_ACKNOWLEDGE:
            return self._acknowledged(frame[1], frame[2])
        if self._phase is _Phase.CONFIRM and command == BlockCommand.UPLOAD_CONFIRM:
            self.finished = True
            return ()
        raise SdoAbort(AbortCode.COMMAND_SPECIFIER)

    def _acknowledged(self, segments: int, block_size: int) -> tuple[bytes, ...]:
        if segments > self._sent:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        self._block_size = _checked_block_size(block_size)
        self._at += segments
        if self._at < self._segments:
            return self._sub_block()
        self._phase = _Phase.CONFIRM
        unused = self._segments * SEGMENT_LENGTH - len(self._data)
        return (block_upload_ended(unused, crc(self._data) if self._checked else 0),)

    def _sub_block(self) -> tuple[bytes, ...]:
        self._phase = _Phase.SEGMENTS
        self._sent = min(self._block_size, self._segments - self._at)
        begin, data = self._at * SEGMENT_LENGTH, self._data
        places = range(begin, begin + self._sent * SEGMENT_LENGTH, SEGMENT_LENGTH)
        sent = [block_segment(number, data[place : place + SEGMENT_LENGTH]) for number, place in enumerate(places, 1)]
        if self._at + self._sent == self._segments:
            sent[-1] = block_segment(LAST_BLOCK_SEGMENT | self._sent, data[places[-1] :])
        return tuple(sent)


def _checked_block_size(size: int) -> int:
    if not 1 <= size <= BLOCK_SIZE:
        raise SdoAbort(AbortCode.BLOCK_SIZE)
    return size
