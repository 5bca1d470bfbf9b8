"""Set-points of a cycle to demands of every servo period: linear, or a uniform cubic B-spline."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from drivetwin.compiled import compiled
from emulator.drive.servo import SERVO_PERIOD


class Interpolation(IntEnum):
    """Kinds of interpolation (as P370 CON_IP of a ServoOne counts them)."""

    LINEAR = 1
    CUBIC_SPLINE = 2


@compiled
def linear_cycle(start: float, end: float, demand) -> None:  # type: ignore[no-untyped-def]
    """Fill demand (n, 4) with a straight line that reaches `end` at the end of the cycle."""
    periods = demand.shape[0]
    velocity = (end - start) / (periods * SERVO_PERIOD)
    for period in range(periods):
        demand[period, 0] = start + (end - start) * (period + 1) / periods
        demand[period, 1] = velocity


@compiled
def spline_cycle(points, demand) -> None:  # type: ignore[no-untyped-def]
    """Fill demand (n, 4) with one segment of the uniform cubic B-spline of four set-points (4,).

    Continuous to the acceleration; a cycle later than the straight line; off the points by T^2/6 of the acceleration.
    De Boor, A Practical Guide to Splines, 1978, ch. IX.
    """
    p0, p1, p2, p3 = points[0], points[1], points[2], points[3]
    periods = demand.shape[0]
    duration = periods * SERVO_PERIOD
    for period in range(periods):
        u = (period + 1) / periods
        demand[period, 0] = (
            p1
            + ((p0 - p1) + (p2 - p1)) / 6.0
            + u * (p2 - p0) / 2.0
            + u * u * (p0 - 2.0 * p1 + p2) / 2.0
            + u * u * u * (p3 - p0 + 3.0 * (p1 - p2)) / 6.0
        )
        demand[period, 1] = ((p2 - p0) / 2.0 + u * (p0 - 2.0 * p1 + p2) + u * u * (p3 - p0 + 3.0 * (p1 - p2)) / 2.0) / duration


class Interpolator:
    """The last set-points of an axis [rad] and the demand between them."""

    def __init__(self) -> None:
        self._points: NDArray[np.float64] = np.zeros(4)

    @property
    def setpoint(self) -> float:
        """The last set-point [rad]."""
        return float(self._points[3])

    def start_at(self, angle: float) -> None:
        """Stand still at `angle` [rad]: enabling must not jump."""
        self._points[:] = angle

    def cycle(self, setpoint: float, kind: Interpolation, demand: NDArray[np.float64]) -> None:
        """Take the set-point [rad] of this cycle and fill position and velocity of `demand` (n, 4)."""
        points = self._points
        points[:3] = points[1:]
        points[3] = setpoint
        if kind is Interpolation.CUBIC_SPLINE:
            spline_cycle(points, demand)
        else:
            linear_cycle(points[2], points[3], demand)
