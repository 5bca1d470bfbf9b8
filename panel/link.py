"""The panel's end of the bus: one thread hands each frame to who listens; SDO waits until no other master asks the drive."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from types import TracebackType

import can
import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

Hearer = Callable[[can.Message], None]

SLICE = 0.1
"""Longest wait for a frame before looking whether to stop [s]."""

QUIET = 0.1
"""So long no other master has asked a drive by SDO before the panel does [s]: a drive has one default SDO channel."""

PATIENCE = 5.0
"""Longest wait for that [s]."""

ANSWER = 1.0
"""Longest wait for a drive's answer [s]; it answers within milliseconds, a loaded host may not."""


class ObjectRefusedError(UserError):
    """The drive is there, and an object is not read or not taken."""


class Link(canopen.Network):
    """A canopen network on an open python-can bus. `hearers` get every frame of others, in the thread of the bus.

    `watchers` get these before, and the panel's own frames in the thread that sends.

    `lost` says why the bus has gone, None while it is there.
    """

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self.hearers: list[Hearer] = []
        self.watchers: list[Hearer] = []
        self.lost: str | None = None
        self._wire = bus
        self._asked: dict[int, float] = {}
        self._one_at_a_time = threading.Lock()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="panel bus", daemon=True)

    def __enter__(self) -> Link:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._ended.set()
        self._thread.join()
        self._wire.shutdown()

    @property
    def name(self) -> str:
        """Of the bus."""
        return str(self._wire.channel_info)

    def add(self, node_id: int) -> canopen.RemoteNode:
        """A node to ask by SDO; its objects are asked for by their address alone."""
        nothing = canopen.ObjectDictionary()
        node = canopen.RemoteNode(node_id, nothing)
        node.sdo.RESPONSE_TIMEOUT = ANSWER
        self.add_node(node)
        return node

    def read(self, node: canopen.RemoteNode, index: int, subindex: int) -> bytes:
        """The bytes of an object. Raises ObjectRefusedError with the drive's reason, UserError where it does not answer."""
        with self._one_at_a_time:
            return bytes(self._ask(node, index, subindex, lambda: node.sdo.upload(index, subindex)))

    def write(self, node: canopen.RemoteNode, index: int, subindex: int, data: bytes) -> None:
        """Write the bytes of an object. Raises as `read`."""
        with self._one_at_a_time:
            self._ask(node, index, subindex, lambda: node.sdo.download(index, subindex, data))

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Send one frame for canopen, as `Network.send_message`. Raises UserError where the bus has gone."""
        message = can.Message(arbitration_id=can_id, data=data, is_extended_id=can_id > 0x7FF, is_remote_frame=remote)
        try:
            with self.send_lock:
                self._wire.send(message)
                self._show(message)
        except can.CanError as error:
            raise UserError(str(error)) from None

    def quiet_for(self, node_id: int) -> float:
        """Seconds since another master asked the node by SDO."""
        return time.monotonic() - self._asked.get(node_id, 0.0)

    def _ask(self, node: canopen.RemoteNode, index: int, subindex: int, exchange: Callable[[], bytes | None]) -> bytes:
        where = f"node {node.id}, {index:04X}h:{subindex:02X}"
        self._wait_for_quiet(int(node.id or 0), where)
        try:
            return exchange() or b""
        except SdoAbortedError as error:
            raise ObjectRefusedError(f"{where}: the drive refused: {error}") from None
        except SdoCommunicationError as error:
            raise UserError(f"{where}: {error}") from None

    def _wait_for_quiet(self, node_id: int, where: str) -> None:
        until = time.monotonic() + PATIENCE
        while self.quiet_for(node_id) < QUIET:
            if time.monotonic() > until:
                raise UserError(f"{where}: another master asks this drive by SDO without a pause; try again when it has done")
            time.sleep(QUIET / 4)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                message = self._wire.recv(SLICE)
            except can.CanError as error:
                self.lost = str(error)
                return
            if message is not None and not message.is_error_frame:
                self._hand_on(message)

    def _hand_on(self, message: can.Message) -> None:
        if 0x601 <= message.arbitration_id <= 0x67F and message.is_rx:
            self._asked[message.arbitration_id - 0x600] = time.monotonic()
        self._show(message)
        for hear in self.hearers:
            hear(message)
        if not message.is_remote_frame and not message.is_extended_id:
            self.notify(message.arbitration_id, message.data, message.timestamp)

    def _show(self, message: can.Message) -> None:
        for watch in self.watchers:
            watch(message)
