"""Waves that a torque may have over the position: which wavelengths a motion shows, and amplitude and phase of a sum."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, hypot, inf

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.replay import motor_torque

_BINS = 8192
_NEIGHBOURS = 65
_USUAL_ORDERS = tuple(float(order) for order in range(1, 49))
_SHOWN = 10
_LEAST_ORDER = 0.9
FRACTIONAL = 1e5
"""To one, that an order is a whole number of waves a motor turn."""
_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
_LONGEST = 8.0
"""Waves a travel up to which all lengths are tried."""


def amplitude_and_phase(coefficients: Sequence[float]) -> tuple[float, float]:
    """Of a sin(x) + b cos(x) = amplitude sin(x + phase), given (a, b)."""
    return hypot(*coefficients), atan2(coefficients[1], coefficients[0])


def travel(motion: Motion) -> float:
    """Between the ends of a motion [rad or m]."""
    return float(np.ptp(motion.position))


def longest(motion: Motion) -> float:
    """Longest wavelength [rad or m] that a motion shows: all of the travel, or as far as a position means the same."""
    return min(travel(motion), motion.unique)


def top_speed(motion: Motion) -> float:
    """Highest speed [rad/s or m/s], a few outliers aside."""
    return float(np.quantile(np.abs(motion.velocity), 0.999))


def moving(motion: Motion) -> NDArray[np.bool_]:
    """Samples (n,) clearly in motion."""
    return np.asarray(np.abs(motion.velocity) > 0.01 * top_speed(motion))


def unexplained(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque (n,) that the axis, as it is, leaves over of the measured one."""
    return np.asarray(motion.torque - motor_torque(motion, axis))


def shortest(motion: Motion) -> float:
    """Shortest wavelength [rad or m] that passes within the motion's band most of the time; infinite if nothing moves."""
    speeds = np.abs(motion.velocity[moving(motion)])
    highest = min(motion.band, 0.5 / motion.period)
    return float(np.quantile(speeds, 0.1)) / highest if len(speeds) else inf


def strongest(motion: Motion, torque: NDArray[np.float64], most: int) -> list[float]:
    """Wave numbers [1/rad or 1/m], lowest first, at which a torque (n,) over the position stands out most of its neighbours.

    `most` peaks of a periodogram over the travel, four points a resolvable wave number; from one wave a travel up.
    """
    way, moves = travel(motion), moving(motion)
    if way == 0.0 or not moves.any():
        return []
    place = ((motion.position[moves] - motion.position.min()) / way * (_BINS - 1)).astype(int)
    centred = torque[moves] - torque[moves].mean()
    if np.abs(centred).max() <= _ROUNDING * np.abs(torque[moves]).max():
        return []
    power = np.abs(np.fft.rfft(np.bincount(place, weights=centred, minlength=_BINS), 4 * _BINS))
    numbers = np.arange(len(power)) / (4.0 * way)
    power /= ndimage.uniform_filter1d(power, _NEIGHBOURS)
    inside = power[1:-1]
    peaks = 1 + np.flatnonzero((inside >= power[:-2]) & (inside > power[2:]))
    peaks = peaks[(numbers[peaks] >= 1.0 / way) & (numbers[peaks] <= 1.0 / shortest(motion))]
    return sorted(float(numbers[peak]) for peak in peaks[np.argsort(power[peaks])[::-1][:most]])


def turns_apart(motion: Motion, axis: AxisDynamics) -> float:
    """Orders that differ by a radian over the whole of a motion [waves a motor turn]."""
    return 1.0 / max(axis.gear_ratio * travel(motion), 1.0)


def long_waves(motion: Motion) -> list[float]:
    """Wave numbers [1/rad or 1/m] of 1 to 8 waves a travel, half a wave apart.

    A spectrum tells them badly, for friction and weight vary as slowly; there are so few that each can be tried.
    """
    way = travel(motion)
    return [float(number) / way for number in np.arange(1.0, _LONGEST + 0.25, 0.5)] if way > 0.0 else []


def orders(motion: Motion, axis: AxisDynamics, torque: NDArray[np.float64]) -> list[float]:
    """Waves a motor turn to look for in a torque (n,): those that gears and motors have, and those that it shows; 1 or more.

    Half a wave a travel tells the amplitude of one whose length is known.
    """
    turn = 2.0 * np.pi / axis.gear_ratio
    usual = [order for order in _USUAL_ORDERS if shortest(motion) <= turn / order <= 2.0 * travel(motion)]
    return sorted({*usual, *(number * turn for number in strongest(motion, torque, _SHOWN) if number * turn > _LEAST_ORDER)})
