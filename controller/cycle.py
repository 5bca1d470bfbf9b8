"""The communication cycle: set-points out, SYNC, actual values in, a check of each drive; the same on every bus and clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.error_control import BEAT_EVERY, HEARTBEAT, HEARTBEAT_COB_ID, consumes_heartbeats
from drivetwin.controller.link import SYNC_COB_ID, Link
from drivetwin.controller.pacing import Found, Pacing
from drivetwin.controller.supervision import Watch, supervise


class Cycle:
    """Runs cycles of `period` seconds over all drives."""

    def __init__(self, link: Link, drives: Sequence[DriveNode], pacing: Pacing, period: float = 0.001) -> None:
        self.period = period
        self.count = 0
        self.missed = 0
        """Samples that did not come."""
        self._link = link
        self._drives = drives
        self._pacing = pacing
        self._watches = [Watch(drive, period) for drive in drives]
        self._beat_every = max(1, round(BEAT_EVERY / period))
        self._beats = any(consumes_heartbeats(drive) for drive in drives)

    def run(self) -> None:
        """One cycle: outputs of every drive, SYNC, and every drive's input; then every drive is looked at.

        Raises TroubleError for what `supervision` finds, each thing once; a drive that was silent is not waited for again.
        """
        self._pacing.wait(self.period)
        self._link.drain()
        for watch in self._watches:
            if watch.drive.received > 1:
                watch.close()
        for drive in self._drives:
            drive.received = 0
            drive.send_output()
        if self._beats and self.count % self._beat_every == self._beat_every // 2:  # between the drives' heartbeats
            self._link.send(HEARTBEAT_COB_ID, HEARTBEAT)
        elapsed = self._pacing.lap(self.period)
        self._link.send(SYNC_COB_ID, b"")
        self.count += 1
        self._await_inputs()
        for watch in self._watches:
            supervise(watch, elapsed)

    def run_for(self, seconds: float) -> None:
        """Cycles with the outputs as they are."""
        for _ in range(round(seconds / self.period)):
            self.run()

    def meanwhile(self, compute: Callable[[], Found]) -> Found:
        """The result of a computation; where time is real, cycles go on with the outputs as they are."""
        return self._pacing.meanwhile(compute, self.run)

    def start(self) -> None:
        """Count cycles from here, and let whoever waits for an SDO answer run them."""
        self.count = self.missed = 0
        self._link.cycle = self._run_while_waiting
        for drive in self._drives:
            self.welcome(drive)

    def stop(self) -> None:
        """No cycles any more: SDO goes without them."""
        self._link.cycle = None

    def welcome(self, drive: DriveNode) -> None:
        """Count a drive that was configured among those that answer."""
        drive.received = 0
        drive.answers = True
        drive.emergencies.clear()
        next(watch for watch in self._watches if watch.drive is drive).begin()

    def _run_while_waiting(self) -> float:
        self.run()
        return self.period

    def _await_inputs(self) -> None:
        """The answers to one SYNC come together: once one is there, the others are waited for only shortly.

        So is a drive that did not answer the last SYNC: a dead one costs one long wait.
        """
        patience = self._pacing.first_answer
        for watch in self._watches:
            if watch.missed:
                patience = self._pacing.further_answer
            while watch.drive.received == 0 and watch.drive.answers:
                if not self._link.await_frame(patience):
                    self.missed += 1
                    break
                patience = self._pacing.further_answer
