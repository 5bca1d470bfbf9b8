"""The time from one SYNC to the next: from 1006h, or measured by the wall clock where 1006h is 0."""

from __future__ import annotations

from collections import deque

from drivetwin.emulator.drive.servo import SERVO_PERIOD

MILLISECOND = round(0.001 / SERVO_PERIOD)
"""In servo periods; the period of SYNC until there is another reason."""

WINDOW, FEWEST = 0.25, 8
"""The mean is that of a quarter of a second, of eight intervals at least."""

JITTER = 0.004
"""How much earlier or later than its master's beat a SYNC may come [s]: a loaded host's."""

SLOWER, FASTER = 1.01, 0.999
"""Shares of the present period within which the mean leaves it as it is: a sleep that is too long is no other period."""

BELIEF, DOUBT_AFTER = 2.5, 0.2
"""A period by 1006h is believed until SYNCs have come so much more slowly for so long [s], as a stall is no other period."""

PAUSE, SILENCE = 3.0, 0.05
"""After so many periods without a SYNC, and so many seconds, the master has paused: that interval is no period."""


class SyncPeriod:
    """Measures from SYNC to SYNC on the wall clock [s]; periods are in whole servo periods."""

    def __init__(self) -> None:
        self.periods = MILLISECOND
        self._told = 0
        self._is_told = False
        self._times: deque[float] = deque()

    def came(self, now: float, told: int) -> int:
        """A SYNC came at `now` [s], and 1006h is `told` servo periods (0: it tells nothing); the period as it is known now."""
        if told != self._told:
            self._told, self._is_told = told, told > 0
            self.periods = told or MILLISECOND
            self._times.clear()
        self._note(now)
        intervals = len(self._times) - 1
        if intervals > 0:
            self._judge((now - self._times[0]) / intervals, JITTER / intervals)
        return self.periods

    def _note(self, now: float) -> None:
        times = self._times
        intervals = len(times) - 1
        if intervals > 0 and now - times[-1] > max(SILENCE, PAUSE * (times[-1] - times[0]) / intervals):
            times.clear()
        times.append(now)
        while len(times) > FEWEST + 1 and now - times[0] > WINDOW:
            times.popleft()

    def _judge(self, mean: float, doubt: float) -> None:
        """Keep the period where a mean [s] that may be wrong by `doubt` [s] goes with it."""
        period = self.periods * SERVO_PERIOD
        if self._is_told and (mean <= BELIEF * period or self._times[-1] - self._times[0] < DOUBT_AFTER):
            return
        if not self._is_told and _goes_with(period, mean, doubt):
            return
        self._is_told = False
        self.periods = _simplest(mean, doubt)


def _goes_with(period: float, mean: float, doubt: float) -> bool:
    return FASTER * period - doubt <= mean <= SLOWER * period + doubt


def _simplest(mean: float, doubt: float) -> int:
    """The nearest whole millisecond if it goes with the mean, else the whole servo periods below it."""
    milliseconds = round(mean / (MILLISECOND * SERVO_PERIOD))
    if milliseconds > 0 and _goes_with(milliseconds * MILLISECOND * SERVO_PERIOD, mean, doubt):
        return milliseconds * MILLISECOND
    return max(1, int(mean / SERVO_PERIOD))
