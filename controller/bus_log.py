"""Every frame that the controller sends and receives, as a candump log, so that an engineer can check any figure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import TracebackType

import can

from drivetwin.bus.candump import candump_line


class BusLog:
    """Writes frames as `candump -L` does, stamped by `now` [s]: the controller's own clock, simulated or real."""

    def __init__(self, path: Path, channel: str, now: Callable[[], float]) -> None:
        self._stream = path.open("w", encoding="ascii")
        self._channel = channel if channel.isalnum() else "ws0"  # a log names an interface, not an address
        self._now = now

    def __enter__(self) -> BusLog:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._stream.close()

    def frame(self, message: can.Message) -> None:
        """Add one frame."""
        requested = message.dlc if message.is_remote_frame else None
        identifier, extended = message.arbitration_id, message.is_extended_id
        self._stream.write(candump_line(self._now(), self._channel, identifier, message.data, requested, extended))
