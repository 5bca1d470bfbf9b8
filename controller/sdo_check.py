"""Friction without PDOs: the drive moves by itself (profile velocity) and torque is polled by SDO, as a second witness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from controller.cycle import Cycle
from controller.drive_node import DriveNode
from controller.motion import ENABLE_OPERATION, PROFILE_VELOCITY_MODE, TARGET_REACHED

LEVELS = (0.2, 0.5)
"""Speeds as shares of full speed."""

SETTLE, READ = 0.12, 0.2
POLL_EVERY = 5
"""Cycles between two SDO reads."""


@dataclass(frozen=True)
class FrictionPoint:
    """Friction of an axis at one speed [rad/s or m/s]: half the difference of both directions, with its standard error."""

    axis: str
    velocity: float
    torque: float
    standard_error: float


def friction_by_sdo(cycle: Cycle, drives: Sequence[DriveNode]) -> list[FrictionPoint]:
    """Friction of the given axes at two speeds from 6077h, polled by SDO while the drives ramp and cruise by themselves.

    Gravity and offsets, equal in both directions, cancel in the half difference.
    """
    for drive in drives:
        drive.write(0, 0x60FF)
        drive.write(PROFILE_VELOCITY_MODE, 0x6060)
        drive.controlword = ENABLE_OPERATION
    points = []
    for level in LEVELS:
        forward = _cruise(cycle, drives, level)
        backward = _cruise(cycle, drives, -level)
        for drive, plus, minus in zip(drives, forward, backward, strict=True):
            points.append(
                FrictionPoint(
                    axis=drive.name,
                    velocity=level * drive.axis.max_speed,
                    torque=0.5 * (float(plus.mean()) - float(minus.mean())),
                    standard_error=0.5 * float(np.hypot(plus.std(ddof=1), minus.std(ddof=1)) / np.sqrt(len(plus))),
                )
            )
    return points


def _cruise(cycle: Cycle, drives: Sequence[DriveNode], level: float) -> list[np.ndarray]:
    """Torques (n,) [joint] of each drive, polled at a share `level` of full speed; back at rest afterwards."""
    for drive in drives:
        drive.write(drive.in_units(level * drive.axis.max_speed), 0x60FF)
    cycle.run_for(SETTLE)
    polled: list[list[float]] = [[] for _ in drives]
    for _ in range(round(READ / cycle.period / POLL_EVERY)):
        for _ in range(POLL_EVERY):
            cycle.run()
        for drive, values in zip(drives, polled, strict=True):
            values.append(_torque(drive))
    for drive in drives:
        drive.write(0, 0x60FF)
    for _ in range(round(1.0 / cycle.period)):
        cycle.run()
        if all(drive.statusword & TARGET_REACHED for drive in drives):
            break
    return [np.array(values) for values in polled]


def _torque(drive: DriveNode) -> float:
    """Joint torque [N·m or N] from 6077h, in thousandths of the rated torque 6076h [mN·m]."""
    rated = float(drive.read(0x6076)) * 1e-3
    return drive.joint_torque(float(drive.read(0x6077)) * 1e-3 * rated)
