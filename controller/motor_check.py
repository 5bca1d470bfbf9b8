"""Is this the machine? The motors that the drives were commissioned with, against those of the controller's own model."""

from __future__ import annotations

from collections.abc import Sequence

from controller.drive_node import DriveNode
from controller.machine import Machine
from drivetwin.errors import UserError
from drivetwin.motion.inverse_dynamics import compiled

TOLERANCE = 0.25
"""Share by which a motor's inertia may differ from the model's: data sheets are that good, another motor is not."""


def check_motors(drives: Sequence[DriveNode], machine: Machine) -> None:
    """Raise UserError where a drive's motor cannot be the one that the model has on its axis, before anything moves.

    A drive that knows its motor's inertia tells it; times the gear ratio squared it is the joint's `armature`. What neither the
    drive nor the model tells is not checked.
    """
    model = compiled(machine.model_path)
    for drive in drives:
        told = drive.read_role("motor_inertia")
        expected = float(model.joint(drive.axis.joint).armature[0])
        if not told or expected == 0.0:
            continue
        found = told * drive.axis.gear_ratio**2
        if abs(found / expected - 1.0) > TOLERANCE:
            raise UserError(
                f"{drive.where()} tells a motor inertia of {told:.3g} kg·m², {found:.3g} at the joint, where machine "
                f"{machine.machine} has {expected:.3g}: is --machine {machine.machine} what stands there? Nothing was moved"
            )
