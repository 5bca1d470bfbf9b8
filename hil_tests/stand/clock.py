"""The clock of a case in lockstep: SYNC moves time while the controller is there, afterwards it goes on by itself."""

from __future__ import annotations

from emulator.clock import SyncClock


class StandClock(SyncClock):
    """As `SyncClock` until `free`; from then on a cycle is due whenever the stand asks."""

    def __init__(self) -> None:
        self.free = False

    def cycles_due(self, cycle: float) -> int:
        return 1 if self.free else 0
