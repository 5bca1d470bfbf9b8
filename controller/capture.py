"""From streamed samples to a recording: SI units on the joint side, with what the drives say of themselves."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from controller.drive_node import DriveNode
from controller.motion import Samples
from drivetwin.recording.recording import AxisInfo, DriveLoops, Recording, RecordingInfo


def describe(drives: Sequence[DriveNode]) -> dict[str, AxisInfo]:
    """What the drives answer about motor, encoder and loops, by SDO; joint side."""
    return {drive.name: _describe(drive) for drive in drives}


def _describe(drive: DriveNode) -> AxisInfo:
    gear = drive.axis.gear_ratio
    increments = float(drive.read(0x608F, 1)) / float(drive.read(0x608F, 2))
    values = {name: drive.read_role(name) for name in _LOOP_ROLES}
    gain, filter_time, limit = values["velocity_gain"], values["velocity_filter_time"], values["torque_limit"]
    loops = DriveLoops(
        position_gain=values["position_gain"],
        velocity_gain=None if gain is None else gain * gear**2,
        integral_time=values["integral_time"] or None,
        velocity_feedforward=1.0 if values["velocity_feedforward"] is None else values["velocity_feedforward"],
        torque_limit=None if limit is None else limit * gear,
        servo_period=values["servo_period"],
        velocity_filter_hz=None if not filter_time else 1.0 / (2.0 * pi * filter_time),
        current_loop_time_constant=values["current_loop_time_constant"],
    )
    rated = drive.read_role("rated_torque")
    return AxisInfo(
        joint=drive.axis.joint,
        actuator=drive.axis.actuator,
        rated_torque=None if rated is None else rated * gear,
        position_resolution=2.0 * pi / increments / gear,
        gear_ratio=gear,
        drive=loops,
    )


_LOOP_ROLES = (
    "position_gain",
    "velocity_gain",
    "integral_time",
    "velocity_feedforward",
    "velocity_filter_time",
    "torque_limit",
    "servo_period",
    "current_loop_time_constant",
)


def record(
    name: str,
    machine: str,
    period: float,
    axes: dict[str, AxisInfo],
    demand: NDArray[np.float64],
    samples: Samples,
) -> Recording:
    """A recording of streamed motion: demand and samples (n, axes), one row a cycle of `period` seconds."""
    columns = {
        axis: {
            "torque": samples.torque[:, index],
            "position": samples.position[:, index],
            "position_demand": demand[:, index],
        }
        for index, axis in enumerate(axes)
    }
    described = {
        axis: info.model_copy(update={"torque_resolution": _quantum(samples.torque[:, index])})
        for index, (axis, info) in enumerate(axes.items())
    }
    info = RecordingInfo(machine=machine, sample_period=period, axes=described)
    time = np.asarray(np.arange(len(demand)) * period, dtype=np.float64)
    return Recording(name=name, info=info, time=time, columns=columns)


def _quantum(values: NDArray[np.float64]) -> float | None:
    """Smallest step between the values that occur: the resolution that the drive delivers."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-6 * max(1e-12, float(np.abs(values).max(initial=0.0)))]
    return float(steps.min()) if len(steps) else None
