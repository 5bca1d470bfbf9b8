"""Is this the right machine? Compares the motors configured in the drives with the controller's own description."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.machine import Machine
from drivetwin.foundation.errors import UserError

TOLERANCE = 0.25
"""Share by which a motor's inertia may differ from the data sheet's: data sheets are that good, another motor is not."""


def check_motors(drives: Sequence[DriveNode], machine: Machine) -> None:
    """Raise UserError where a drive's motor cannot be the one that is on its axis (axes.yaml), before anything moves.

    What neither the drive nor the description tells is not checked.
    """
    for drive in drives:
        told = drive.read_role("motor_inertia")
        expected = drive.axis.motor_inertia
        if not told or expected is None:
            continue
        if abs(told / expected - 1.0) > TOLERANCE:
            raise UserError(
                f"{drive.where()} has motor inertia {told:.3g} kg·m², and machine {machine.machine} has {expected:.3g}: "
                f"is --machine {machine.machine} what stands there? Nothing was moved"
            )
