"""Ends a controller that hangs, floods the bus or never finishes; by the wall clock only while it is silent."""

from __future__ import annotations

import time

from drivetwin.hil_tests.bench import Timeouts
from drivetwin.hil_tests.evidence import Ending

FEWEST_BITS = 47
"""Of a frame: no data, no stuff bits."""


class Watchdog:
    """Watches one start of the controller on a wire of `bit_rate` [bit/s].

    A flood is more frames than the wire could carry, for more than a second of simulated time; before time moves, more than
    fill a second.
    """

    def __init__(self, timeouts: Timeouts, silence: float, bit_rate: int, began: float) -> None:
        """`began` is simulated time [s]."""
        self._timeouts = timeouts
        self._silence = silence
        self._began = began
        self._rate = bit_rate / FEWEST_BITS
        self._allowed = self._rate
        self._time = began
        self._heard = time.monotonic()
        self._joined = False

    def frame(self, now: float) -> Ending | None:
        """The controller sent a frame at simulated time `now` [s]: what it has to be ended for, None: nothing."""
        self._joined = True
        self._heard = time.monotonic()
        self._allowed = min(self._rate, self._allowed + (now - self._time) * self._rate) - 1.0
        self._time = now
        if self._allowed < 0.0:
            return Ending.FLOODS
        return Ending.NEVER_ENDS if now - self._began > self._timeouts.simulated else None

    def silence(self, now: float) -> Ending | None:
        """It sent none while the stand listened: what it has to be ended for, None: nothing."""
        waited = time.monotonic() - self._heard
        if waited > (self._silence if self._joined else self._timeouts.start):
            return Ending.HANGS if self._joined else Ending.NEVER_STARTED
        return Ending.NEVER_ENDS if now - self._began > self._timeouts.simulated else None

    def told(self, ending: Ending) -> str:
        """What an ending by the watchdog means, for the report."""
        return {
            Ending.FLOODS: "it sent more frames than the wire carries, for more than a second",
            Ending.NEVER_ENDS: f"its task went on for more than {self._timeouts.simulated:g} s of simulated time",
            Ending.HANGS: f"it lived but sent nothing for {self._silence:g} s",
            Ending.NEVER_STARTED: f"it sent no frame within {self._timeouts.start:g} s of its start",
        }.get(ending, "")
