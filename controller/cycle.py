"""The communication cycle: set-points out, SYNC, actual values in; the same on every bus and clock."""

from __future__ import annotations

import time
from collections.abc import Sequence

from controller.drive_node import OPERATION_ENABLED, DriveNode
from controller.link import SYNC_COB_ID, Link
from controller.pacing import Pacing
from drivetwin.errors import UserError

HINTS = {
    0x8611: ", following error: is the axis blocked, or its torque limit too low for gravity and friction?",
    0x8130: ", heartbeat or guarding lost",
    0x2310: ", overcurrent",
    0x2350: ", I2t: more torque for longer than the motor bears",
    0x3220: ", undervoltage of the DC link",
}
"""What the commonest error codes say (CiA 402-2, table 'Error codes')."""


class DriveFaultError(UserError):
    """A drive has left operation by itself, or told an emergency."""


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

        Raises DriveFaultError where a drive reports an emergency or has left operation by itself, UserError where one does
        not answer. Each is raised once; a drive that was silent is not waited for again.
        """
        self._pacing.wait(self.period)
        self._link.drain()
        for drive in self._drives:
            if drive.received > 1:
                raise _extra(drive)
            drive.received = 0
            drive.send_output()
        self._link.send(SYNC_COB_ID, b"")
        self.count += 1
        self._await_inputs()
        for drive in self._drives:
            if drive.emergencies or (drive.operating and drive.state != OPERATION_ENABLED):
                raise _fault(drive)
            if drive.outside:
                raise _outside(drive)

    def run_for(self, seconds: float) -> None:
        """Cycles with the outputs as they are."""
        for _ in range(round(seconds / self.period)):
            self.run()

    def _await_inputs(self) -> None:
        deadline = None
        for drive in self._drives:
            while drive.received == 0 and drive.answers:
                if self._link.pump(0.02):
                    continue
                now = time.monotonic()
                deadline = now + self._pacing.answer_timeout if deadline is None else deadline
                if now > deadline:
                    raise self._silent()

    def _silent(self) -> UserError:
        silent = [drive for drive in self._drives if drive.received == 0 and drive.answers]
        for drive in silent:
            drive.answers = False
        names = ", ".join(drive.where() for drive in silent)
        return UserError(
            f"{names} sent no PDO for {self._pacing.answer_timeout:g} s after a SYNC: is it powered, connected, operational?"
        )

    def start(self) -> None:
        """Count cycles from here."""
        self.count = 0
        for drive in self._drives:
            drive.received = 0
            drive.answers = True
            drive.emergencies.clear()


def _extra(drive: DriveNode) -> UserError:
    count, drive.received = drive.received, 0
    return UserError(
        f"{drive.where()} sent {count} PDOs for one SYNC: is there a second SYNC producer on the bus, or a second device with "
        f"node-ID {drive.node_id}?"
    )


def _outside(drive: DriveNode) -> UserError:
    low, high = (limit * drive.unit for limit in drive.allowed or (0, 0))
    drive.allowed = None
    return UserError(
        f"{drive.where()} is at {drive.position * drive.unit:.6g}, outside {low:.6g} .. {high:.6g} that it may use"
    )


def _fault(drive: DriveNode) -> DriveFaultError:
    drive.operating = False
    if not drive.emergencies:
        return DriveFaultError(f"{drive.where()} has left operation by itself (statusword {drive.statusword:04X}h)")
    codes = ", ".join(f"{emergency.code:04X}h" for emergency in drive.emergencies)
    hint = next((HINTS[emergency.code] for emergency in drive.emergencies if emergency.code in HINTS), "")
    drive.emergencies.clear()
    return DriveFaultError(f"{drive.where()} reports EMCY {codes}{hint} (statusword {drive.statusword:04X}h)")
