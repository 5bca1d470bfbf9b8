"""Every frame of a case in order: for the judges, and as a candump log for readers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import can

from drivetwin.bus.candump import candump_line
from drivetwin.bus.timing.wire import Transmission
from drivetwin.emulator.timed_bus.line import CONTROLLER
from drivetwin.foundation.files import new_file
from drivetwin.hil_tests.evidence import BusFrame

CHANNEL = "bus0"
"""How the log names the bus, whatever its address is: the same in every run."""


class FrameLog:
    """Notes frames by the simulated time `now` [s]; `wall` is the wall-clock time since power on [s], or 0.

    With bit timing `of_wire` notes each when it is whole, by the wire's time in the place of the wall clock's.
    """

    def __init__(self, now: Callable[[], float], wall: Callable[[], float]) -> None:
        self.frames: list[BusFrame] = []
        self._now = now
        self._wall = wall

    def of_controller(self, message: can.Message) -> None:
        """A frame that the controller sent."""
        self._note(message, by_controller=True)

    def of_drive(self, message: can.Message) -> None:
        """A frame that a drive sent."""
        self._note(message, by_controller=False)

    def of_wire(self, whole: Transmission) -> None:
        """A frame that is whole on the wire."""
        frame, sent = whole.frame, whole.sender == CONTROLLER
        self.frames.append(BusFrame(self._now(), frame.identifier, frame.data, sent, frame.requested, whole.received))

    def _note(self, message: can.Message, by_controller: bool) -> None:
        requested = message.dlc if message.is_remote_frame else None
        data = bytes(message.data)
        self.frames.append(BusFrame(self._now(), message.arbitration_id, data, by_controller, requested, self._wall()))


def write_log(frames: Sequence[BusFrame], path: Path) -> None:
    """Write the frames as `candump -L` does, stamped by simulated time."""
    with new_file(path) as part, part.open("w", encoding="ascii") as stream:
        for frame in frames:
            stream.write(candump_line(frame.time, CHANNEL, frame.identifier, frame.data, frame.requested))
