"""The panel on a drive's one SDO channel beside another master, judged by the frames on the bus."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.panel import door as door_module
from drivetwin.panel.door import SdoChannel
from drivetwin.panel.link import Link

NODE = 1
ANSWER = bytes((0x4B, 0x41, 0x60, 0)) + bytes((0x27, 0x02, 0, 0))
"""6041h is 0227h (CiA 301, 7.2.4.3.6)."""


def frame(identifier: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False, timestamp=1.0)


class ScriptedBus(can.BusABC):
    """`script` says what comes next: frames, or None where the bus is silent for a moment; `sent` is what the panel sent."""

    def __init__(self, script: list[can.Message | None]) -> None:
        super().__init__(channel="scripted")
        self.channel_info = "scripted"
        self.sent: list[can.Message] = []
        self.order: list[str] = []
        self.on_sent: Callable[[can.Message], list[can.Message]] = lambda _: []
        self._script = deque(script)
        self._came = threading.Condition()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        with self._came:
            if not self._script:
                self._came.wait(timeout)
            message = self._script.popleft() if self._script else None
        if message is not None:
            self.order.append(f"{message.arbitration_id:03X} came")
        return message

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        with self._came:
            self.sent.append(msg)
            self.order.append(f"{msg.arbitration_id:03X} sent")
            self._script.extend(self.on_sent(msg))
            self._came.notify()


@contextmanager
def channel(bus: ScriptedBus) -> Iterator[SdoChannel]:
    with Link(bus) as link:
        yield SdoChannel(link)


def foreign(index: int) -> can.Message:
    """An upload that another master asks for."""
    return frame(0x600 + NODE, bytes((0x40,)) + index.to_bytes(2, "little") + bytes(5))


def test_what_waits_to_be_heard_is_heard_before_the_panel_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred frames behind, the last of them another master's request: the panel asks after its answer."""
    monkeypatch.setattr(door_module, "QUIET", 0.0)
    behind = [frame(0x181, bytes(8))] * 100
    bus = ScriptedBus([*behind, foreign(0x6060), *behind, frame(0x580 + NODE, bytes((0x4F, 0x60, 0x60, 0)) + bytes(4))])
    bus.on_sent = lambda _: [frame(0x580 + NODE, ANSWER)]
    with channel(bus) as door:
        assert door.read(NODE, 0x6041, 0) == bytes((0x27, 0x02))
    assert bus.order[-2:] == ["601 sent", "581 came"]
    assert bus.order.count("181 came") == 200


def test_a_request_that_has_no_answer_yet_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door_module, "PATIENCE", 0.3)
    monkeypatch.setattr(door_module, "QUIET", 0.0)
    bus = ScriptedBus([None, foreign(0x6060)])
    with channel(bus) as door, pytest.raises(UserError, match="another master asks this drive by SDO without a pause"):
        _late(door, bus)
    assert not bus.sent


def _late(door: SdoChannel, bus: ScriptedBus) -> None:
    """Ask once the other's request has passed."""
    while "601 came" not in bus.order:
        threading.Event().wait(0.001)
    door.read(NODE, 0x6041, 0)


def test_a_drive_that_does_not_answer_is_asked_once_and_told_no_abort(monkeypatch: pytest.MonkeyPatch) -> None:
    """An abort of the panel could end the transfer of another master."""
    monkeypatch.setattr(door_module._ModestClient, "RESPONSE_TIMEOUT", 0.05)
    bus = ScriptedBus([])
    with channel(bus) as door, pytest.raises(UserError, match="No SDO response received"):
        door.read(NODE, 0x6041, 0)
    assert [bytes(message.data) for message in bus.sent] == [bytes((0x40, 0x41, 0x60, 0, 0, 0, 0, 0))]


def test_a_long_value_is_given_up_where_another_master_asks_meanwhile() -> None:
    """The answer to the first frame of the transfer comes behind another master's request: no segment is asked for."""
    bus = ScriptedBus([])
    size = (20).to_bytes(4, "little")
    bus.on_sent = lambda _: [foreign(0x6060), frame(0x580 + NODE, bytes((0x41, 0x08, 0x10, 0)) + size)]
    with channel(bus) as door, pytest.raises(UserError, match="another master has asked this drive meanwhile"):
        door.read(NODE, 0x1008, 0)
    assert len(bus.sent) == 1
