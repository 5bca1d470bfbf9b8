"""Rest to rest in seven segments of constant jerk (double S): what a drive can follow without being shaken."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cbrt, isfinite, sqrt

import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.errors import UserError
from drivetwin.motion.sample_times import sample_times

Positions = NDArray[np.float64]


@dataclass(frozen=True)
class MotionLimits:
    """Most speed [m/s or rad/s], acceleration [m/s² or rad/s²] and jerk [m/s³ or rad/s³] of a move, both ways alike.

    Raises UserError naming the one that is not positive and finite.
    """

    speed: float
    acceleration: float
    jerk: float

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "jerk"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise UserError(f"the {name} limit of a jerk-limited move must be positive and finite; it is {value:g}")


@dataclass(frozen=True)
class Motion:
    """One axis, all (n,): position [m or rad], velocity [per s] and acceleration [per s²], its exact derivatives."""

    position: Positions
    velocity: Positions
    acceleration: Positions


@dataclass(frozen=True)
class JerkLimited:
    """A double-S profile from rest at `start` to rest at `end`: jerk, constant acceleration, jerk; cruise; the same back.

    Durations [s] of each jerk segment, of each segment of constant acceleration, and of the cruise. Jerk, acceleration and
    speed follow from them and from the way, so that the end is met exactly.
    """

    start: float
    end: float
    jerk_time: float
    hold_time: float
    cruise_time: float

    @property
    def ramp_time(self) -> float:
        """Seconds from rest to peak speed."""
        return 2.0 * self.jerk_time + self.hold_time

    @property
    def duration(self) -> float:
        """Seconds from rest to rest."""
        return 2.0 * self.ramp_time + self.cruise_time

    @property
    def peak_speed(self) -> float:
        """Velocity of the cruise, signed: way = peak (ramp + cruise)."""
        return (self.end - self.start) / (self.ramp_time + self.cruise_time) if self.end != self.start else 0.0

    @property
    def peak_acceleration(self) -> float:
        """Acceleration while speeding up, signed."""
        return self.peak_speed / (self.jerk_time + self.hold_time) if self.end != self.start else 0.0

    @property
    def jerk(self) -> float:
        """Jerk of the first segment, signed."""
        return self.peak_acceleration / self.jerk_time if self.end != self.start else 0.0

    def sample(self, period: float) -> Motion:
        """States at period, 2 period, ... (n,), n = ceil(duration / period): the start is left out, the last is the end."""
        return self.at(sample_times(self.duration, period))

    def at(self, time: NDArray[np.float64]) -> Motion:
        """States at `time` (n,) [s]; it stands before the start and after the end. The second half is the first, backwards."""
        braking = time > 0.5 * self.duration
        way, speed, acceleration = self._from_rest(np.maximum(np.where(braking, self.duration - time, time), 0.0))
        return Motion(
            position=np.where(braking, self.end - way, self.start + way),
            velocity=speed,
            acceleration=np.where(braking, -acceleration, acceleration),
        )

    def scaled_to(self, duration: float) -> JerkLimited:
        """The same shape in `duration` seconds: slower by k, speed by 1/k, acceleration by 1/k², jerk by 1/k³.

        A move without a way stands for so long. Raises UserError where `duration` is shorter, which would break the limits.
        """
        if duration < self.duration:
            raise UserError(
                f"a move of {self.duration:.6g} s cannot be scaled to {duration:.6g} s: "
                "it keeps its limits only when it takes longer"
            )
        if self.duration == 0.0:
            return replace(self, cruise_time=duration)
        k = duration / self.duration
        return replace(self, jerk_time=k * self.jerk_time, hold_time=k * self.hold_time, cruise_time=k * self.cruise_time)

    def _from_rest(self, time: Positions) -> tuple[Positions, Positions, Positions]:
        """Way, velocity and acceleration (n,), signed, `time` after the start, up to the end of the cruise."""
        jerk, peak = self.jerk, self.peak_acceleration
        rising = np.minimum(time, self.jerk_time)
        holding = np.clip(time - self.jerk_time, 0.0, self.hold_time)
        falling = np.clip(time - self.jerk_time - self.hold_time, 0.0, self.jerk_time)
        cruising = np.maximum(time - self.ramp_time, 0.0)
        after_rising = 0.5 * peak * self.jerk_time
        after_holding = after_rising + peak * self.hold_time
        way = (
            jerk * rising**3 / 6.0
            + holding * (after_rising + 0.5 * peak * holding)
            + falling * (after_holding + falling * (0.5 * peak - jerk * falling / 6.0))
            + cruising * self.peak_speed
        )
        velocity = 0.5 * jerk * rising**2 + peak * holding + falling * (peak - 0.5 * jerk * falling)
        return way, velocity, jerk * (rising - falling)


def jerk_limited(start: float, end: float, limits: MotionLimits) -> JerkLimited:
    """The quickest profile from rest at `start` to rest at `end` within `limits`, in closed form.

    Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, sec. 3.4 with both end velocities 0:
    the speed limit is reached, or only the acceleration limit, or neither.
    """
    way = abs(end - start)
    if way == 0.0:
        return JerkLimited(start, end, 0.0, 0.0, 0.0)
    jerk_time, ramp_time = _ramp_to(limits.speed, limits)
    if way >= limits.speed * ramp_time:
        return JerkLimited(start, end, jerk_time, ramp_time - 2.0 * jerk_time, way / limits.speed - ramp_time)
    jerk_time = limits.acceleration / limits.jerk
    hold_time = sqrt(0.25 * jerk_time**2 + way / limits.acceleration) - 1.5 * jerk_time
    if hold_time >= 0.0:
        return JerkLimited(start, end, jerk_time, hold_time, 0.0)
    return JerkLimited(start, end, cbrt(way) / cbrt(2.0 * limits.jerk), 0.0, 0.0)


def _ramp_to(speed: float, limits: MotionLimits) -> tuple[float, float]:
    """Seconds of a jerk segment, and of the whole ramp from rest to `speed`."""
    if speed * limits.jerk >= limits.acceleration**2:
        jerk_time = limits.acceleration / limits.jerk
        return jerk_time, jerk_time + speed / limits.acceleration
    jerk_time = sqrt(speed / limits.jerk)
    return jerk_time, 2.0 * jerk_time
