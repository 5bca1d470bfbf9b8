"""What happens on a bus, in words and in order: states of the drives, EMCYs, boot-ups, and what the controller commands."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import can

from drivetwin.panel.bus_time import BusTime
from drivetwin.panel.node_watch import STATUSWORD, NodeWatch
from drivetwin.panel.pdo_reading import Address
from drivetwin.panel.power_states import COMMANDS, power_state
from drivetwin.panel.values import Value
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
    """The last `MOST`. `take` is called with every frame, `hear` with every value, both in the thread of the bus."""

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

    def take(self, message: can.Message) -> None:
        """EMCY, boot-up, NMT command."""
        cob_id, data = message.arbitration_id, bytes(message.data)
        if message.is_remote_frame or message.is_extended_id:
            return
        if cob_id == 0 and len(data) == 2:
            command = next((name for name, code in NMT_COMMANDS.items() if code == data[0]), f"{data[0]:02X}h")
            self.note(CONTROLLER, self._name(data[1]), f"NMT: {command}")
        elif 0x81 <= cob_id <= 0xFF and len(data) >= 3:
            code = int.from_bytes(data[:2], "little")
            self.note(DRIVE, self._name(cob_id - 0x80), f"EMCY {code:04X}h: {emergency_words(code)}")
        elif 0x701 <= cob_id <= 0x77F and data == b"\0":
            self.note(DRIVE, self._name(cob_id - 0x700), "boot-up")

    def hear(self, node_id: int, address: Address, value: Value) -> None:
        """A state that is another than before, a command that is."""
        if isinstance(value, str) or address not in (STATUSWORD, CONTROLWORD):
            return
        who, words = (DRIVE, power_state(int(value))) if address == STATUSWORD else (CONTROLLER, _command(int(value)))
        if words is not None and self._said.get((node_id, address)) != words:
            self._said[node_id, address] = words
            self.note(who, self._name(node_id), words)

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
