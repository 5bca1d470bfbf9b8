"""Starts and ends the faults of a scenario at their times."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.hil_tests.conditions import Glance
from drivetwin.hil_tests.evidence import Struck
from drivetwin.hil_tests.scenario import PlannedFault


class Striker:
    """Asked after each frame and each cycle; `kill` lets the controller die."""

    def __init__(self, planned: Sequence[PlannedFault], virtual: VirtualMachine, kill: Callable[[], None]) -> None:
        self._planned = tuple(planned)
        self._virtual = virtual
        self._kill = kill
        self._due: list[float | None] = [None] * len(planned)
        self._struck: list[float | None] = [None] * len(planned)
        self._waiting = list(range(len(planned)))
        self._lasting: list[int] = []

    def look(self, now: Glance) -> None:
        """Strike what is due, end what has lasted long enough."""
        for place in tuple(self._waiting):
            if self._due[place] is None and self._planned[place].when.holds(now):
                self._due[place] = now.time + self._planned[place].after
            due = self._due[place]
            if due is not None and now.time >= due:
                self._strike(place, now.time)
        for place in tuple(self._lasting):
            if now.time >= (self._struck[place] or 0.0) + (self._planned[place].lasts or 0.0):
                self._end(place)

    def struck(self) -> tuple[Struck, ...]:
        """What became of each."""
        return tuple(Struck(plan.text, time) for plan, time in zip(self._planned, self._struck, strict=True))

    def _strike(self, place: int, time: float) -> None:
        self._waiting.remove(place)
        self._struck[place] = time
        fault = self._planned[place].fault
        if fault is None:
            self._kill()
            return
        fault.strike(self._virtual)
        if self._planned[place].lasts is not None:
            self._lasting.append(place)

    def _end(self, place: int) -> None:
        self._lasting.remove(place)
        fault = self._planned[place].fault
        if fault is not None:
            fault.end(self._virtual)
