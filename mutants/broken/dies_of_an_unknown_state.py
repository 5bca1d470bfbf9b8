"""Looks up the NMT state of every heartbeat in a table, and crashes on a state that is not in it."""

from __future__ import annotations

from drivetwin.controller.liveness import NMT_STATES, Liveness
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.frames_corrupted", "outcome")


def break_controller() -> None:
    take = Liveness.take

    def broken(self: Liveness, data: bytes) -> None:
        take(self, data)
        if self.state is not None:
            NMT_STATES[self.state]

    replace(Liveness, "take", broken)
