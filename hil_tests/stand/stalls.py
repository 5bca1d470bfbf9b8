"""Notes where the stand itself stood still in real time: its host did not run it, and its drives were late with everything."""

from __future__ import annotations

import time
from collections.abc import Callable

from hil_tests.evidence import Stall

HOST = "host"
"""What a case fails for where it was rejected and the stand had stood still."""

LONGEST = 0.02
"""What is no stall [s]: a controller may take a drive that answers later than that for dead."""


class Stalls:
    """Looked at in every turn of the stand's loop, which waits for a frame for half a millisecond at most."""

    def __init__(self, simulated: Callable[[], float], wall: Callable[[], float] = time.monotonic) -> None:
        self._simulated, self._wall = simulated, wall
        self._last = wall()
        self.found: list[Stall] = []

    def begin(self) -> None:
        """The loop begins; what was before it is no stall."""
        self._last = self._wall()

    def look(self) -> None:
        """A turn of the loop is done."""
        before, self._last = self._last, self._wall()
        lasted = self._last - before
        if lasted > LONGEST:
            self.found.append(Stall(self._simulated(), lasted))
