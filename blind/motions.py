"""What an engineer moves to find out where a machine differs: strokes slow and fast, small reversals, multisines, any moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.machines import DrawnAxis, DrawnMachine
from drivetwin.controller.trajectory import Multisine, Positions, exciting, move, stroke
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

Draw = np.random.Generator

PERIOD = 0.001
"""Communication cycle [s]: three axes with position and torque take 0.87 ms of 1 Mbit/s."""

INNER = 0.9
"""Share of the travel that is used: what overshoots stays inside."""

PAUSE = 0.15
"""Standstill between two moves [s]."""


@dataclass(frozen=True)
class Plan:
    """A recording to be made: where the axes stand before, and their paths from there [m or rad], each (n,)."""

    name: str
    paths: dict[str, Positions]

    @property
    def start(self) -> dict[str, float]:
        """First position of each moving axis."""
        return {name: float(path[0]) for name, path in self.paths.items()}


@dataclass(frozen=True)
class Plans:
    """What is recorded of a case, in order: to fit on, to validate on, and some that nobody is given."""

    training: tuple[Plan, ...]
    validation: tuple[Plan, ...]
    fresh: tuple[Plan, ...]

    def __iter__(self) -> Iterator[tuple[str, Plan]]:
        """Folder and plan."""
        for folder in ("training", "validation", "fresh"):
            for plan in getattr(self, folder):
                yield folder, plan


def draw_plans(machine: DrawnMachine, seed: int) -> Plans:
    """The motion of a case: about 60 s to fit on, 20 s to validate on and 20 s fresh, from generators of the seed's own."""
    draw = np.random.default_rng([seed, 2])
    share = 1.0 / len(machine.axes)
    strokes = tuple(
        Plan("strokes" if len(machine.axes) == 1 else f"strokes_{name}", {name: _strokes(draw, _inside(axis), 30.0 * share)})
        for name, axis in machine.axes.items()
    )
    dynamic = Plan("dynamic", {name: _dynamic(draw, _inside(axis), 24.0) for name, axis in machine.axes.items()})
    return Plans(
        training=(*strokes, dynamic),
        validation=(Plan("other_motion", _mixed(draw, machine)),),
        fresh=(Plan("fresh_motion", _mixed(draw, machine)),),
    )


def _inside(axis: DrawnAxis) -> DrawnAxis:
    half = 0.5 * INNER * axis.room
    return replace(axis, travel=(axis.middle - half, axis.middle + half))


def _mixed(draw: Draw, machine: DrawnMachine) -> dict[str, Positions]:
    """Some 20 s: strokes at speeds of their own, a multisine and moves, all axes at once."""
    paths = {}
    for name, outer in machine.axes.items():
        axis = _inside(outer)
        paths[name] = _in_a_row([_strokes(draw, axis, 4.0), _dynamic(draw, axis, 8.0)], axis)
    return paths


def _strokes(draw: Draw, axis: DrawnAxis, seconds: float) -> Positions:
    """Some `seconds` of strokes both ways from very slow to full speed, log-spaced, about places all over the travel.

    Between them small reversals, in which friction may not yet slide, and standstills.
    """
    count = max(3, round(seconds / 3.0))
    levels = np.geomspace(0.004, 1.0, count) * draw.uniform(0.85, 1.0, count)
    jobs = draw.permutation(np.concatenate([levels, [_REVERSALS, _REVERSALS]]))
    parts: list[Positions] = []
    at = axis.middle
    for level in jobs:
        if level == _REVERSALS:
            parts.append(_reversals(draw, axis, at, 0.1 * seconds))
        else:
            parts.append(_back_and_forth(draw, axis, at, level * axis.max_speed, 0.22 * seconds / count))
        at = float(parts[-1][-1])
    return _in_a_row(parts, axis)


_REVERSALS = 0.0
"""In a list of speeds: no stroke, but small reversals."""


def _back_and_forth(draw: Draw, axis: DrawnAxis, at: float, speed: float, cruise: float) -> Positions:
    """A stroke and back at constant `speed`, for `cruise` seconds where the travel allows it, not too far from where it is."""
    acceleration = draw.uniform(0.5, 1.0) * axis.max_acceleration
    way = min(0.7 * axis.room, speed * cruise + 2.0 * speed**2 / acceleration)
    near = float(np.clip(at + draw.uniform(-0.3, 0.3) * axis.room, axis.travel[0], axis.travel[1]))
    there = near + way if near + way < axis.travel[1] and (draw.random() < 0.5 or near - way < axis.travel[0]) else near - way
    there = float(np.clip(there, axis.travel[0], axis.travel[1]))
    go = stroke(near, there, speed, acceleration, PERIOD)
    return np.concatenate([go, _stand(there), stroke(there, near, speed, acceleration, PERIOD), _stand(near)])


def _reversals(draw: Draw, axis: DrawnAxis, at: float, seconds: float) -> Positions:
    """Small sines about one place, growing and shrinking: 0.02 to 1 % of the travel."""
    margin = 0.05 * axis.room
    place = np.clip(at + draw.uniform(-0.2, 0.2) * axis.room, axis.travel[0] + margin, axis.travel[1] - margin)
    time = np.arange(1, round(seconds / PERIOD) + 1) * PERIOD
    size = draw.uniform(0.006, 0.012) * axis.room * np.sin(pi * time / seconds) ** 3
    return np.asarray(place + size * np.sin(2.0 * pi * draw.uniform(0.8, 1.6) * time))


def _dynamic(draw: Draw, axis: DrawnAxis, seconds: float) -> Positions:
    """A multisine for half of the time, jerk-limited moves to anywhere for the other."""
    waves = Multisine(frequencies=tuple(np.sort(draw.uniform(0.3, 4.5, 6))), fade=0.15, draws=2)
    place = axis.middle + draw.uniform(-0.15, 0.15) * axis.room
    most, seed = (0.9 * axis.max_speed, 0.9 * axis.max_acceleration), int(draw.integers(2**31))
    sines = exciting(place, axis.travel, *most, 0.5 * seconds, PERIOD, seed, waves)
    parts = [sines]
    at, left = place, 0.5 * seconds
    while left > 0.0:
        target = draw.uniform(*axis.travel)
        part = np.concatenate([_move(draw, axis, at, target), _stand(target, draw.uniform(0.05, 0.3))])
        parts.append(part)
        at, left = target, left - len(part) * PERIOD
    return _in_a_row(parts, axis)


def _move(draw: Draw, axis: DrawnAxis, start: float, end: float) -> Positions:
    """Jerk-limited, at some share of full speed and acceleration."""
    speed, acceleration = draw.uniform(0.3, 1.0) * axis.max_speed, draw.uniform(0.4, 1.0) * axis.max_acceleration
    limits = MotionLimits(speed, acceleration, acceleration / draw.uniform(0.03, 0.1))
    return jerk_limited(start, end, limits).sample(PERIOD).position


def _in_a_row(parts: list[Positions], axis: DrawnAxis) -> Positions:
    """One after the other, with moves between them."""
    path: list[Positions] = []
    for part in parts:
        if path and abs(path[-1][-1] - part[0]) > 1e-12:
            path.append(move(float(path[-1][-1]), float(part[0]), axis.max_speed, axis.max_acceleration, PERIOD))
        path.append(part)
    return np.concatenate([np.full(round(PAUSE / PERIOD), parts[0][0]), *path, _stand(float(path[-1][-1]))])


def _stand(position: float, seconds: float = PAUSE) -> NDArray[np.float64]:
    return np.full(round(seconds / PERIOD), position)
