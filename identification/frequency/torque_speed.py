"""The torque that an axis takes at constant speed, over the speed: what the motor has to give besides acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.recording.recording import Recording

LEAST = 0.04
"""Shortest time at constant speed that makes a point [s]."""

SAME, REST = 1e-4, 1e-3
"""Of the greatest demanded speed: its change within a sample up to which it counts as constant, and what counts as standing."""


@dataclass(frozen=True)
class SpeedPoint:
    """Mean `torque` [N·m or N] and its standard deviation of the mean at a `speed` [rad/s or m/s]; weight is in it."""

    speed: float
    torque: float
    deviation: float


def torque_speed(recording: Recording, axis: str) -> tuple[SpeedPoint, ...]:
    """Points of the curve, by speed, of each stretch of constant demanded speed; its first third lets the loops settle."""
    columns, period = recording.columns[axis], recording.info.sample_period
    speed = np.gradient(columns["position_demand"], period)
    most = float(np.abs(speed).max(initial=0.0))
    steady = (np.abs(np.gradient(speed)) < SAME * most) & (np.abs(speed) > REST * most)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], steady.astype(np.int8), [0]))))
    points = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        part = slice(int(start) + (int(end) - int(start)) // 3, int(end))
        count = part.stop - part.start
        if count * period >= LEAST:
            torque = columns["torque"][part]
            travelled = float(columns["position"][part.stop - 1] - columns["position"][part.start]) / ((count - 1) * period)
            points.append(SpeedPoint(travelled, float(torque.mean()), float(torque.std() / np.sqrt(count))))
    return tuple(sorted(points, key=lambda point: point.speed))
