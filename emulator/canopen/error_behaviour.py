"""What the node does to itself when its communication fails (CiA 301, 7.5.2.32, 1029h)."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from drivetwin.emulator.canopen.nmt import Nmt, NmtState
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary


class Reaction(IntEnum):
    """Values of 1029h:01 (communication error)."""

    PRE_OPERATIONAL_IF_OPERATIONAL = 0
    NONE = 1
    STOPPED = 2


class ErrorBehaviour:
    """The NMT state that follows a heartbeat event, a life guarding event or bus off; a drive without 1029h acts as by 0.

    `on_error` callbacks hear of it before, with its error code (CiA 301, table 26).
    """

    def __init__(self, od: ObjectDictionary, nmt: Nmt) -> None:
        self._nmt = nmt
        self._parameter = od.get((0x1029, 1))
        self.on_error: list[Callable[[int], None]] = []

    def communication_error(self, code: int) -> None:
        """React to the error `code` as 1029h:01 says."""
        for callback in self.on_error:
            callback(code)
        reaction = Reaction(self._parameter.number) if self._parameter is not None else Reaction(0)
        if reaction is Reaction.STOPPED:
            self._nmt.enter(NmtState.STOPPED)
        elif reaction is Reaction.PRE_OPERATIONAL_IF_OPERATIONAL and self._nmt.state is NmtState.OPERATIONAL:
            self._nmt.enter(NmtState.PRE_OPERATIONAL)
