"""The controller's end of the bus: one thread that sends, receives and dispatches each frame to its receiver."""

from __future__ import annotations

import queue
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType

import can
import canopen
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoCommunicationError

from drivetwin.bus.candump import MOST_BASE
from drivetwin.bus.frame import DataFrame
from drivetwin.controller.interruption import Interruption
from drivetwin.foundation.errors import UserError

SYNC_COB_ID = 0x80
NMT_COB_ID = 0x000

SDO_TIMEOUT, SDO_TIMEOUT_IN_CYCLES = 5.0, 1.0
"""Longest wait for an SDO answer [s] of wall-clock, and of the plant's time where cycles run; a drive answers within
milliseconds, a loaded host may not."""

SLICE = 0.02
"""Longest that a Ctrl-C waits for a frame [s]."""


class Answers:
    """What has come of a server, as canopen's client asks a `queue.Queue` for it, without locks: one thread puts and gets."""

    def __init__(self) -> None:
        self._came: deque[bytes] = deque()
        self.put = self._came.append
        self.clear = self._came.clear

    def __bool__(self) -> bool:
        """Whether one waits."""
        return bool(self._came)

    def empty(self) -> bool:
        """Whether none waits."""
        return not self._came

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:
        """The first that waits. Raises queue.Empty, as nobody else could put one."""
        if not self._came:
            raise queue.Empty
        return self._came.popleft()


class PumpedSdoClient(SdoClient):
    """canopen's SDO client without a receiving thread: waiting for an answer is pumping the bus, or running cycles.

    While cycles run a request goes out behind the answers to a SYNC, and the next cycle runs before its own answer is asked
    for: one exchange a cycle at most, and an answer that does not come is waited for in the plant's time.
    """

    RESPONSE_TIMEOUT = SDO_TIMEOUT
    network: Link
    responses: Answers  # type: ignore[assignment]  # canopen has a queue

    def __init__(self, rx_cobid: int, tx_cobid: int, dictionary: canopen.ObjectDictionary) -> None:
        super().__init__(rx_cobid, tx_cobid, dictionary)  # type: ignore[no-untyped-call]  # canopen
        self.responses = Answers()

    def request_response(self, sdo_request: bytes) -> bytes:
        """The answer to a request, as `SdoClient.request_response`; what came of an earlier one is dropped."""
        self.responses.clear()
        response: bytes = super().request_response(sdo_request)  # type: ignore[no-untyped-call]  # canopen
        return response

    def read_response(self) -> bytes:
        """Next answer of the server, as `SdoClient.read_response`."""
        try:
            self._await_response()
        except KeyboardInterrupt:
            with suppress(SdoCommunicationError):
                self._await_response()  # else the next request, of whoever cleans up, would take it for its own
            raise
        response: bytes = super().read_response()  # type: ignore[no-untyped-call]  # canopen
        return response

    def _await_response(self) -> None:
        runs = self.network.cycle is not None
        patience = min(self.RESPONSE_TIMEOUT, SDO_TIMEOUT_IN_CYCLES) if runs else self.RESPONSE_TIMEOUT
        if not self.network.wait_until(self.responses.__bool__, patience):
            raise SdoCommunicationError("No SDO response received")


class PumpedNode(canopen.RemoteNode):
    """A remote node whose SDO client pumps."""

    def add_sdo(self, rx_cobid: int, tx_cobid: int) -> SdoClient:
        """Create an SDO channel; called by RemoteNode for its default one."""
        client = PumpedSdoClient(rx_cobid, tx_cobid, self.object_dictionary)
        self.sdo_channels.append(client)
        if self.has_network():
            self.network.subscribe(client.tx_cobid, client.on_response)
        return client


class Link(canopen.Network):
    """A canopen network on an open python-can bus, pumped by its owner instead of by a thread.

    Frames of `fast` COB-IDs go straight to their handler; all others through canopen. While the link is open, Ctrl-C and
    SIGTERM wait until no frame is half read or half sent: `pump` raises them as KeyboardInterrupt, once.
    """

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self.wire = bus
        self.log: Callable[[can.Message], None] | None = None
        self.fast: dict[int, Callable[[bytes], None]] = {}
        self.cycle: Callable[[], float] | None = None
        """Runs a cycle and returns its seconds, once cycles run: then whoever waits lets them go on."""
        self._interruption = Interruption()

    def __enter__(self) -> Link:
        self._interruption.watch()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._interruption.release()
        self.wire.shutdown()

    def send(self, cob_id: int, data: bytes) -> None:
        """Send one data frame."""
        self._put(DataFrame(cob_id, data))

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Send one frame for canopen, as `Network.send_message`."""
        if remote or can_id > MOST_BASE:
            self._put(can.Message(arbitration_id=can_id, data=data, is_extended_id=can_id > MOST_BASE, is_remote_frame=remote))
        else:
            self._put(DataFrame(can_id, data))

    def pump(self, timeout: float) -> bool:
        """Take one frame from the bus, waiting up to `timeout` seconds; whether one came."""
        if self._interruption.requested:
            self._interruption.raise_once()
        try:
            message = self.wire.recv(timeout if timeout > 0.0 else 0.0)
        except can.CanError as error:
            raise UserError(str(error)) from None
        if message is None:
            return False
        if self.log is not None:
            self.log(message)
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            return True  # no answer of a drive
        handler = self.fast.get(message.arbitration_id)
        if handler is not None:
            handler(bytes(message.data))
        else:
            self.notify(message.arbitration_id, message.data, message.timestamp)
        return True

    def wait_until(self, done: Callable[[], bool], seconds: float) -> bool:
        """Whether `done` within `seconds`: of cycles where they run, at least one of them, else of wall-clock."""
        if self.cycle is not None:
            waited = self.cycle()
            while not done() and waited < seconds:
                waited += self.cycle()
            return done()
        deadline = time.monotonic() + seconds
        while not done():
            left = deadline - time.monotonic()
            if not self.pump(left) and left <= 0.0:
                return False
        return True

    def await_frame(self, seconds: float) -> bool:
        """Take one frame, waiting up to `seconds`, in slices that let a Ctrl-C through; whether one came."""
        slice_ = min(seconds, SLICE)
        if self.pump(slice_):
            return True
        deadline = time.monotonic() + seconds - slice_
        while time.monotonic() < deadline:
            if self.pump(slice_):
                return True
        return False

    def _put(self, message: can.Message) -> None:
        if self.log is not None:
            self.log(message)
        try:
            self.wire.send(message)
        except can.CanError as error:
            raise UserError(str(error)) from None

    def drain(self) -> None:
        """Take what has already come."""
        while self.pump(0.0):
            pass
