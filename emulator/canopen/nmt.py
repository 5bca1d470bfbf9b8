"""Who may talk when: the NMT slave's state machine (CiA 301, 7.2.8.3.1 and 7.3.2)."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from drivetwin.foundation.enums import quick

COB_ID = 0x000


@quick
class NmtState(IntEnum):
    """NMT states, by the code that heartbeat sends (CiA 301, 7.2.8.3.2.2)."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """Command specifiers of the NMT master (CiA 301, 7.2.8.3.1)."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


_TARGETS = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


class Nmt:
    """State of one node. `on_change` callbacks get each new state, `on_reset_...` do what the two resets ask."""

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.state = NmtState.INITIALISING
        self.on_change: list[Callable[[NmtState], None]] = []
        self.on_reset_node: list[Callable[[], None]] = []
        self.on_reset_communication: list[Callable[[], None]] = []

    @property
    def communicating(self) -> bool:
        """Whether SDO and EMCY may be sent: pre-operational and operational (CiA 301, 7.3.2.2.5)."""
        return self.state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL)

    def receive(self, data: bytes) -> None:
        """Obey a master's command to this node or to all (node-ID 0); anything else is not for this node."""
        if len(data) != 2 or data[1] not in (0, self.node_id) or data[0] not in set(NmtCommand):
            return
        command = NmtCommand(data[0])
        if command is NmtCommand.RESET_NODE:
            _call(self.on_reset_node)
        elif command is NmtCommand.RESET_COMMUNICATION:
            _call(self.on_reset_communication)
        else:
            self.enter(_TARGETS[command])

    def enter(self, state: NmtState) -> None:
        """Change to `state` and tell it; a state that is already there is not entered again."""
        if state is self.state:
            return
        self.state = state
        for callback in self.on_change:
            callback(state)


def _call(callbacks: list[Callable[[], None]]) -> None:
    for callback in callbacks:
        callback()
