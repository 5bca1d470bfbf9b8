"""Streamed samples to a recording: SI units on the joint side, with the drives' own description of themselves."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.motion import Offsets, Samples
from drivetwin.recording.recording import AxisInfo, DriveLoops, Recording, RecordingInfo


def describe(drives: Sequence[DriveNode]) -> dict[str, AxisInfo]:
    """What the drives answer about motor, encoder and loops, by SDO; joint side."""
    return {drive.name: _describe(drive) for drive in drives}


def _describe(drive: DriveNode) -> AxisInfo:
    gear = drive.axis.gear_ratio
    increments = float(drive.read(0x608F, 1)) / float(drive.read(0x608F, 2))
    rated = drive.read_role("rated_torque")
    known = {
        "rated_torque": None if rated is None else rated * gear,
        "position_resolution": max(2.0 * pi / increments / gear, drive.unit),
        "gear_ratio": gear,
        "drive": DriveLoops(**_known(_loops(drive))),
    }
    return AxisInfo(joint=drive.axis.joint, actuator=drive.axis.actuator, **_known(known))


def _loops(drive: DriveNode) -> dict[str, float | str | None]:
    """The `drive` block of a recording; None for what the drive type does not tell."""
    gear = drive.axis.gear_ratio
    values = {name: drive.read_role(name) for name in _LOOP_ROLES}
    gain, filter_time = values["velocity_gain"], values["velocity_filter_time"]
    return {
        "position_gain": values["position_gain"],
        "velocity_gain": None if gain is None else gain * gear**2,
        "integral_time": values["integral_time"],
        "velocity_feedforward": values["velocity_feedforward"],
        "torque_limit": _torque_limit(drive, values["torque_limit"]),
        "servo_period": values["servo_period"],
        "velocity_filter_hz": 1.0 / (2.0 * pi * filter_time) if filter_time else None,
        "current_loop_time_constant": values["current_loop_time_constant"],
        "interpolation": drive.interpolation,
    }


def _torque_limit(drive: DriveNode, own: float | None) -> float:
    """The smaller of 6072h and the drive's own limit, joint side [N·m or N]."""
    by_profile = float(drive.read(0x6072)) / 1000.0 * float(drive.read(0x6076)) / 1000.0
    return drive.joint_torque(by_profile if own is None else min(own, by_profile))


def _known(values: dict[str, Any]) -> dict[str, Any]:
    """What is known; an integral time of 0 is a P velocity loop, which a recording writes as null."""
    known = {name: value for name, value in values.items() if value is not None}
    if known.get("integral_time") == 0.0:
        known["integral_time"] = None
    return known


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
    offsets: Offsets | None = None,
) -> Recording:
    """A recording of streamed motion: position demand, samples, and what was sent beside the set-points (n, axes), one row a
    cycle of `period` seconds."""
    columns = {
        axis: {
            "torque": samples.torque[:, index],
            "position": samples.position[:, index],
            "position_demand": demand[:, index],
        }
        for index, axis in enumerate(axes)
    }
    for index, axis in enumerate(axes):
        if offsets is not None:
            columns[axis]["torque_offset"] = offsets.torque[:, index]
        if offsets is not None and offsets.velocity is not None:
            columns[axis]["velocity_offset"] = offsets.velocity[:, index]
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
    return float(f"{steps.min():.3g}") if len(steps) else None


def position_demand(
    drives: Sequence[DriveNode], start: NDArray[np.float64], setpoints: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What 6062h was at each SYNC (n, axes), from the set-points sent (n, axes) and where the axes stood before (axes,).

    The drives send no 6062h: it does not fit beside position and torque into one frame, and a servoone does not have it.
    """
    columns = []
    for axis, drive in enumerate(drives):
        sent = np.concatenate([np.full(len(drive.setpoint_weights), start[axis]), setpoints[:, axis]])
        columns.append(np.convolve(sent, drive.setpoint_weights, mode="valid")[: len(setpoints)])
    return np.column_stack(columns)
