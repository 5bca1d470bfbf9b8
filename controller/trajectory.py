"""Smooth motion of one axis, sampled once a cycle: moves, constant-velocity strokes, an exciting move."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.motion.sample_times import sample_times

Positions = NDArray[np.float64]


@dataclass(frozen=True)
class Multisine:
    """An exciting wave: its `frequencies` [Hz], the share of its time over which it fades in and out, and how many draws of
    random phases are compared for the one that keeps the acceleration highest within the limits."""

    frequencies: tuple[float, ...] = (0.5, 1.1, 1.9, 3.1, 4.3)
    fade: float = 0.25
    draws: int = 1


def move(start: float, end: float, max_speed: float, max_acceleration: float, period: float) -> Positions:
    """Quintic rest-to-rest move (n,), as short as speed and acceleration allow.

    s = 10 u^3 - 15 u^4 + 6 u^5, with peak speed 15/8 and peak acceleration 10/sqrt(3) of the mean (Biagiotti, Melchiorri,
    Trajectory Planning, 2008, sec. 2.1.6).
    """
    distance = abs(end - start)
    duration = max(15.0 / 8.0 * distance / max_speed, np.sqrt(10.0 / np.sqrt(3.0) * distance / max_acceleration))
    steps = max(1, ceil(duration / period))
    u = np.arange(1, steps + 1) / steps
    return np.asarray(start + (end - start) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2))


def stroke(start: float, end: float, speed: float, acceleration: float, period: float) -> Positions:
    """Rest to rest at constant `speed` between two ramps of raised-cosine acceleration with peak `acceleration` (n,).

    The ramp takes 2 speed / acceleration and half its way at full speed; a stroke too short for `speed` gets slower.
    """
    distance = abs(end - start)
    speed = min(speed, np.sqrt(0.5 * distance * acceleration))
    ramp = 2.0 * speed / acceleration
    cruise = distance / speed - ramp
    time = sample_times(2.0 * ramp + cruise, period)
    return np.asarray(start + np.sign(end - start) * _stroke_distance(time, speed, ramp, cruise))


def _stroke_distance(time: Positions, speed: float, ramp: float, cruise: float) -> Positions:
    """Distance after `time` (n,) of a stroke: integral of v = speed (t/ramp - sin(2 pi t/ramp)/(2 pi)) on the ramps."""

    def up(t: Positions) -> Positions:
        return np.asarray(speed * (t**2 / (2.0 * ramp) + ramp / (4.0 * pi**2) * (np.cos(2.0 * pi * t / ramp) - 1.0)))

    total = speed * (ramp + cruise)
    rising = up(np.clip(time, 0.0, ramp))
    cruising = speed * np.clip(time - ramp, 0.0, cruise)
    left = np.clip(2.0 * ramp + cruise - time, 0.0, ramp)
    falling = up(np.full_like(time, ramp)) - up(left)
    return np.minimum(rising + cruising + np.where(time > ramp + cruise, falling, 0.0), total)


def exciting(
    center: float,
    travel: tuple[float, float],
    max_speed: float,
    max_acceleration: float,
    duration: float,
    period: float,
    seed: int,
    multisine: Multisine = Multisine(),
) -> Positions:
    """A persistently exciting move about `center` (n,): a multisine that starts and ends at rest.

    Swevers et al., IEEE T-RA 13(5), 1997, eq. 2; random phases, scaled to the limits of travel, speed and acceleration, faded
    in and out.
    """
    time = sample_times(duration, period)
    random = np.random.default_rng(seed)
    room = min(center - travel[0], travel[1] - center)
    best, most = np.zeros_like(time), -1.0
    for _ in range(multisine.draws):
        shape = _wave(time, multisine, random.uniform(0.0, 2.0 * pi, len(multisine.frequencies)))
        speed = np.gradient(shape, period)
        acceleration = np.gradient(speed, period)
        scale = min(room / np.abs(shape).max(), max_speed / np.abs(speed).max(), max_acceleration / np.abs(acceleration).max())
        effective = scale * float(np.std(acceleration))
        if effective > most:
            best, most = scale * shape, effective
    return np.asarray(center + 0.95 * best)


def _wave(time: Positions, multisine: Multisine, phases: Positions) -> Positions:
    """The wave (n,) of these phases, its size left open."""
    frequencies = np.array(multisine.frequencies)
    waves = np.sin(2.0 * pi * np.outer(time, frequencies) + phases) / frequencies**1.5
    return np.asarray(waves.sum(axis=1) * _fade(time / time[-1], multisine.fade))


def _fade(u: Positions, share: float) -> Positions:
    """1 in the middle, 0 with zero slope and curvature at both ends, over a `share` each."""
    edge = np.clip(np.minimum(u, 1.0 - u) / share, 0.0, 1.0)
    return np.asarray(edge**3 * (10.0 - 15.0 * edge + 6.0 * edge**2))


def side_by_side(paths: list[Positions]) -> NDArray[np.float64]:
    """Paths of several axes as columns (n, axes); the shorter ones wait at their end."""
    length = max(len(path) for path in paths)
    return np.column_stack([np.concatenate([path, np.full(length - len(path), path[-1])]) for path in paths])
