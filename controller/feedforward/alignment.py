"""Required torque to torque offsets: shifted in time to when the drive needs them, minus what its loops add by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.controller.motion import Offsets
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import AxisInfo, DriveLoops

CURRENT_LOOP_TIME = 0.0005
"""What the current loop of a drive that does not tell its time constant is taken for [s]: some 300 Hz, as data sheets say."""


@dataclass(frozen=True)
class Loops:
    """What the alignment needs of a drive, joint side: velocity_gain [N·m·s/rad or N·s/m], position_gain [1/s], times [s].

    `velocity_lag` is by how much the speed that the loop sees is late, `current_lag` the torque behind its demand;
    `setpoint_delay` is in cycles, `servo_period` what the loops count in. `integral_time` None: a P velocity loop.
    """

    position_gain: float
    velocity_gain: float
    integral_time: float | None
    velocity_lag: float
    current_lag: float
    setpoint_delay: int
    servo_period: float


def loops_of(drives: Sequence[DriveNode], axes: dict[str, AxisInfo]) -> list[Loops]:
    """The drives' loops, from what each said of itself by SDO. Raises UserError where one does not tell its gains."""
    return [_loops(drive, axes[drive.name].drive or DriveLoops()) for drive in drives]


def _loops(drive: DriveNode, told: DriveLoops) -> Loops:
    """A sampled filter is half a servo period ahead of its time constant, and a difference of positions as much behind."""
    if not (told.position_gain and told.velocity_gain and told.servo_period):
        raise UserError(
            f"{drive.where()} does not give position_gain, velocity_gain and servo_period of its loops, which feeding forward "
            "and learning go by; choose the --profile that this drive is"
        )
    return Loops(
        position_gain=told.position_gain,
        velocity_gain=told.velocity_gain,
        integral_time=told.integral_time,
        velocity_lag=1.0 / (2.0 * pi * told.velocity_filter_hz) if told.velocity_filter_hz else 0.0,
        current_lag=told.current_loop_time_constant or CURRENT_LOOP_TIME,
        setpoint_delay=drive.setpoint_delay,
        servo_period=told.servo_period,
    )


def aligned(path: JointPath, torque: Rows, loops: Sequence[Loops], held: Rows) -> Offsets:
    """Offsets (n, axes) for a path (n, axes) that needs `torque` (n, axes) [N·m or N], joint side, without a velocity.

    `held` (axes,) is what the drives' own loops hold at rest before the start: gravity, and what stiction has left in their
    integrators. It is not told again, or it would be there twice when the axis breaks away. An offset acts over the cycle
    that begins with its SYNC and through the current loop's lag, while the position demand comes `setpoint_delay` cycles
    after its set-point.
    """
    columns = [
        _later(torque[:, axis] - held[axis], loop.setpoint_delay - 0.5 - loop.current_lag / path.period)
        for axis, loop in enumerate(loops)
    ]
    return Offsets(np.column_stack(columns))


def aligned_velocity(path: JointPath, loops: Sequence[Loops]) -> Rows:
    """Velocity offsets (n, axes) [rad/s or m/s] for a path (n, axes): as late as the velocity loop sees the speed itself.

    A servo period holds its position against the demand of its end, half a period later than the middle that an offset has.
    """
    columns = [
        _later(path.velocity[:, axis], loop.setpoint_delay - 0.5 + (loop.velocity_lag - 0.5 * loop.servo_period) / path.period)
        for axis, loop in enumerate(loops)
    ]
    return np.column_stack(columns)


def loop_reaction(path: JointPath, loops: Sequence[Loops]) -> Rows:
    """Torque (n, axes) that the velocity loops add on a motion that follows exactly, because they see the speed late.

    A loop takes v - lag a for the speed: gain lag (a + v / integral_time), the PI of lag a. A drive that feeds forward the
    speed of its own demand leaves this to a position error of lag a / position_gain; with `aligned_velocity` it does not arise.
    """
    columns = []
    for axis, loop in enumerate(loops):
        late = path.acceleration[:, axis]
        if loop.integral_time is not None:
            late = late + path.velocity[:, axis] / loop.integral_time
        columns.append(loop.velocity_gain * loop.velocity_lag * late)
    return np.column_stack(columns)


def _later(column: Rows, cycles: float) -> Rows:
    """A column (n,) that comes so many cycles later; its ends stay."""
    rows = np.arange(len(column), dtype=np.float64)
    return np.interp(rows - cycles, rows, column)
