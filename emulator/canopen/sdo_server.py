"""How a master reads and writes the dictionary: the SDO server (CiA 301, 7.2.4).

A request of up to four bytes is answered at once (expedited); a longer one opens a transfer that gets the frames after it.
Each kind of transfer is a file of its own and enters by its command specifier in `_initiators`.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Protocol

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.nmt import Nmt
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.canopen.sdo_block import BlockDownload, BlockUpload
from drivetwin.emulator.canopen.sdo_expedited import (
    EXPEDITED,
    MOST,
    SIZE_INDICATED,
    Answer,
    expedited_download,
    expedited_upload,
    is_expedited,
)
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
from drivetwin.emulator.canopen.timing import TOLERANCE

REQUEST_COB_ID = 0x600
RESPONSE_COB_ID = 0x580

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
        self._heard = 0.0
        self._expedited: dict[bytes, Answer] = {}
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
        if self._transfer is None:
            known = self._expedited.get(data[:4])
            if known is not None:
                try:
                    answer = known(data)
                except SdoAbort as refusal:
                    answer = abort_frame(*address(data), refusal.code)
                self._send(answer)
                return
        if data[0] == ABORT_COMMAND:
            self.reset()
            return
        try:
            answers = self._answer(data)
        except SdoAbort as refusal:
            answers = (self._abort(data, refusal.code),)
        for answer in answers:
            self._send(answer)
        if self._transfer is None:
            self._alarm.stop()
        else:
            self._await_client()

    def _send(self, answer: bytes) -> None:
        self._transmit(RESPONSE_COB_ID + self._nmt.node_id, answer)

    def _await_client(self) -> None:
        """The alarm that has been set looks itself whether the client was heard since."""
        self._heard = self._now()
        if self._alarm.due == inf:
            self._alarm.set(self._heard + TIME_OUT)

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

    def _time_out(self, now: float) -> None:
        if now < self._heard + TIME_OUT - TOLERANCE:
            self._alarm.set(self._heard + TIME_OUT)
            return
        transfer, self._transfer = self._transfer, None
        if transfer is not None and self._nmt.communicating:
            self._send(abort_frame(transfer.index, transfer.subindex, AbortCode.TIME_OUT))

    def _download(self, frame: bytes, variable: Variable) -> bytes:
        check_writable(variable)
        if frame[0] & EXPEDITED:
            answer = self._expedited[frame[:4]] = expedited_download(variable, frame[0])
            return answer(frame)
        indicated = int.from_bytes(frame[4:8], "little") if frame[0] & SIZE_INDICATED else None
        self._transfer = SegmentedDownload(variable, indicated)
        return download_initiated(variable.index, variable.subindex)

    def _upload(self, frame: bytes, variable: Variable) -> bytes:
        if is_expedited(variable) and variable.access.readable:
            answer = self._expedited[frame[:4]] = expedited_upload(variable)
            return answer(frame)
        return self._upload_data(variable, readable_data(variable))

    def _upload_data(self, variable: Variable, data: bytes) -> bytes:
        if 1 <= len(data) <= MOST:
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
            return self._upload_data(variable, data)
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
