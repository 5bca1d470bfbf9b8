"""Set-points to demands of every servo period: linear, or a uniform cubic B-spline; all axes of a machine in parallel."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from drivetwin.foundation.compiled import in_place
from drivetwin.foundation.enums import quick


@quick
class Interpolation(IntEnum):
    """Kinds of interpolation (as P370 CON_IP of a ServoOne counts them)."""

    LINEAR = 1
    CUBIC_SPLINE = 2


COURSE = np.dtype(
    [
        ("kind", "i8"),  # Interpolation; 0: the demand of the coming cycle is not of set-points
        ("setpoint", "f8"),  # rad, as it stands in the coming cycle
        ("interval", "i8"),  # servo periods from a set-point to the next
        ("faster", "f8"),  # rad/s, velocity offset
        ("torque", "f8"),  # N·m, torque offset
        ("p0", "f8"),  # rad, the set-points taken last
        ("p1", "f8"),
        ("p2", "f8"),
        ("p3", "f8"),
        ("start", "f8"),  # rad, where the straight line to p3 begins
        ("reached", "f8"),  # rad, at the end of the last cycle
        ("passed", "i8"),  # servo periods of the segment that are over
        ("total", "i8"),  # servo periods of the segment
    ]
)
"""The last set-points of an axis, and the way between them.

A segment lasts for the time between two set-points, which may be several cycles. It begins where the one before has ended.
A set-point that comes before that begins a new one where the axis stands or the kind is linear; a spline takes it in turn.
"""


@in_place
def fill_demands(courses, demand, length) -> None:  # type: ignore[no-untyped-def]  # record arrays have no static type
    """Demand (periods, n, 4) of the coming cycle of those axes that follow set-points; `length` of a servo period [s]."""
    for axis in range(courses.shape[0]):
        if courses[axis].kind != 0:
            _fill(courses[axis], demand[:, axis], length)


@in_place
def _fill(course, demand, length) -> None:  # type: ignore[no-untyped-def]
    ended = course.passed >= course.total
    if ended or course.setpoint != course.p3:
        _take(course, ended)
    if course.kind == 1:
        _line(course, demand, length)
    else:
        _spline(course, demand, length)
    course.passed += demand.shape[0]
    course.reached = demand[demand.shape[0] - 1, 0]
    course.kind = 0


@in_place
def _take(course, ended) -> None:  # type: ignore[no-untyped-def]
    stands = course.p0 == course.p1 == course.p2 == course.p3
    if not (ended or course.kind == 1 or stands):
        return
    course.start = course.p3 if ended else course.reached
    course.p0 = course.p1
    course.p1 = course.p2
    course.p2 = course.p3
    course.p3 = course.setpoint
    course.passed = 0
    course.total = course.interval


@in_place
def _line(course, demand, length) -> None:  # type: ignore[no-untyped-def]
    """A straight line that reaches its end after `total` servo periods."""
    start, end, total = course.start, course.p3, course.total
    velocity = (end - start) / (total * length)
    for period in range(demand.shape[0]):
        step = course.passed + period + 1
        demand[period, 0] = start + (end - start) * step / total if step <= total else end
        demand[period, 1] = velocity if step <= total else 0.0
        demand[period, 2] = course.faster
        demand[period, 3] = course.torque


@in_place
def _spline(course, demand, length) -> None:  # type: ignore[no-untyped-def]
    """A segment of the uniform cubic B-spline of four set-points.

    Continuous to the acceleration; a set-point later than the straight line; off the points by T^2/6 of the acceleration.
    De Boor, A Practical Guide to Splines, 1978, ch. IX.
    """
    p0, p1, p2, p3, total = course.p0, course.p1, course.p2, course.p3, course.total
    duration = total * length
    for period in range(demand.shape[0]):
        u = min(course.passed + period + 1, total) / total
        demand[period, 0] = (
            p1
            + ((p0 - p1) + (p2 - p1)) / 6.0
            + u * (p2 - p0) / 2.0
            + u * u * (p0 - 2.0 * p1 + p2) / 2.0
            + u * u * u * (p3 - p0 + 3.0 * (p1 - p2)) / 6.0
        )
        demand[period, 1] = ((p2 - p0) / 2.0 + u * (p0 - 2.0 * p1 + p2) + u * u * (p3 - p0 + 3.0 * (p1 - p2)) / 2.0) / duration
        demand[period, 2] = course.faster
        demand[period, 3] = course.torque
