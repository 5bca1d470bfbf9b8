"""How the panel reads and writes objects of drives: by their service port where there is one, else by SDO.

A drive has one default SDO channel, for one client (CiA 301, 7.2.4). By SDO the panel is a second one, and gives way.
"""

from __future__ import annotations

import logging
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path

import canopen
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivetwin.foundation.control_socket import ask_control
from drivetwin.foundation.errors import UserError
from drivetwin.panel.link import Link

logger = logging.getLogger(__name__)

SETTLED = 0.5
"""So long no other master has asked a drive before the panel asks it by itself [s]."""

QUIET = 0.1
"""The same before it asks what a page wants to know [s]."""

PATIENCE = 5.0
"""Longest wait for that [s]."""

ABANDONED = 6.0
"""After which another master's request that no drive has answered counts no more [s]; longer than `PATIENCE`, so that whoever
asks at the same time is refused and not let through by chance."""

ANSWER = 1.0
"""Longest wait for a drive's answer [s]; it answers within milliseconds, a loaded host may not."""


class ObjectRefusedError(UserError):
    """The drive is there, and an object is not read or not taken."""


class Door(ABC):
    """Objects of the drives on a bus, by node-ID, index and subindex."""

    def __init__(self, quiet_for: Callable[[int], float]) -> None:
        self.quiet_for = quiet_for
        """Seconds since another master asked a node by SDO: one that configures it does."""

    @abstractmethod
    def read(self, node_id: int, index: int, subindex: int) -> bytes:
        """The bytes of an object. Raises ObjectRefusedError with the drive's reason, UserError where it does not answer."""

    @abstractmethod
    def write(self, node_id: int, index: int, subindex: int, data: bytes) -> None:
        """Write the bytes of an object. Raises as `read`."""

    @abstractmethod
    def is_free(self, node_id: int) -> bool:
        """Whether the panel may ask the node by itself."""

    @abstractmethod
    def catch_up(self) -> None:
        """Hear what passed on the bus before the last answer."""


class ServicePort(Door):
    """Beside the bus, through the emulator's control socket: no master loses an answer, and no frame is sent."""

    def __init__(self, link: Link, control: Path) -> None:
        super().__init__(link.quiet_for)
        self._link = link
        self._control = control

    def read(self, node_id: int, index: int, subindex: int) -> bytes:
        return bytes.fromhex(self._asked("read", {"node": node_id, "index": index, "subindex": subindex}))

    def write(self, node_id: int, index: int, subindex: int, data: bytes) -> None:
        self._asked("write", {"node": node_id, "index": index, "subindex": subindex, "data": data.hex()})

    def is_free(self, node_id: int) -> bool:
        return True

    def catch_up(self) -> None:
        self._link.catch_up(ANSWER)

    def _asked(self, what: str, told: dict[str, object]) -> str:
        answer = ask_control(self._control, {what: told})
        if "refused" in answer:
            where = f"node {told['node']}, {told['index']:04X}h:{told['subindex']:02X}"
            raise ObjectRefusedError(f"{where}: the drive refused: {answer['refused']}")
        return str(answer["data"])


class SdoChannel(Door):
    """The default SDO channel of each drive, where no other master asks it."""

    def __init__(self, link: Link) -> None:
        super().__init__(link.quiet_for)
        self._link = link
        self._nodes: dict[int, _Node] = {}
        self._one_at_a_time = threading.Lock()

    def read(self, node_id: int, index: int, subindex: int) -> bytes:
        return self._ask(node_id, index, subindex, lambda sdo: bytes(sdo.upload(index, subindex)))

    def write(self, node_id: int, index: int, subindex: int, data: bytes) -> None:
        def download(sdo: SdoClient) -> bytes:
            sdo.download(index, subindex, data)
            return b""

        self._ask(node_id, index, subindex, download)

    def is_free(self, node_id: int) -> bool:
        return self._link.quiet_for(node_id) >= SETTLED

    def catch_up(self) -> None:
        """The answer came by the bus itself, and was heard in its turn."""

    def _ask(self, node_id: int, index: int, subindex: int, exchange: Callable[[SdoClient], bytes]) -> bytes:
        where = f"node {node_id}, {index:04X}h:{subindex:02X}"
        with self._one_at_a_time:
            node = self._node(node_id)
            self._link.hurry(True)
            try:
                self._wait_for_quiet(node_id, where)
                node.sdo.began = time.monotonic()
                return exchange(node.sdo)
            except SdoAbortedError as error:
                raise ObjectRefusedError(f"{where}: the drive refused: {error}") from None
            except SdoCommunicationError as error:
                raise UserError(f"{where}: {error}") from None
            finally:
                self._link.hurry(False)

    def _node(self, node_id: int) -> _Node:
        if node_id not in self._nodes:
            self._nodes[node_id] = _Node(node_id, canopen.ObjectDictionary())
            self._link.add_node(self._nodes[node_id])
        return self._nodes[node_id]

    def _wait_for_quiet(self, node_id: int, where: str) -> None:
        """Judged by the frames that have passed up to now, not by those that a panel that lags behind has heard of."""
        until = time.monotonic() + PATIENCE
        while not self._link.catch_up(PATIENCE) or not self._is_quiet(node_id):
            if self._link.lost is not None:
                raise UserError(f"{where}: {self._link.lost}")
            if time.monotonic() > until:
                raise UserError(f"{where}: another master asks this drive by SDO without a pause; try again when it has done")
            time.sleep(QUIET / 4)

    def _is_quiet(self, node_id: int) -> bool:
        """A request that no drive answers is no reason to wait for ever."""
        quiet = self._link.quiet_for(node_id)
        return quiet >= (ABANDONED if self._link.is_unanswered(node_id) else QUIET)


class _ModestClient(SdoClient):
    """canopen's SDO client, which asks once, leaves the channel to any other master, and aborts nothing.

    A server that misses the rest of a transfer ends it by itself; an abort could end that of another client.
    """

    MAX_RETRIES = 1
    RESPONSE_TIMEOUT = ANSWER
    network: Link

    began = 0.0
    """When the panel asked, by time.monotonic()."""

    def send_request(self, request: bytes) -> None:
        """As `SdoClient.send_request`. Raises SdoCommunicationError where another master has asked meanwhile."""
        if time.monotonic() - self.network.quiet_for(self.rx_cobid - 0x600) > self.began:
            raise SdoCommunicationError("another master has asked this drive meanwhile; try again when it has done")
        self.network.send_message(self.rx_cobid, bytes(request))

    def abort(self, abort_code: int = 0) -> None:
        """Nothing is sent."""
        logger.debug("transfer given up (%08Xh)", abort_code)


class _Node(canopen.RemoteNode):
    """A remote node with that client."""

    sdo: _ModestClient

    def add_sdo(self, rx_cobid: int, tx_cobid: int) -> SdoClient:
        """Create an SDO channel; called by RemoteNode for its default one."""
        client = _ModestClient(rx_cobid, tx_cobid, self.object_dictionary)  # type: ignore[no-untyped-call]  # canopen
        self.sdo_channels.append(client)
        if self.has_network():
            self.network.subscribe(client.tx_cobid, client.on_response)
        return client
