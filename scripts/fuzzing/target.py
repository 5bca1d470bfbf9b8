"""The emulator under fire: three drives on the SCARA's plant, what they sent, and the last frames, to reproduce a failure."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from pathlib import Path

import can

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import Cycle, SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.files import new_file

REMEMBERED = 200
"""Frames that a log of a failure holds, those of the drives among them."""

Event = can.Message | None
"""A frame of the bus; None: a communication cycle passes without one."""


class GrantedClock(SyncClock):
    """Each SYNC is one cycle, and so is each that is granted without one."""

    def __init__(self) -> None:
        self.granted = 0

    def due(self, told: int) -> Iterable[Cycle]:
        granted, self.granted = self.granted, 0
        return [cycle for _ in range(granted) for cycle in self.at_sync(told)]


class Target:
    """Drives of a type on the SCARA, with a store, so that saving and restoring are under fire too.

    `answers` are the frames that the last event brought.
    """

    def __init__(self, profile: str, seed: int, store: Path) -> None:
        self.profile = load_profile(profile)
        machine = load_machine("scara")
        self._clock = GrantedClock()
        self.virtual = VirtualMachine(
            machine, self.profile, read_effects(machine.effects_path), self._clock, seed, self._take, store
        )
        self.answers: list[can.Message] = []
        self._log: deque[str] = deque(maxlen=REMEMBERED)
        self.virtual.power_on()

    def give(self, event: Event) -> list[can.Message]:
        """Let one event happen; what the drives sent because of it."""
        self.answers = []
        if event is None:
            self._log.append(f"({self.virtual.now():.6f}) can0 # a cycle passes")
            self._clock.granted = 1
            self.virtual.poll()
        else:
            self._log.append(candump(event, self.virtual.now()))
            self.virtual.receive(event)
        return self.answers

    def write_log(self, path: Path) -> None:
        """The last frames, as `candump -L` writes them."""
        with new_file(path) as part:
            part.write_text("".join(f"{line}\n" for line in self._log), encoding="ascii")

    def _take(self, message: can.Message) -> None:
        self.answers.append(message)
        self._log.append(candump(message, message.timestamp))


def candump(message: can.Message, time: float) -> str:
    """A line of a candump log."""
    wide = message.is_extended_id or message.is_error_frame
    identifier = message.arbitration_id | (0x20000000 if message.is_error_frame else 0)
    content = f"R{message.dlc}" if message.is_remote_frame else bytes(message.data).hex().upper()
    separator = "##0" if message.is_fd else "#"
    return f"({time:.6f}) can0 {identifier:0{8 if wide else 3}X}{separator}{content}"
