"""Friction without PDOs, as a cross-check: the drive moves by itself (profile velocity), torque is polled by SDO."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.machine import Axis
from drivetwin.controller.motion import ENABLE_OPERATION, PROFILE_VELOCITY_MODE, hold
from drivetwin.foundation.files import provenance

LEVELS = (0.2, 0.5)
"""Speeds as shares of full speed."""

SETTLE, READ, STOP = 0.12, 0.2, 0.15
"""Seconds from the new target to the first reading, of reading, and for the ramp to rest."""

BATCHES = 8
"""Into which the readings of a cruise are divided."""


@dataclass(frozen=True)
class FrictionPoint:
    """Friction of an axis at one speed [rad/s or m/s]: half the difference of both directions, with its standard error."""

    axis: str
    velocity: float
    torque: float
    standard_error: float

    @property
    def ci90(self) -> tuple[float, float]:
        """90 % interval of the torque [N or N·m], by Student's t: the error is of the means of `BATCHES` in each direction."""
        reach = float(stats.t.ppf(0.95, 2 * (BATCHES - 1))) * self.standard_error
        return self.torque - reach, self.torque + reach


@dataclass(frozen=True)
class _Polled:
    """What one drive answered at constant speed (n,): velocity [m/s or rad/s] and torque [N or N·m] of the joint."""

    velocity: NDArray[np.float64]
    torque: NDArray[np.float64]


def friction_by_sdo(cycle: Cycle, drives: Sequence[DriveNode]) -> list[FrictionPoint]:
    """Friction of the given axes at two speeds from 6077h and 606Ch, polled by SDO while the drives move by themselves.

    Both directions are read over the same way, so gravity and offsets cancel in the half difference. One object is
    read a cycle, as always while cycles run; so that the bus has room for it, no drive may be streaming.
    """
    hold(cycle, [drive for drive in drives if drive.streaming])
    for drive in drives:
        drive.write(0, 0x60FF)
        drive.write(PROFILE_VELOCITY_MODE, 0x6060)
        drive.controlword = ENABLE_OPERATION
    points = []
    for level in LEVELS:
        forward = _cruise(cycle, drives, level)
        backward = _cruise(cycle, drives, -level)
        points += [_point(drive, *both) for drive, *both in zip(drives, forward, backward, strict=True)]
    return points


def speed(axis: Axis, level: float) -> float:
    """A share of the full speed [m/s or rad/s], or what the way from the middle of the travel to its end allows."""
    room = 0.45 * (axis.travel[1] - axis.travel[0])
    return float(np.copysign(min(abs(level) * axis.max_speed, room / (2.0 * SETTLE + READ)), level))


def _point(drive: DriveNode, forward: _Polled, backward: _Polled) -> FrictionPoint:
    return FrictionPoint(
        axis=drive.name,
        velocity=0.5 * float(forward.velocity.mean() - backward.velocity.mean()),
        torque=0.5 * float(forward.torque.mean() - backward.torque.mean()),
        standard_error=0.5 * float(np.hypot(_standard_error(forward.torque), _standard_error(backward.torque))),
    )


def _standard_error(values: NDArray[np.float64]) -> float:
    """Of the mean, from the means of `BATCHES` batches: readings a few milliseconds apart are not independent."""
    means = [float(batch.mean()) for batch in np.array_split(values, min(BATCHES, len(values)))]
    return float(np.std(means, ddof=1) / np.sqrt(len(means)))


def _cruise(cycle: Cycle, drives: Sequence[DriveNode], level: float) -> list[_Polled]:
    """Poll every drive at a share `level` of its full speed; back at rest afterwards."""
    for drive in drives:
        drive.write(drive.in_units(speed(drive.axis, level)), 0x60FF)
    cycle.run_for(SETTLE)
    polled: list[list[tuple[float, float]]] = [[] for _ in drives]
    end = cycle.count + round(READ / cycle.period)
    while cycle.count < end:
        for drive, values in zip(drives, polled, strict=True):
            values.append((_velocity(drive), _torque(drive)))
    _stop_symmetrically(cycle, drives, abs(level))
    return [_Polled(*np.array(values).T) for values in polled]


def _stop_symmetrically(cycle: Cycle, drives: Sequence[DriveNode], level: float) -> None:
    """Run on as long as the drive did between its ramp and the first reading, so that the way back is read where this was."""
    ramps = {drive.name: speed(drive.axis, level) / drive.axis.max_acceleration for drive in drives}
    remaining = sorted(drives, key=lambda drive: -ramps[drive.name])
    elapsed = 0.0
    for drive in remaining:
        run_on = max(0.0, SETTLE - ramps[drive.name])
        cycle.run_for(run_on - elapsed)
        elapsed = run_on
        drive.write(0, 0x60FF)
    cycle.run_for(STOP)


def _velocity(drive: DriveNode) -> float:
    """Joint velocity [m/s or rad/s] from 606Ch."""
    return float(drive.read(0x606C)) * drive.unit


def _torque(drive: DriveNode) -> float:
    """Joint torque [N·m or N] from 6077h, in thousandths of the rated torque 6076h [mN·m]."""
    return drive.joint_torque(float(drive.read(0x6077)) * 1e-3 * drive.rated_torque)


def to_json(points: Sequence[FrictionPoint], seed: int, inputs: Sequence[Path]) -> dict[str, Any]:
    """The points as an object of schema torque-by-sdo/1, joint side, SI."""
    return {"schema": "torque-by-sdo/1", **provenance(seed, inputs), "points": [asdict(point) for point in points]}
