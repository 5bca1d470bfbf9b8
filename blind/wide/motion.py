"""What the axes are asked to do in a recording: strokes, sweeps, sinusoids, pick-and-place, slow moves, standstills."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.wide.machines import AxisLimits, Draw, Machine
from drivetwin.blind.wide.simulator import TICK

Array = NDArray[np.float64]
Way = Literal["both", "one_direction", "one_speed"]

ENDLESS = 4.0 * pi
"""What counts as the travel of an endless axis [rad]."""

SETTLE = 0.5
"""Time that an axis stands before it is recorded [s]."""

LONGEST = 22.0
"""Of a recording [s]."""


@dataclass(frozen=True)
class Plan:
    """One recording: its name, when it begins after switching on [s], and the positions (k, n) asked at each servo period."""

    name: str
    start_time: float
    position: Array


def draw_plans(draw: Draw, machine: Machine, way: Way) -> tuple[Plan, ...]:
    """Three recordings to fit and two to validate; in the first to validate all axes move at once.

    Pauses lie between them, and one in four comes from another day, when the machine was as cold as at the first.
    """
    plans, clock = [], float(draw.uniform(0.0, 20.0))
    for name in ("train_1", "train_2", "train_3", "validate_1", "validate_2"):
        together = name == "validate_1" or draw.random() < 0.6
        position = _recording(draw, machine, way, together)
        plans.append(Plan(name, round(clock, 3), position))
        again = draw.random() < 0.25
        clock = float(draw.uniform(0.0, 10.0)) if again else clock + len(position) * TICK + float(draw.uniform(1.0, 60.0))
    return tuple(plans)


def _recording(draw: Draw, machine: Machine, way: Way, together: bool) -> Array:
    """Positions (k, n): all axes at once, or one after the other while the rest stand."""
    n = len(machine.links)
    room = LONGEST if together else LONGEST / n
    paths = [_axis_path(draw, limit, way, max(room, 3.0)) for limit in machine.limits]
    if together:
        length = max(len(path) for path in paths)
        return np.column_stack([np.concatenate([path, np.full(length - len(path), path[-1])]) for path in paths])
    moving = [paths[k] for k in range(n)]
    columns = []
    for k in range(n):
        before, after = sum(len(path) for path in moving[:k]), sum(len(path) for path in moving[k + 1 :])
        columns.append(np.concatenate([np.full(before, moving[k][0]), moving[k], np.full(after, moving[k][-1])]))
    return np.column_stack(columns)


def _axis_path(draw: Draw, limit: AxisLimits, way: Way, seconds: float) -> Array:
    """One axis's way (k,), at most `seconds` long, at rest at both ends."""
    if way == "one_direction":
        path = _forwards(draw, limit, seconds)
    elif way == "one_speed":
        path = _strokes(draw, limit, seconds, [limit.max_speed * float(draw.uniform(0.1, 0.9))])
    else:
        path = _mixed(draw, limit, seconds)
    hold = int(SETTLE / TICK)
    return np.concatenate([np.full(hold, path[0]), path, np.full(hold // 2, path[-1])])


def _mixed(draw: Draw, limit: AxisLimits, seconds: float) -> Array:
    """Two or three kinds of motion, one after the other, from the middle back to the middle."""
    kinds: list[Callable[[Draw, AxisLimits, float], Array]] = [
        lambda d, one, s: _strokes(d, one, s, one.max_speed * np.geomspace(1.0, d.uniform(0.03, 0.2), 4)),
        _multisine,
        _sinusoid,
        _pick_and_place,
        _slow,
    ]
    count = int(draw.integers(2, 4))
    chosen = draw.choice(len(kinds), size=count, replace=False, p=(0.35, 0.2, 0.15, 0.15, 0.15))
    pieces = [kinds[k](draw, limit, seconds / count) for k in chosen]
    if draw.random() < 0.5:
        pieces.insert(1, np.full(int(draw.uniform(0.5, 2.0) / TICK), pieces[0][-1]))
    path, at = [pieces[0]], pieces[0][-1]
    for piece in pieces[1:]:
        path += [_move(at, piece[0], 0.5 * limit.max_speed, limit), piece]
        at = piece[-1]
    return np.concatenate(path)


def _move(start: float, end: float, speed: float, limit: AxisLimits) -> Array:
    """A move with a trapezoidal speed, its corners rounded over a third of the time to full speed; empty without a way."""
    way = abs(end - start)
    if way < 1e-9:
        return np.zeros(0)
    top = min(speed, np.sqrt(way * limit.max_acceleration))
    ramp = top / limit.max_acceleration
    total = way / top + ramp
    time = np.arange(int(np.ceil(total / TICK)) + 1) * TICK
    rate = np.clip(np.minimum(time, total - time) / ramp, 0.0, 1.0)
    box = max(3, int(0.3 * limit.max_speed / limit.max_acceleration / TICK))
    rate = np.convolve(rate, np.full(box, 1.0 / box))
    travelled = np.cumsum(rate)
    return np.asarray(start + (end - start) * travelled / travelled[-1])


def _ends(draw: Draw, limit: AxisLimits, reach: float) -> tuple[float, float]:
    middle, half = (limit.low + limit.high) / 2.0, (limit.high - limit.low) / 2.0
    return middle - half * reach * draw.uniform(0.8, 1.0), middle + half * reach * draw.uniform(0.8, 1.0)


def _dwell(draw: Draw, at: float) -> Array:
    return np.full(int(draw.uniform(0.05, 0.4) / TICK), at)


def _strokes(draw: Draw, limit: AxisLimits, seconds: float, speeds: Sequence[float] | Array) -> Array:
    """There and back at each speed in turn, over as much of the range as the time allows."""
    low, high = _ends(draw, limit, 1.0)
    share = seconds / len(speeds)
    pieces, used, number = [np.full(1, low)], 0.0, 0
    while True:
        speed = float(speeds[number % len(speeds)])
        reach = min(high - low, max(0.4 * share * speed, 1e-4 * (high - low)))
        there = _move(low, low + reach, speed, limit)
        pieces += [there, _dwell(draw, there[-1]), _move(low + reach, low, speed, limit), _dwell(draw, low)]
        used += sum(len(piece) for piece in pieces[-4:]) * TICK
        number += 1
        if used > seconds * 0.85:
            return np.concatenate(pieces)


def _slow(draw: Draw, limit: AxisLimits, seconds: float) -> Array:
    """There and back at constant low speeds, 0.3 to 5 % of the highest."""
    speeds = limit.max_speed * np.exp(draw.uniform(np.log(0.003), np.log(0.05), size=2))
    return _strokes(draw, limit, seconds, speeds)


def _forwards(draw: Draw, limit: AxisLimits, seconds: float) -> Array:
    """Forwards only, move after move at different speeds."""
    low, high = (0.0, 40.0 * pi) if limit.endless else _ends(draw, limit, 1.0)
    at, pieces, used = low, [np.full(1, low)], 0.0
    while used < 0.85 * seconds and at < high - 1e-3 * (high - low):
        speed = limit.max_speed * float(np.exp(draw.uniform(np.log(0.02), 0.0)))
        to = min(high, at + min(speed * draw.uniform(0.5, 2.5), 0.4 * (high - low)))
        pieces += [_move(at, to, speed, limit), _dwell(draw, to)]
        used += sum(len(piece) for piece in pieces[-2:]) * TICK
        at = to
    return np.concatenate(pieces)


def _multisine(draw: Draw, limit: AxisLimits, seconds: float) -> Array:
    """A sum of 3 to 8 sinusoids (Swevers et al. 1997), 0.1 to 5 Hz, faded in and out."""
    frequencies = np.exp(draw.uniform(np.log(0.1), np.log(5.0), size=int(draw.integers(3, 9))))
    phases = draw.uniform(-pi, pi, size=len(frequencies))
    time = np.arange(int(seconds / TICK)) * TICK
    angles = 2.0 * pi * frequencies[:, None] * time + phases[:, None]
    return _fitted(draw, limit, (np.sin(angles) / frequencies[:, None]).sum(axis=0))


def _sinusoid(draw: Draw, limit: AxisLimits, seconds: float) -> Array:
    """One frequency, 0.1 to 3 Hz."""
    time = np.arange(int(seconds / TICK)) * TICK
    return _fitted(draw, limit, np.sin(2.0 * pi * float(np.exp(draw.uniform(np.log(0.1), np.log(3.0)))) * time))


def _fitted(draw: Draw, limit: AxisLimits, wave: Array) -> Array:
    """A wave (k,) faded in and out, as large as range, speed and acceleration allow, or down to a fifth of that."""
    fade = min(len(wave) // 3, int(0.7 / TICK))
    ramp = 0.5 - 0.5 * np.cos(pi * np.arange(fade) / fade)
    window = np.concatenate([ramp, np.ones(len(wave) - 2 * fade), ramp[::-1]])
    shaped = wave * window
    shaped = np.convolve(np.concatenate([np.zeros(80), shaped, np.zeros(80)]), np.full(81, 1.0 / 81), mode="same")
    speed = np.gradient(shaped, TICK)
    acceleration = np.gradient(speed, TICK)
    half = (limit.high - limit.low) / 2.0
    factor = min(
        half / max(float(np.abs(shaped).max()), 1e-12),
        limit.max_speed / max(float(np.abs(speed).max()), 1e-12),
        limit.max_acceleration / max(float(np.abs(acceleration).max()), 1e-12),
    )
    return np.asarray((limit.low + limit.high) / 2.0 + shaped * factor * draw.uniform(0.2, 0.98))


def _pick_and_place(draw: Draw, limit: AxisLimits, seconds: float) -> Array:
    """From place to place in the range, with pauses as a gripper needs them."""
    at = float(draw.uniform(limit.low, limit.high))
    pieces, used = [np.full(1, at)], 0.0
    while used < 0.85 * seconds:
        to = float(draw.uniform(limit.low, limit.high))
        speed = min(limit.max_speed * float(draw.uniform(0.3, 1.0)), 1e9)
        speed = max(speed, abs(to - at) / max(0.5 * seconds, 0.1))
        pieces += [_move(at, to, speed, limit), _dwell(draw, to)]
        used += sum(len(piece) for piece in pieces[-2:]) * TICK
        at = to
    return np.concatenate(pieces)
