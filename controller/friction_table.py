"""The ServoOne friction table that approximates an identified friction law best.

P386 CON_SCON_TFric (2182h) are torques at the speeds P387 CON_SCON_TFricSpeed (2183h). Points 1 to 3 always act; points 4 and 5
act only while the axis accelerates, which friction does not depend on: they are 0, unused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brute, linprog

from drivetwin.controller.machine import Axis
from drivetwin.foundation.errors import UserError
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.recording.recording import Samples

POINTS, ALWAYS_ACTIVE = 5, 3

SPEEDS = 200
"""Speeds at which table and law are compared, evenly over the range and as many by equal ratios down to rest."""

SLOWEST = 1e-3
"""The least of them, as a share of the Stribeck velocity."""

SEARCHED = (slice(0.0, 1.0, 15j), slice(0.0, 0.7, 8j))
"""Grid of the middle point's speed (its logarithm, 0..1 of its range) and of the first point's share of it."""


@dataclass(frozen=True)
class Point:
    """Of the table, on the motor's shaft: torque [N·m] at a speed [rad/s]."""

    speed: float
    torque: float


UNUSED = Point(0.0, 0.0)


@dataclass(frozen=True)
class FrictionTable:
    """Five points, in the drive's order, and how far the table is from the law at worst (joint side) [N·m or N]."""

    points: tuple[Point, ...]
    deviation: float


def friction_table(law: FrictionLaw, axis: Axis) -> FrictionTable:
    """The table whose worst deviation from the law over the axis's speeds, both directions alike, is least.

    The drive goes straight from point to point and stays at the first one's torque below it, in the direction of the speed.
    So what differs by direction is left out, and stands in `deviation`; so is the offset, which is a load and does not.
    Raises UserError for a law that brakes nowhere or drives somewhere: no friction.
    """
    knots = _knots(law, axis.max_speed)
    torques, _ = _closest(law, knots)
    if torques.min() <= 0.0:
        raise UserError(
            f"friction of joint {axis.joint} would be {torques.min():.4g} at {knots[int(torques.argmin())]:.4g} (joint, SI), "
            "and friction brakes at every speed: identify it anew, with strokes up to the axis's full speed"
        )
    speeds = _speeds(law, knots)
    tabled = np.interp(speeds, knots, torques)
    ratio = axis.gear_ratio
    points = [Point(float(speed) * ratio, float(torque) / ratio) for speed, torque in zip(knots, torques, strict=True)]
    apart = law.torque(speeds) - law.offset - tabled, law.torque(-speeds) - law.offset + tabled
    return FrictionTable((*points, *[UNUSED] * (POINTS - ALWAYS_ACTIVE)), float(np.abs(apart).max()))


def _speeds(law: FrictionLaw, knots: Samples) -> Samples:
    """Speeds (n,) at which to compare [rad/s or m/s], above 0 and up to the last knot; where the table bends, too."""
    top = float(knots[-1])
    slowest = SLOWEST * min(law.stribeck_velocity or top, top)
    even = np.linspace(0.0, top, SPEEDS)[1:]
    return np.unique(np.concatenate([even, np.geomspace(slowest, top, SPEEDS), knots[knots > 0.0]]))


def _knots(law: FrictionLaw, top: float) -> Samples:
    """Speeds of the three points (3,) at which the closest table is closest of all; without Stribeck any do."""
    if law.stribeck_velocity is None:
        return np.array([0.0, 0.5 * top, top])
    low, high = np.log(0.1 * min(law.stribeck_velocity, top)), np.log(min(3.0 * law.stribeck_velocity, 0.99 * top))

    def knots(shape: Samples) -> Samples:
        middle, share = np.exp(low + np.clip(shape[0], 0.0, 1.0) * (high - low)), np.clip(shape[1], 0.0, 0.99)
        return np.array([share * middle, middle, top])

    def deviation(shape: Samples) -> float:
        return _closest(law, knots(shape))[1]

    return knots(np.asarray(brute(deviation, SEARCHED), dtype=np.float64))


def _closest(law: FrictionLaw, knots: Samples) -> tuple[Samples, float]:
    """Torques at the knots (3,) whose straight lines are closest to the law's mean of both directions, and how far at worst.

    A linear programme (Boyd and Vandenberghe, Convex Optimization, 2004, 6.1.1, Chebyshev approximation).
    """
    speeds = _speeds(law, knots)
    torque = (law.torque(speeds) - law.torque(-speeds)) / 2.0
    hats = np.column_stack([np.interp(speeds, knots, row) for row in np.eye(len(knots))])
    bound, scale = np.ones((len(speeds), 1)), np.abs(torque).max()
    if scale == 0.0:
        return np.zeros(len(knots)), 0.0
    found = linprog(
        [*np.zeros(len(knots)), 1.0],
        A_ub=np.block([[hats, -bound], [-hats, -bound]]),
        b_ub=np.concatenate([torque, -torque]) / scale,
        bounds=[*[(None, None)] * len(knots), (0.0, None)],
    )
    *torques, deviation = scale * np.asarray(found.x, dtype=np.float64)
    return np.array(torques), float(deviation)
