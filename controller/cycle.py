"""The communication cycle: set-points out, SYNC, actual values in; the same on every bus and clock."""

from __future__ import annotations

import time
from collections.abc import Sequence

from controller.drive_node import DriveNode
from controller.link import SYNC_COB_ID, Link
from controller.pacing import Pacing
from drivetwin.errors import UserError

ANSWER_TIMEOUT = 2.0
"""Longest wait for the drives' answers to a SYNC [s]; they come within a cycle, a loaded host may be late."""

FAULT_STATE = 0x0008
FAULT_MASK = 0x000F


class DriveFaultError(UserError):
    """A drive has left operation by itself."""


class Cycle:
    """Runs cycles of `period` seconds over all drives."""

    def __init__(self, link: Link, drives: Sequence[DriveNode], pacing: Pacing, period: float = 0.001) -> None:
        self.period = period
        self.count = 0
        self._link = link
        self._drives = drives
        self._pacing = pacing

    def run(self) -> None:
        """One cycle: outputs of every drive, SYNC, and every drive's input.

        Raises DriveFaultError where a drive reports a fault or an emergency, UserError where one does not answer.
        """
        self._pacing.wait(self.period)
        for drive in self._drives:
            drive.send_output()
        self._link.send(SYNC_COB_ID, b"")
        self.count += 1
        self._await_inputs()
        for drive in self._drives:
            if drive.emergencies:
                raise _fault(drive)

    def run_for(self, seconds: float) -> None:
        """Cycles with the outputs as they are."""
        for _ in range(round(seconds / self.period)):
            self.run()

    def _await_inputs(self) -> None:
        deadline = None
        for drive in self._drives:
            wanted = self.count
            while drive.received < wanted:
                if self._link.pump(0.02):
                    continue
                now = time.monotonic()
                deadline = now + ANSWER_TIMEOUT if deadline is None else deadline
                if now > deadline:
                    raise UserError(
                        f"{drive.where()} sent no PDO for {ANSWER_TIMEOUT:g} s after a SYNC: is it still operational? "
                        "If the emulator runs with --clock sync, give the controller --clock sync as well"
                    )

    def start(self) -> None:
        """Count inputs from here."""
        self.count = 0
        for drive in self._drives:
            drive.received = 0
            drive.emergencies.clear()


def _fault(drive: DriveNode) -> DriveFaultError:
    emergency = drive.emergencies[0]
    return DriveFaultError(
        f"{drive.where()} reports EMCY {emergency.code:04X}h (statusword {drive.statusword:04X}h); all axes were stopped"
    )
