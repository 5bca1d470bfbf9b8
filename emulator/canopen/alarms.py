"""What a node has to do at a certain time: one comparison a tick while nothing is due."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from drivetwin.emulator.canopen.timing import TOLERANCE


class Alarm:
    """Calls `ring` with the time once `due` [s] has come; it has to be set anew to ring again."""

    __slots__ = ("_alarms", "_ring", "due")

    def __init__(self, alarms: Alarms, ring: Callable[[float], None]) -> None:
        self._alarms = alarms
        self._ring = ring
        self.due = inf

    def set(self, due: float) -> None:
        """Ring at `due` instead of any earlier arrangement; inf: not at all."""
        self.due = due
        self._alarms.due = min(self._alarms.due, due - TOLERANCE)

    def stop(self) -> None:
        """Do not ring."""
        self.due = inf

    def ring(self, now: float) -> None:
        """It is due."""
        self.due = inf
        self._ring(now)


class Alarms:
    """All alarms of one node. `due` is the earliest time at which one of them may ring [s]."""

    def __init__(self) -> None:
        self._alarms: list[Alarm] = []
        self.due = inf

    def add(self, ring: Callable[[float], None]) -> Alarm:
        """A new alarm, not yet set."""
        alarm = Alarm(self, ring)
        self._alarms.append(alarm)
        return alarm

    def tick(self, now: float) -> None:
        """Ring what is due, in the order in which the alarms were added."""
        for alarm in self._alarms:
            if alarm.due - TOLERANCE <= now:
                alarm.ring(now)
        self.due = min((alarm.due for alarm in self._alarms), default=inf) - TOLERANCE
