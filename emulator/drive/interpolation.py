"""Set-points of a cycle to demands of every servo period: linear, or a uniform cubic B-spline."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.foundation.compiled import in_place
from drivetwin.foundation.enums import quick


@quick
class Interpolation(IntEnum):
    """Kinds of interpolation (as P370 CON_IP of a ServoOne counts them)."""

    LINEAR = 1
    CUBIC_SPLINE = 2


@in_place
def linear_cycle(  # type: ignore[no-untyped-def]
    start: float, end: float, passed: int, total: int, faster: float, torque: float, demand
) -> None:
    """Fill demand (n, 4) with a straight line that reaches `end` after `total` servo periods, `passed` of them over.

    `faster` [rad/s] and `torque` [N·m] are the offsets beside it.
    """
    velocity = (end - start) / (total * SERVO_PERIOD)
    for period in range(demand.shape[0]):
        step = passed + period + 1
        demand[period, 0] = start + (end - start) * step / total if step <= total else end
        demand[period, 1] = velocity if step <= total else 0.0
        demand[period, 2] = faster
        demand[period, 3] = torque


@in_place
def spline_cycle(  # type: ignore[no-untyped-def]
    p0: float, p1: float, p2: float, p3: float, passed: int, total: int, faster: float, torque: float, demand
) -> None:
    """Fill demand (n, 4) with a segment of the uniform cubic B-spline of four set-points, as `linear_cycle`.

    Continuous to the acceleration; a set-point later than the straight line; off the points by T^2/6 of the acceleration.
    De Boor, A Practical Guide to Splines, 1978, ch. IX.
    """
    duration = total * SERVO_PERIOD
    for period in range(demand.shape[0]):
        u = min(passed + period + 1, total) / total
        demand[period, 0] = (
            p1
            + ((p0 - p1) + (p2 - p1)) / 6.0
            + u * (p2 - p0) / 2.0
            + u * u * (p0 - 2.0 * p1 + p2) / 2.0
            + u * u * u * (p3 - p0 + 3.0 * (p1 - p2)) / 6.0
        )
        demand[period, 1] = ((p2 - p0) / 2.0 + u * (p0 - 2.0 * p1 + p2) + u * u * (p3 - p0 + 3.0 * (p1 - p2)) / 2.0) / duration
        demand[period, 2] = faster
        demand[period, 3] = torque


class Interpolator:
    """The last set-points of an axis [rad] and the demand between them.

    A segment lasts for the time between two set-points, which may be several cycles. It begins where the one before has ended.
    A set-point that comes before that begins a new one where the axis stands or the kind is linear; a spline takes it in turn.
    """

    def __init__(self) -> None:
        self._points = (0.0, 0.0, 0.0, 0.0)
        self._start = self._reached = 0.0
        self._passed = self._total = 0

    @property
    def setpoint(self) -> float:
        """The last set-point [rad]."""
        return self._points[3]

    def start_at(self, angle: float) -> None:
        """Stand still at `angle` [rad]: enabling must not jump."""
        self._points = (angle, angle, angle, angle)
        self._start = self._reached = angle
        self._passed = self._total = 0

    def cycle(
        self,
        setpoint: float,
        kind: Interpolation,
        demand: NDArray[np.float64],
        interval: int,
        offsets: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """Take the set-point [rad] as it stands in this cycle and fill `demand` (n, 4).

        `interval`: servo periods from a set-point to the next. `offsets` of velocity [rad/s] and torque [N·m].
        """
        ended = self._passed >= self._total
        if ended or setpoint != self._points[3]:
            self._take(setpoint, kind, interval, ended)
        if kind is Interpolation.CUBIC_SPLINE:
            spline_cycle(*self._points, self._passed, self._total, *offsets, demand)
        else:
            linear_cycle(self._start, self._points[3], self._passed, self._total, *offsets, demand)
        self._passed += len(demand)
        self._reached = demand.item(-1, 0)

    def _take(self, setpoint: float, kind: Interpolation, interval: int, ended: bool) -> None:
        points = self._points
        if not (ended or kind is Interpolation.LINEAR or len(set(points)) == 1):
            return
        self._start = points[3] if ended else self._reached
        self._points = (points[1], points[2], points[3], setpoint)
        self._passed, self._total = 0, interval
