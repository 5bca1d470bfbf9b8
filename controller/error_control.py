"""Error control both ways: drives' heartbeats for the controller, the controller's heartbeat or SYNC for the drives."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.liveness import BASE_COB_ID, OPERATIONAL
from drivetwin.foundation.errors import UserError

NODE_ID = 0x7F
"""The controller's own, under which it beats."""

HEARTBEAT = bytes((OPERATIONAL,))
HEARTBEAT_COB_ID = BASE_COB_ID + NODE_ID

BEAT_EVERY = 0.05
"""Heartbeat time of the controller [s]."""

NODE_BEATS_EVERY = 0.1
"""Heartbeat time of a drive (1017h) [s]."""

NODE_IS_LOST_AFTER = 0.25
"""Two heartbeats of a drive that did not come, and half of one's time for a late one [s]."""

CONTROLLER_IS_LOST_AFTER = 0.2
"""After so long without the controller's heartbeat, or its SYNC, a drive stops by itself [s]: some times what a loaded host
stalls a process for."""

SYNC_TIMEOUT = 1
"""Of `bus_timeout_type` (280Dh of a ServoOne): supervision of SYNC."""


def set_error_control(drive: DriveNode) -> None:
    """Let a drive beat, and watch the controller: by 1016h, or by SYNC where its type has only that.

    Raises UserError where the drive refuses it.
    """
    milliseconds = round(CONTROLLER_IS_LOST_AFTER * 1e3)
    drive.write(round(NODE_BEATS_EVERY * 1e3), 0x1017)
    if consumes_heartbeats(drive):
        drive.write(NODE_ID << 16 | milliseconds, 0x1016, 1)
        return
    drive.write_role("bus_timeout", milliseconds)
    drive.write_role("bus_timeout_type", SYNC_TIMEOUT)


def release_error_control(drives: Sequence[DriveNode]) -> None:
    """The controller leaves the bus on purpose: no drive is to miss its heartbeat. One that is gone is passed over.

    Supervision of SYNC stays: it acts on an enabled drive only.
    """
    for drive in drives:
        if drive.answers and consumes_heartbeats(drive):
            with suppress(UserError):
                drive.write(0, 0x1016, 1)


def consumes_heartbeats(drive: DriveNode) -> bool:
    """Whether the drive type has a heartbeat consumer."""
    return drive.has(0x1016, 1)
