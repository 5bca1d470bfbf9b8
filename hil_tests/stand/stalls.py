"""Records in real time when the stand itself stalled: the host did not run it, so its drives were late."""

from __future__ import annotations

import time
from collections.abc import Callable

from drivetwin.hil_tests.evidence import Stall

HOST = "host"
"""What a case fails for where it was rejected and the stand had stood still."""

LONGEST = 0.02
"""What is no stall [s]: a controller may take a drive that answers later than that for dead."""

LATE, SHARE = 0.001, 0.01
"""What no turn of the loop should last [s], and the share of the time that is looked at beyond it."""


class Stalls:
    """Looked at in every turn of the stand's loop, which waits for a frame for half a millisecond at most."""

    def __init__(self, simulated: Callable[[], float], wall: Callable[[], float] = time.monotonic) -> None:
        self._simulated, self._wall = simulated, wall
        self._last = wall()
        self._turns: list[float] = []
        self._whole = 0.0
        self.found: list[Stall] = []

    def begin(self) -> None:
        """The loop begins; what was before it is no stall."""
        self._last = self._wall()

    def look(self) -> None:
        """A turn of the loop is done."""
        before, self._last = self._last, self._wall()
        lasted = self._last - before
        self._whole += lasted
        if lasted > LATE:
            self._turns.append(lasted)
        if lasted > LONGEST:
            self.found.append(Stall(self._simulated(), lasted))

    @property
    def late(self) -> float:
        """Turns at least as long as this took one per cent of the time [s]; 0 where those above `LATE` took less."""
        taken = 0.0
        for lasted in sorted(self._turns, reverse=True):
            taken += lasted
            if taken > SHARE * self._whole:
                return lasted
        return 0.0
