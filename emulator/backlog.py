"""Frames that wait because the plant computes: how long that may be before the plant gives up time for them."""

from __future__ import annotations

import time
from collections.abc import Callable


class Backlog:
    """Tells when to hurry: frames have been waiting all along for `LONGEST`, until none waits or for as long again.

    So a frame waits for about `LONGEST` at most, unless frames alone are more than this computer can handle. Masters that keep
    frames waiting all the time leave the plant half of the time.
    """

    LONGEST = 0.05
    """[s]; a master's SDO timeout is 0.3 s and more."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._since = now()
        self._hurries = False

    def hurries(self, waits: bool) -> bool:
        """Whether to hurry now, where a frame waits or none does."""
        now = self._now()
        if not waits:
            self._since, self._hurries = now, False
        elif now - self._since > self.LONGEST:
            self._since, self._hurries = now, not self._hurries
        return self._hurries
