"""What happens on a bus, in words and in order: states of the drives, EMCYs, boot-ups, and what the controller commands."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin.panel.bus_time import BusTime
from drivetwin.panel.frames import Frames, Samples
from drivetwin.panel.node_watch import STATUSWORD, NodeWatch
from drivetwin.panel.pdo_reading import Address
from drivetwin.panel.power_states import COMMANDS, power_state
from drivetwin.panel.words import NMT_COMMANDS, emergency_words

MOST = 200

CONTROLWORD = (0x6040, 0)

COMMAND_BITS = 0x8F
"""Bits of the controlword that are a command (CiA 402-2, table 'Command coding')."""

CONTROLLER, DRIVE, PANEL = "controller", "drive", "panel"


@dataclass(frozen=True)
class Happening:
    """`time` [s] of the bus, `who` did it, `node` whom it concerns."""

    time: float
    who: str
    node: str
    words: str


class Happenings:
    """The last `MOST`. `take` is called with the frames, `hear` with values, both in the thread of the bus."""

    def __init__(self, nodes: Mapping[int, NodeWatch], time: BusTime) -> None:
        self._nodes = nodes
        self._time = time
        self._said: dict[tuple[int, Address], str] = {}
        self.all: deque[Happening] = deque(maxlen=MOST)
        for node in nodes.values():
            node.hearers.append(self.hear)

    def note(self, who: str, node: str, words: str, at: float | None = None) -> None:
        """Something happened, now or a moment ago [s]."""
        self.all.append(Happening(self._time.now if at is None else at, who, node, words))

    def last_first(self) -> list[Happening]:
        """By their times."""
        return sorted(self.all.copy(), key=lambda one: one.time)[::-1]

    def take(self, frames: Frames) -> None:
        """EMCY, boot-up, NMT command of others."""
        for cob_id, places in frames.places.items():
            if cob_id == 0 or 0x81 <= cob_id <= 0xFF or 0x701 <= cob_id <= 0x77F:
                for place in places[~frames.own[places]].tolist():
                    self._take(cob_id, frames.content(place), float(frames.times[place]))

    def _take(self, cob_id: int, data: bytes, at: float) -> None:
        if cob_id == 0 and len(data) == 2:
            command = next((name for name, code in NMT_COMMANDS.items() if code == data[0]), f"{data[0]:02X}h")
            self.note(CONTROLLER, self._name(data[1]), f"NMT: {command}", at)
        elif 0x81 <= cob_id <= 0xFF and len(data) >= 3:
            code = int.from_bytes(data[:2], "little")
            self.note(DRIVE, self._name(cob_id - 0x80), f"EMCY {code:04X}h: {emergency_words(code)}", at)
        elif 0x701 <= cob_id <= 0x77F and data == b"\0":
            self.note(DRIVE, self._name(cob_id - 0x700), "boot-up", at)

    def hear(self, node_id: int, address: Address, times: Samples, values: Samples) -> None:
        """States that are others than before, commands that are."""
        if address not in (STATUSWORD, CONTROLWORD):
            return
        for place in (0, *(np.flatnonzero(np.diff(values)) + 1).tolist()):
            word = int(values[place])
            who, words = (DRIVE, power_state(word)) if address == STATUSWORD else (CONTROLLER, _command(word))
            if words is not None and self._said.get((node_id, address)) != words:
                self._said[node_id, address] = words
                self.note(who, self._name(node_id), words, float(times[place]))

    def _name(self, node_id: int) -> str:
        if node_id == 0:
            return "all"
        return self._nodes[node_id].name if node_id in self._nodes else f"node {node_id}"


def _command(word: int) -> str | None:
    """The command of a controlword: the one whose bits it has (bit 7: a reset; 0Fh: enable operation)."""
    if word & 0x80:
        return "Fault reset"
    wanted = word & COMMAND_BITS
    return next((command.name for command in COMMANDS if command.controlword == wanted), None)
