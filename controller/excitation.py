"""Which motion identifies an axis: strokes at constant speed over the range, both ways, and a move that excites inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.machine import Axis
from drivetwin.controller.trajectory import Positions, exciting, move, stroke

SPEED_LEVELS = (0.006, 0.01, 0.016, 0.025, 0.04, 0.08, 0.16, 0.3, 0.5, 0.75, 1.0)
"""Speeds of the strokes as shares of full speed: dense where a Stribeck curve falls, down to where it is stiction."""

VALIDATION_LEVELS = (0.03, 0.2, 0.7)

CRUISE = 0.36
"""Time at constant speed [s], where the travel allows it."""

PAUSE = 0.03
"""Standstill between two strokes [s]."""

EXCITING_TIME = 4.0


def strokes(axis: Axis, levels: tuple[float, ...], period: float) -> Positions:
    """Forward and back at each speed (n,), from the middle of the travel and back to it."""
    middle = 0.5 * (axis.travel[0] + axis.travel[1])
    room = axis.travel[1] - axis.travel[0]
    pause = round(PAUSE / period)
    path: list[Positions] = []
    at = middle
    for level in levels:
        speed = level * axis.max_speed
        half = 0.5 * min(room, speed * CRUISE + 2.0 * speed**2 / axis.max_acceleration)
        for leg in (
            move(at, middle - half, axis.max_speed, axis.max_acceleration, period),
            stroke(middle - half, middle + half, speed, axis.max_acceleration, period),
            stroke(middle + half, middle - half, speed, axis.max_acceleration, period),
        ):
            path += [leg, np.full(pause, leg[-1])]
        at = middle - half
    path.append(move(at, middle, axis.max_speed, axis.max_acceleration, period))
    return np.concatenate(path)


def excitation(axis: Axis, seed: int, period: float) -> Positions:
    """A persistently exciting move about the middle of the travel (n,)."""
    middle = 0.5 * (axis.travel[0] + axis.travel[1])
    return exciting(middle, axis.travel, axis.max_speed, axis.max_acceleration, EXCITING_TIME, period, seed)


def with_held(paths: dict[str, Positions], held: dict[str, float]) -> NDArray[np.float64]:
    """Columns (n, axes) in the order of `held`: the paths of the axes that move, the positions of those that hold."""
    length = max(len(path) for path in paths.values())
    columns = []
    for axis, position in held.items():
        path = paths.get(axis, np.array([position]))
        columns.append(np.concatenate([path, np.full(length - len(path), path[-1])]))
    return np.column_stack(columns)
