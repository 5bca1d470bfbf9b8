"""Recovery from trouble that can be cleared: returning nodes are configured, faults are reset; nothing is enabled here."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.motion import DISABLE_VOLTAGE, FAULT_RESET
from drivetwin.controller.session import Session
from drivetwin.controller.stop import stop
from drivetwin.controller.trouble import TroubleError
from drivetwin.foundation.errors import UserError

PATIENCE = 10.0
"""How long a node may take to come back, and a fault's cause to go [s]: of the plant's time."""

ASK_EVERY = 0.5
"""Between two resets of communication, to which a node that is there answers with its boot-up message [s]."""

RESET_EVERY = 0.2
"""Between two fault resets, each of which is a rising edge of bit 7 (CiA 402-2, transition 15) [s]."""

IN_FAULT = 1 << 3
"""Bit of the statusword that is set in fault and in fault reaction active."""


class GivenUpError(TroubleError):
    """Trouble that does not go away by waiting."""


def recover(session: Session) -> None:
    """Stop all axes; configure the drives that were lost, once they are back, and reset faults.

    A drive that was lost has to be homed again. Raises GivenUpError where one does not come back, or keeps its fault, and
    TroubleError for further trouble on the way.
    """
    cycle, drives = session.cycle, session.drives
    stop(cycle, drives)
    if lost := [drive for drive in drives if not _is_sound(drive)]:
        for drive in lost:
            drive.answers = drive.liveness.expected = drive.homed = False
            drive.liveness.beats, drive.allowed = 0, None
        _await(cycle, lost)
        _configure(session, lost)
    for drive in drives:
        cycle.welcome(drive)
    _reset_faults(cycle, drives)


def _configure(session: Session, lost: Sequence[DriveNode]) -> None:
    try:
        session.configure(lost)
    except TroubleError:
        raise
    except UserError as error:
        raise TroubleError(str(error), lost[0].node_id) from None


def _is_sound(drive: DriveNode) -> bool:
    return drive.answers and drive.liveness.expected


def _await(cycle: Cycle, lost: Sequence[DriveNode]) -> None:
    for count in range(round(PATIENCE / cycle.period)):
        if count % round(ASK_EVERY / cycle.period) == 0:
            for drive in lost:
                drive.reset_communication()
        _run(cycle)
        lost = [drive for drive in lost if not _is_heard(drive)]
        if not lost:
            return
    raise GivenUpError(f"{lost[0].where()} did not come back within {PATIENCE:g} s", lost[0].node_id)


def _is_heard(drive: DriveNode) -> bool:
    """A PDO came in this cycle, or a boot-up message or heartbeat since it was lost."""
    return drive.received > 0 or drive.liveness.boots > 0 or drive.liveness.beats > 0


def _reset_faults(cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    for _ in range(round(PATIENCE / RESET_EVERY)):
        faulty = [drive for drive in drives if drive.statusword & IN_FAULT]
        if not faulty:
            return
        for drive in faulty:
            drive.controlword = FAULT_RESET
        for _ in range(round(RESET_EVERY / 2.0 / cycle.period)):
            _run(cycle)
        for drive in faulty:
            drive.controlword = DISABLE_VOLTAGE
        for _ in range(round(RESET_EVERY / 2.0 / cycle.period)):
            _run(cycle)
    raise GivenUpError(f"{faulty[0].where()} cannot be reset: is the cause of its fault still there?", faulty[0].node_id)


def _run(cycle: Cycle) -> None:
    """A cycle; what is wrong is known, or is looked at afterwards."""
    with suppress(TroubleError):
        cycle.run()
