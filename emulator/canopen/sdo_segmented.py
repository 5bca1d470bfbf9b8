"""Values longer than four bytes, seven bytes a frame: segmented SDO transfers (CiA 301, 7.2.4.3.3 and 7.2.4.3.6)."""

from __future__ import annotations

from drivetwin.drive_profiles import DataType
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.object_dictionary import Variable, check_length
from drivetwin.emulator.canopen.sdo_frame import (
    DOWNLOAD_SEGMENT,
    LAST_SEGMENT,
    SEGMENT_LENGTH,
    TOGGLE,
    UPLOAD_SEGMENT,
    download_segment_taken,
    upload_segment,
)

MAX_TEXT, MAX_DOMAIN = 65536, 16 * 1024 * 1024
"""Bytes that a client may write to an object without a length of its own."""


def room(variable: Variable) -> int:
    """Bytes that an object takes at most."""
    if variable.size is not None:
        return variable.size
    return MAX_DOMAIN if variable.data_type is DataType.DOMAIN else MAX_TEXT


def check_announced(variable: Variable, indicated: int | None) -> None:
    """Raise SdoAbort where a client announces more or less than the object takes."""
    if indicated is None:
        return
    if variable.size is not None:
        check_length(indicated, variable.size)
    if indicated > room(variable):
        raise SdoAbort(AbortCode.OUT_OF_MEMORY)


class SegmentedDownload:
    """A value that comes in segments; it is written when the last one is there."""

    def __init__(self, variable: Variable, indicated: int | None) -> None:
        check_announced(variable, indicated)
        self.index = variable.index
        self.subindex = variable.subindex
        self.finished = False
        self._variable = variable
        self._indicated = indicated
        self._data = bytearray()
        self._toggle = 0

    def expects(self, frame: bytes) -> bool:
        """Download segment requests."""
        return frame[0] >> 5 == DOWNLOAD_SEGMENT

    def receive(self, frame: bytes) -> tuple[bytes, ...]:
        """Take a segment."""
        toggle = frame[0] & TOGGLE
        if toggle != self._toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        self._toggle ^= TOGGLE
        self._data += frame[1 : 8 - (frame[0] >> 1 & 0x07)]
        self._check_length_so_far()
        if frame[0] & LAST_SEGMENT:
            self._write()
        return (download_segment_taken(toggle),)

    def _check_length_so_far(self) -> None:
        most = self._indicated if self._indicated is not None else self._variable.size
        if most is not None and len(self._data) > most:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        if len(self._data) > room(self._variable):
            raise SdoAbort(AbortCode.OUT_OF_MEMORY)

    def _write(self) -> None:
        if self._indicated is not None:
            check_length(len(self._data), self._indicated)
        self._variable.decode_and_write(bytes(self._data))
        self.finished = True


class SegmentedUpload:
    """A value that goes out in segments, as it was when the upload began."""

    def __init__(self, variable: Variable, data: bytes) -> None:
        self.index = variable.index
        self.subindex = variable.subindex
        self.finished = False
        self._data = data
        self._at = 0
        self._toggle = 0

    def expects(self, frame: bytes) -> bool:
        """Upload segment requests."""
        return frame[0] >> 5 == UPLOAD_SEGMENT

    def receive(self, frame: bytes) -> tuple[bytes, ...]:
        """Give the next segment."""
        toggle = frame[0] & TOGGLE
        if toggle != self._toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        self._toggle ^= TOGGLE
        segment = self._data[self._at : self._at + SEGMENT_LENGTH]
        self._at += SEGMENT_LENGTH
        self.finished = self._at >= len(self._data)
        return (upload_segment(toggle, segment, LAST_SEGMENT if self.finished else 0),)
