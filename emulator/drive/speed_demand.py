"""Speed demand of modes 2, 3 and 9: starts at the axis's speed, obeys the limits, and continues from the previous cycle."""

from __future__ import annotations

from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.limits import PositionLimits
from drivetwin.emulator.drive.profile_generator import Bounds, Motion, Profile, change_speed
from drivetwin.emulator.drive.ramp import approach, ramp_cycle
from drivetwin.emulator.drive.servo import SERVO_PERIOD, VELOCITY


class SpeedDemand:
    """Fills position and velocity of the demand, in one of three ways. `velocity` is that of its end [rad/s]."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._limits = PositionLimits(axis)
        self._profile: Profile | None = None
        self._planned: tuple[float, Bounds] | None = None
        self._end: float | None = None
        self._rate = 0.0
        self.velocity = 0.0

    def start(self) -> None:
        """No jump: from the speed that the axis has."""
        self.velocity = float(self._axis.servo.state["velocity"])
        self._profile = self._planned = None
        self._end = None

    def position_allows(self, speed: float, deceleration: float) -> float:
        """`speed` [rad/s], or the highest from which the axis still stops at the software limit by `deceleration`."""
        return self._limits.cap_speed(speed, self._position(), deceleration)

    def line(self, target: float, periods: int) -> None:
        """A straight line to `target` [rad/s] within so many servo periods from when it was first asked for."""
        self._profile = self._planned = None
        if target != self._end:
            self._end, self._rate = target, abs(target - self.velocity) / (periods * SERVO_PERIOD)
        self.velocity = approach(self.velocity, target, self._rate, self._axis.servo.demand[:, VELOCITY])

    def ramp(self, target: float, up: float, down: float) -> None:
        """Towards `target` [rad/s] by `up` while speeding up and `down` while slowing down [rad/s²]."""
        self._profile = self._planned = None
        demand = self._axis.servo.demand
        ramp_cycle(self._position(), self.velocity, target, up, down, demand)
        self.velocity = float(demand[-1, VELOCITY])

    def smooth(self, target: float, bounds: Bounds) -> None:
        """Towards `target` [rad/s] within the bounds of acceleration and jerk."""
        demand = self._axis.servo.demand
        if self._profile is None or self._planned != (target, bounds):
            start = Motion(self._position(), self.velocity) if self._profile is None else self._profile.now()
            self._profile, self._planned = change_speed(start, target, bounds), (target, bounds)
        self._profile.sample(demand)
        self.velocity = float(demand[-1, VELOCITY])

    def _position(self) -> float:
        return float(self._axis.servo.state["position"])
