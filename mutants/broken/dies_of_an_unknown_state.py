"""Looks up the NMT state of every heartbeat in a table, and crashes on a state that is not in it."""

from __future__ import annotations

from drivetwin.controller.liveness import NMT_STATES, Liveness
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.frames_corrupted", "outcome")


@instead_of(Liveness, "take")
def break_controller(take: Original, self: Liveness, data: bytes) -> None:
    take(self, data)
    if self.state is not None:
        NMT_STATES[self.state]
