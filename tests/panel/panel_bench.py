"""A front panel as a process of its own, and a page's end of its WebSocket, by another library than the server's."""

from __future__ import annotations

import base64
import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

import canopen
import numpy as np
from numpy.typing import NDArray
from processes import PATIENCE, start
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from drivetwin.bus.channel import open_bus

TRIES = 5
"""Of a read whose answer may be another client's."""


@dataclass(frozen=True)
class Served:
    """Where a panel is, and which bus it looks at."""

    url: str
    bus: str

    @property
    def host(self) -> str:
        """127.0.0.1:PORT."""
        return self.url.removeprefix("http://").rstrip("/")


@contextmanager
def panel(*arguments: object) -> Iterator[Served]:
    """`drivetwin panel` on a free port. It has to end well."""
    process = start("panel", "--port", 0, *arguments)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"panel on (http://[^/]+/).* on (\S+); ", line)
        assert found is not None, line + (process.communicate(timeout=PATIENCE)[1] if not line else "")
        yield Served(*found.groups())
    finally:
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (0, "")


@dataclass
class Page:
    """What a page would do."""

    wire: ClientConnection
    told: list[dict[str, Any]] = field(default_factory=list)
    _number: int = 0

    def ask(self, what: str, **more: object) -> dict[str, Any]:
        """The answer or the refusal."""
        self._number += 1
        self.wire.send(json.dumps({"id": self._number, "ask": what, **more}))
        while (message := self._hear()).get("id") != self._number:
            pass
        return message

    def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The first told view that is wanted."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            message = self._hear()
            if "view" in message and wanted(message):
                return message
        raise AssertionError(f"never told; the last was {json.dumps(message)[:4000]}")

    def _hear(self) -> dict[str, Any]:
        """The next message; that a view has been seen is said."""
        message: dict[str, Any] = json.loads(self.wire.recv(PATIENCE))
        if "view" in message:
            self.wire.send('{"ask": "seen"}')
        return message


@contextmanager
def page(served: Served) -> Iterator[Page]:
    """A page of the panel's own origin."""
    with connect(f"ws://{served.host}/live", origin=Origin(served.url.rstrip("/"))) as wire:
        yield Page(wire)


def read_by_canopen(bus: str, node: int, index: int) -> float:
    """A floating-point object, read by a master of another stack."""
    network = canopen.Network(open_bus(bus))
    network.connect()
    try:
        dictionary = canopen.ObjectDictionary()
        dictionary.add_object(variable := canopen.objectdictionary.ODVariable("any", index))
        variable.data_type = canopen.objectdictionary.REAL32
        remote = network.add_node(node, dictionary)
        remote.sdo.RESPONSE_TIMEOUT = PATIENCE  # a loaded host takes longer than its 0.3 s
        for _ in range(TRIES):
            with suppress(canopen.SdoCommunicationError):  # the panel asks the same drive on the same channel
                return float(remote.sdo[index].raw)
        raise AssertionError(f"every one of {TRIES} answers to 0x{index:04X} was another client's")
    finally:
        network.disconnect()


def unpacked(text: str) -> NDArray[np.float32]:
    """What the panel packs for a curve."""
    return np.frombuffer(base64.b64decode(text), "<f4")
