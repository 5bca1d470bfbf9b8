"""How a master reads and writes the dictionary: the SDO server (CiA 301, 7.2.4).

A request of up to four bytes is answered here (expedited); a longer one opens a transfer that gets the frames after it.
Each kind of transfer is a file of its own and enters by its command specifier in `_INITIATORS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from emulator.canopen.abort_codes import AbortCode, SdoAbort
from emulator.canopen.object_dictionary import ObjectDictionary, Variable
from emulator.canopen.sdo_frame import (
    ABORT,
    DOWNLOAD_INITIATE,
    FRAME_LENGTH,
    UPLOAD_INITIATE,
    abort_frame,
    address,
    download_initiated,
    upload_expedited,
    upload_initiated,
)
from emulator.canopen.sdo_segmented import SegmentedDownload, SegmentedUpload

REQUEST_COB_ID = 0x600
RESPONSE_COB_ID = 0x580

EXPEDITED = 0x02
SIZE_INDICATED = 0x01


class Transfer(Protocol):
    """A transfer of several frames. Raises SdoAbort, which ends it."""

    index: int
    subindex: int
    finished: bool

    def expects(self, frame: bytes) -> bool:
        """Whether a frame goes on with this transfer, rather than opening another."""

    def receive(self, frame: bytes) -> bytes:
        """Take a frame of the client, return the answer."""


class SdoServer:
    """The default SDO of one node: one client, one transfer at a time."""

    def __init__(self, node_id: int, od: ObjectDictionary, transmit: Callable[[int, bytes], None]) -> None:
        self._cob_id = RESPONSE_COB_ID + node_id
        self._od = od
        self._transmit = transmit
        self._transfer: Transfer | None = None
        self._initiators: dict[int, Callable[[bytes, Variable], bytes]] = {
            DOWNLOAD_INITIATE: self._download,
            UPLOAD_INITIATE: self._upload,
        }

    def reset(self) -> None:
        """Forget a transfer that is under way."""
        self._transfer = None

    def receive(self, data: bytes) -> None:
        """Answer a request. A frame that has not eight bytes is no SDO (CiA 301, 7.2.4.3) and is not answered."""
        if len(data) != FRAME_LENGTH:
            return
        frame = bytes(data)
        if frame[0] >> 5 == ABORT:
            self._transfer = None
            return
        try:
            answer = self._answer(frame)
        except SdoAbort as refusal:
            answer = self._abort(frame, refusal.code)
        self._transmit(self._cob_id, answer)

    def _answer(self, frame: bytes) -> bytes:
        transfer = self._transfer
        if transfer is not None and transfer.expects(frame):
            answer = transfer.receive(frame)
            if transfer.finished:
                self._transfer = None
            return answer
        initiate = self._initiators.get(frame[0] >> 5)
        if initiate is None:
            raise SdoAbort(AbortCode.COMMAND_SPECIFIER)
        self._transfer = None
        return initiate(frame, self._od.find(*address(frame)))

    def _abort(self, frame: bytes, code: AbortCode) -> bytes:
        """The abort names the object of the transfer that ends, else that of the frame."""
        transfer, self._transfer = self._transfer, None
        if transfer is not None:
            return abort_frame(transfer.index, transfer.subindex, code)
        return abort_frame(*address(frame), code)

    def _download(self, frame: bytes, variable: Variable) -> bytes:
        if not variable.access.writable:
            raise SdoAbort(AbortCode.READ_ONLY)
        if frame[0] & EXPEDITED:
            variable.decode_and_write(_expedited_data(frame, variable))
        else:
            indicated = int.from_bytes(frame[4:8], "little") if frame[0] & SIZE_INDICATED else None
            self._transfer = SegmentedDownload(variable, indicated)
        return download_initiated(variable.index, variable.subindex)

    def _upload(self, _frame: bytes, variable: Variable) -> bytes:
        if not variable.access.readable:
            raise SdoAbort(AbortCode.WRITE_ONLY)
        data = variable.encode()
        if 1 <= len(data) <= 4:
            return upload_expedited(variable.index, variable.subindex, data)
        self._transfer = SegmentedUpload(variable, data)
        return upload_initiated(variable.index, variable.subindex, len(data))


def _expedited_data(frame: bytes, variable: Variable) -> bytes:
    """Data of an expedited download; a client that does not say the size means the object's own."""
    if frame[0] & SIZE_INDICATED:
        return frame[4 : 8 - (frame[0] >> 2 & 0x03)]
    return frame[4 : 4 + min(variable.size or 4, 4)]
