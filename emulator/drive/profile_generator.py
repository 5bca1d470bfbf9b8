"""Positioning profiles, trapezoidal (6086h = 0) and jerk-limited in seven segments (6086h = 3), from any initial motion.

A profile is a chain of segments of constant jerk. It is a change of speed to a peak, a cruise, and a change of speed to
zero; the peak is solved for so that the way is right. Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines
and Robots, 2008, sections 3.2 (trapezoidal) and 3.4 (double S).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.foundation.compiled import in_place


@dataclass(frozen=True)
class Motion:
    """Position [rad], velocity [rad/s] and acceleration [rad/s²] at an instant."""

    position: float
    velocity: float
    acceleration: float = 0.0


@dataclass(frozen=True)
class Bounds:
    """Speed [rad/s], acceleration while speeding up and while slowing down [rad/s²], jerk [rad/s³] (infinite: trapezoid)."""

    speed: float
    up: float
    down: float
    jerk: float = inf


Pieces = list[tuple[float, float, float]]
"""(duration [s], acceleration at its start [rad/s²], jerk [rad/s³]) of each segment."""


class Profile:
    """A planned motion. `sample` gives it period after period; the end is exact."""

    def __init__(self, start: Motion, pieces: Pieces, end: float | None) -> None:
        self._segments = _segments(start, pieces)
        self.duration = float(self._segments[:, 0].sum())
        last = _at(self._segments, self.duration)
        self._end = Motion(last.position if end is None else end, 0.0 if end is not None else last.velocity)
        self._time = 0.0

    @property
    def ended(self) -> bool:
        """Whether all of it has been sampled."""
        return self._time >= self.duration

    def at(self, time: float) -> Motion:
        """State `time` seconds after the start."""
        return self._end if time >= self.duration else _at(self._segments, time)

    def now(self) -> Motion:
        """State at the end of what has been sampled."""
        return self.at(self._time)

    def sample(self, demand: NDArray[np.float64]) -> None:
        """Fill position and velocity of demand (n, 4), a servo period a row, and move on."""
        sample_segments(self._segments, self._time, self._end.position, self._end.velocity, demand)
        self._time += len(demand) * SERVO_PERIOD


def move_to(start: Motion, target: float, bounds: Bounds) -> Profile:
    """The profile from `start` that ends at rest at `target` [rad]. Bounds that are infinite or 0 act within a period."""
    bounds = _finite(bounds, abs(target - start.position))
    way = target - start.position
    least, most = _way(start, -bounds.speed, bounds), _way(start, bounds.speed, bounds)
    if way >= most:
        peak, cruise = bounds.speed, (way - most) / bounds.speed
    elif way <= least:
        peak, cruise = -bounds.speed, (least - way) / bounds.speed
    else:
        peak, cruise = _solve(start, way, bounds), 0.0
    return Profile(start, [*_change(start, peak, bounds), (cruise, 0.0, 0.0), *_stop(peak, bounds)], target)


def change_speed(start: Motion, speed: float, bounds: Bounds) -> Profile:
    """The profile from `start` to a constant velocity `speed` [rad/s], which it keeps."""
    bounds = _finite(bounds, max(abs(speed), abs(start.velocity)) * SERVO_PERIOD)
    return Profile(start, [*_change(start, speed, bounds), (1e9, 0.0, 0.0)], None)


def come_to_rest(start: Motion, bounds: Bounds) -> Profile:
    """The profile from `start` to a standstill, wherever that is."""
    bounds = _finite(bounds, abs(start.velocity) * SERVO_PERIOD)
    return Profile(start, _change(start, 0.0, bounds), None)


def _finite(bounds: Bounds, way: float) -> Bounds:
    """Bounds that a servo period can tell from none."""
    speed = min(bounds.speed if bounds.speed > 0.0 else inf, max(way, 1e-9) / SERVO_PERIOD)
    most = max(speed / SERVO_PERIOD, 1e-9)
    up, down = (min(rate if rate > 0.0 else inf, most) for rate in (bounds.up, bounds.down))
    return Bounds(speed, up, down, bounds.jerk if bounds.jerk > 0.0 else inf)


def _solve(start: Motion, way: float, bounds: Bounds) -> float:
    """Peak velocity for which speeding to it and stopping makes `way`: bisection to the last bit."""
    low, high = -bounds.speed, bounds.speed
    for _ in range(100):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if _way(start, middle, bounds) < way:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _way(start: Motion, peak: float, bounds: Bounds) -> float:
    pieces = [*_change(start, peak, bounds), *_stop(peak, bounds)]
    position, velocity = 0.0, start.velocity
    for duration, acceleration, jerk in pieces:
        position += duration * (velocity + duration * (acceleration / 2.0 + duration * jerk / 6.0))
        velocity += duration * (acceleration + duration * jerk / 2.0)
    return position


def _stop(velocity: float, bounds: Bounds) -> Pieces:
    return _change(Motion(0.0, velocity), 0.0, bounds)


def _change(start: Motion, velocity: float, bounds: Bounds) -> Pieces:
    """Segments that bring the velocity to `velocity` and the acceleration to 0."""
    if bounds.jerk == inf:
        return _linear_change(start.velocity, velocity, bounds)
    return _smooth_change(start, velocity, bounds)


def _linear_change(before: float, after: float, bounds: Bounds) -> Pieces:
    if before * after < 0.0:
        return [*_linear_change(before, 0.0, bounds), *_linear_change(0.0, after, bounds)]
    rate = bounds.up if abs(after) > abs(before) else bounds.down
    return [(abs(after - before) / rate, copysign(rate, after - before), 0.0)]


def _smooth_change(start: Motion, after: float, bounds: Bounds) -> Pieces:
    """Jerk, constant acceleration, jerk: Biagiotti and Melchiorri, eq. 3.32; a reversal keeps the lesser of both rates."""
    jerk, before, acceleration = bounds.jerk, start.velocity, start.acceleration
    at_once = before + acceleration * abs(acceleration) / (2.0 * jerk)
    sign = 1.0 if after >= at_once else -1.0
    first, change = sign * acceleration, sign * (after - before)
    limit = max(_rate(before, after, bounds), abs(first))
    peak = sqrt(max(jerk * change + 0.5 * first * first, 0.0))
    hold = 0.0
    if peak > limit:
        hold = (change - (2.0 * limit * limit - first * first) / (2.0 * jerk)) / limit
        peak = limit
    peak = max(peak, first)
    return [
        ((peak - first) / jerk, sign * first, sign * jerk),
        (hold, sign * peak, 0.0),
        (peak / jerk, sign * peak, -sign * jerk),
    ]


def _rate(before: float, after: float, bounds: Bounds) -> float:
    if before * after < 0.0:
        return min(bounds.up, bounds.down)
    return bounds.up if abs(after) > abs(before) else bounds.down


def _segments(start: Motion, pieces: Pieces) -> NDArray[np.float64]:
    """Rows of duration, position, velocity, acceleration at its start, jerk."""
    rows = []
    position, velocity = start.position, start.velocity
    for duration, acceleration, jerk in pieces:
        rows.append((duration, position, velocity, acceleration, jerk))
        position += duration * (velocity + duration * (acceleration / 2.0 + duration * jerk / 6.0))
        velocity += duration * (acceleration + duration * jerk / 2.0)
    return np.array(rows)


def _at(segments: NDArray[np.float64], time: float) -> Motion:
    segment = 0
    while segment < len(segments) - 1 and time > segments[segment, 0]:
        time -= segments[segment, 0]
        segment += 1
    duration, position, velocity, acceleration, jerk = segments[segment]
    time = min(time, duration)
    return Motion(
        float(position + time * (velocity + time * (acceleration / 2.0 + time * jerk / 6.0))),
        float(velocity + time * (acceleration + time * jerk / 2.0)),
        float(acceleration + time * jerk),
    )


@in_place
def sample_segments(segments, time: float, end: float, end_velocity: float, demand) -> None:  # type: ignore[no-untyped-def]
    """Fill demand (n, 4) with the state after each servo period from `time` [s] on."""
    segment, passed = 0, 0.0
    count = segments.shape[0]
    for period in range(demand.shape[0]):
        instant = time + (period + 1) * SERVO_PERIOD
        while segment < count and instant > passed + segments[segment, 0]:
            passed += segments[segment, 0]
            segment += 1
        if segment == count:
            demand[period, 0] = end
            demand[period, 1] = end_velocity
            continue
        row = segments[segment]
        t = instant - passed
        demand[period, 0] = row[1] + t * (row[2] + t * (row[3] / 2.0 + t * row[4] / 6.0))
        demand[period, 1] = row[2] + t * (row[3] + t * row[4] / 2.0)
