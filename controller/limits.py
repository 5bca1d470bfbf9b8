"""What a controller may do on a bus that may be physical: travel, speed and torque of each axis, from a limits file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.machine import Machine
from drivetwin.foundation.errors import UserError
from drivetwin.motion.limits_file import Bounds, read_bounds


@dataclass(frozen=True)
class Limits:
    """Of every axis of a machine, by its name."""

    axes: Mapping[str, Bounds]


def read_limits(path: Path, machine: Machine) -> Limits:
    """Limits for every axis of the machine. Raises UserError naming the file and what is missing or wrong."""
    return Limits(read_bounds(path, tuple(machine.axes)))


def within(machine: Machine, limits: Limits) -> Machine:
    """The machine with travel and speed narrowed to the limits, never widened.

    The search for the limit switch keeps the speed, and leaves the travel: it ends at the switch.
    Raises UserError where an axis's rest position lies outside its limits.
    """
    axes = {}
    for name, axis in machine.axes.items():
        limit = limits.axes[name]
        travel = (max(axis.travel[0], limit.travel[0]), min(axis.travel[1], limit.travel[1]))
        if not travel[0] < axis.rest < travel[1]:
            raise UserError(f"limits of {name}: travel {limit.travel} leaves out its rest position {axis.rest}")
        homing = axis.homing.model_copy(
            update={
                "search_speed": min(axis.homing.search_speed, limit.speed),
                "edge_speed": min(axis.homing.edge_speed, limit.speed),
            }
        )
        axes[name] = axis.model_copy(update={"travel": travel, "max_speed": min(axis.max_speed, limit.speed), "homing": homing})
    return machine.model_copy(update={"axes": axes})


def apply_torque_limits(drives: Sequence[DriveNode], limits: Limits) -> None:
    """Lower the drives' torque limits to those of the file (6072h, thousandths of rated torque); none is raised."""
    for drive in drives:
        rated = drive.joint_torque(float(drive.read(0x6076)) * 1e-3)
        allowed = int(1000.0 * limits.axes[drive.name].torque / rated)
        drive.write(min(allowed, int(drive.read(0x6072))), 0x6072)
