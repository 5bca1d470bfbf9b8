"""The clock of a case in lockstep: SYNC advances time while the controller runs; afterwards time advances by itself."""

from __future__ import annotations

from collections.abc import Iterable

from drivetwin.emulator.clock import Cycle, SyncClock


class StandClock(SyncClock):
    """As `SyncClock` until `free`; from then on a cycle is due whenever the stand asks."""

    def __init__(self) -> None:
        self.free = False

    def due(self, told: int) -> Iterable[Cycle]:
        return self.at_sync(told) if self.free else ()
