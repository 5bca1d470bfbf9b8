"""A listener lets the master of a bus finish before it asks a drive, and gives up where there is no pause."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import can
import pytest

from drivetwin.bus.listening import PATIENCE, QUIET, Listener

NODE = 5


class Polled:
    """A bus on which a master asks node 5 every `period` [s] of its own clock, and nobody answers."""

    def __init__(self, period: float) -> None:
        self.period, self.time, self.due = period, 0.0, period
        self.sent: list[float] = []

    def recv(self, seconds: float) -> can.Message | None:
        if self.time + seconds < self.due:
            self.time += max(seconds, 1e-3)
            return None
        self.time, self.due = self.due, self.due + self.period
        return can.Message(arbitration_id=0x600 + NODE, data=bytes(8), is_extended_id=False)

    def send(self, _message: can.Message) -> None:
        self.sent.append(self.time)


@pytest.mark.parametrize(("period", "asked"), [(0.4 * QUIET, False), (4.0 * QUIET, True)])
def test_no_drive_is_asked_while_its_master_asks_it(tmp_path: Path, period: float, asked: bool) -> None:
    bus = Polled(period)
    with Listener(cast("Any", bus), tmp_path / "bus.log", now=lambda: bus.time) as listener:
        listener.listen(2.0 * period, lambda: False)
        assert not listener.ask_scales(NODE, lambda: False)
    assert bool(bus.sent) == asked
    assert all(time % period > 0.99 * QUIET for time in bus.sent)


def test_whoever_ends_it_does_not_wait_for_drives_that_are_silent(tmp_path: Path) -> None:
    """Ctrl-C comes while the first of some fifty objects is asked for, each of which may take PATIENCE and PATIENCE again."""
    bus = Polled(1e9)
    with Listener(cast("Any", bus), tmp_path / "bus.log", now=lambda: bus.time) as listener:
        listener.ask_scales(NODE, lambda: bus.time > 0.5 * PATIENCE)
    assert bus.sent == [0.0]
    assert bus.time < PATIENCE
