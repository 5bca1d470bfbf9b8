"""How a master reads and writes the dictionary: the SDO server (CiA 301, 7.2.4).

A request of up to four bytes is answered here (expedited); a longer one opens a transfer that gets the frames after it.
Each kind of transfer is a file of its own and enters by its command specifier in `_initiators`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.nmt import Nmt
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.canopen.sdo_block import BlockDownload, BlockUpload
from drivetwin.emulator.canopen.sdo_frame import (
    ABORT,
    ABORT_COMMAND,
    BLOCK_DOWNLOAD,
    BLOCK_UPLOAD,
    DOWNLOAD_INITIATE,
    FRAME_LENGTH,
    UPLOAD_INITIATE,
    abort_frame,
    address,
    download_initiated,
    upload_expedited,
    upload_initiated,
)
from drivetwin.emulator.canopen.sdo_segmented import SegmentedDownload, SegmentedUpload

REQUEST_COB_ID = 0x600
RESPONSE_COB_ID = 0x580

EXPEDITED = 0x02
SIZE_INDICATED = 0x01

_GOES_ON = {BLOCK_DOWNLOAD: 0x01, BLOCK_UPLOAD: 0x03}
"""Bits of the first byte that are 0 where a block transfer is initiated; else it goes on with one."""

TIME_OUT = 1.0
"""A transfer whose client is silent for so long is aborted with 0504 0000h [s]."""


class Transfer(Protocol):
    """A transfer of several frames. Raises SdoAbort, which ends it."""

    index: int
    subindex: int
    finished: bool

    def expects(self, frame: bytes) -> bool:
        """Whether a frame goes on with this transfer, rather than opening another."""

    def receive(self, frame: bytes) -> tuple[bytes, ...]:
        """Take a frame of the client, return the answers."""


class SdoServer:
    """The default SDO of one node: one client, one transfer at a time."""

    def __init__(
        self,
        od: ObjectDictionary,
        nmt: Nmt,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
        alarms: Alarms,
    ) -> None:
        self._od = od
        self._nmt = nmt
        self._transmit = transmit
        self._now = now
        self._alarm = alarms.add(self._time_out)
        self._transfer: Transfer | None = None
        self._initiators: dict[int, Callable[[bytes, Variable], bytes]] = {
            DOWNLOAD_INITIATE: self._download,
            UPLOAD_INITIATE: self._upload,
            BLOCK_DOWNLOAD: self._block_download,
            BLOCK_UPLOAD: self._block_upload,
        }

    def reset(self) -> None:
        """Forget a transfer that is under way."""
        self._transfer = None
        self._alarm.stop()

    def receive(self, data: bytes) -> None:
        """Answer a request. A frame that has not eight bytes is no SDO (CiA 301, 7.2.4.3) and is not answered."""
        if len(data) != FRAME_LENGTH:
            return
        frame = bytes(data)
        if frame[0] == ABORT_COMMAND:
            self.reset()
            return
        for answer in self._answers(frame):
            self._transmit(RESPONSE_COB_ID + self._nmt.node_id, answer)
        if self._transfer is None:
            self._alarm.stop()
        else:
            self._alarm.set(self._now() + TIME_OUT)

    def _answers(self, frame: bytes) -> tuple[bytes, ...]:
        try:
            return self._answer(frame)
        except SdoAbort as refusal:
            return (self._abort(frame, refusal.code),)

    def _answer(self, frame: bytes) -> tuple[bytes, ...]:
        transfer = self._transfer
        if transfer is not None and transfer.expects(frame):
            answers = transfer.receive(frame)
            if transfer.finished:
                self._transfer = None
            return answers
        specifier = frame[0] >> 5
        if specifier == ABORT:
            self._transfer = None
            return ()
        initiate = self._initiators.get(specifier)
        if initiate is None or frame[0] & _GOES_ON.get(specifier, 0):
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
        self._transfer = None
        return (initiate(frame, self._od.find(*address(frame))),)

    def _abort(self, frame: bytes, code: AbortCode) -> bytes:
        """The abort names the object of the transfer that ends, else that of the frame."""
        transfer, self._transfer = self._transfer, None
        if transfer is not None:
            return abort_frame(transfer.index, transfer.subindex, code)
        return abort_frame(*address(frame), code)

    def _time_out(self, _now: float) -> None:
        transfer, self._transfer = self._transfer, None
        if transfer is not None and self._nmt.communicating:
            frame = abort_frame(transfer.index, transfer.subindex, AbortCode.TIME_OUT)
            self._transmit(RESPONSE_COB_ID + self._nmt.node_id, frame)

    def _download(self, frame: bytes, variable: Variable) -> bytes:
        check_writable(variable)
        if frame[0] & EXPEDITED:
            variable.decode_and_write(_expedited_data(frame, variable))
        else:
            indicated = int.from_bytes(frame[4:8], "little") if frame[0] & SIZE_INDICATED else None
            self._transfer = SegmentedDownload(variable, indicated)
        return download_initiated(variable.index, variable.subindex)

    def _upload(self, _frame: bytes, variable: Variable) -> bytes:
        data = readable_data(variable)
        if 1 <= len(data) <= 4:
            return upload_expedited(variable.index, variable.subindex, data)
        self._transfer = SegmentedUpload(variable, data)
        return upload_initiated(variable.index, variable.subindex, len(data))

    def _block_download(self, frame: bytes, variable: Variable) -> bytes:
        check_writable(variable)
        transfer = BlockDownload(variable, frame)
        self._transfer = transfer
        return transfer.initiated()

    def _block_upload(self, frame: bytes, variable: Variable) -> bytes:
        """A value no longer than the client's protocol switch threshold goes by the normal protocol (CiA 301, 7.2.4.3.9ff)."""
        data = readable_data(variable)
        transfer = BlockUpload(variable, data, frame)
        if 0 < len(data) <= frame[5]:
            return self._upload(frame, variable)
        self._transfer = transfer
        return transfer.initiated()


def check_writable(variable: Variable) -> None:
    """Raise SdoAbort where nobody may write it."""
    if not variable.access.writable:
        raise SdoAbort(AbortCode.READ_ONLY)


def readable_data(variable: Variable) -> bytes:
    """The bytes of its value now. Raises SdoAbort where nobody may read it."""
    if not variable.access.readable:
        raise SdoAbort(AbortCode.WRITE_ONLY)
    return variable.encode()


def _expedited_data(frame: bytes, variable: Variable) -> bytes:
    """Data of an expedited download; a client that does not say the size means the object's own."""
    if frame[0] & SIZE_INDICATED:
        return frame[4 : 8 - (frame[0] >> 2 & 0x03)]
    return frame[4 : 4 + min(variable.size or 4, 4)]
