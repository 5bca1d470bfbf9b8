"""Default speeds and ramps of a drive that is not configured yet: fractions of the axis's limits, so that it can move."""

from __future__ import annotations

from math import inf, pi

from drivetwin.drive_profiles.profile import FLOATS
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.drive.limits import RPM
from drivetwin.emulator.drive.objects import optional, store
from drivetwin.emulator.machine import Axis

CROSSING = 10.0
"""Time that the way between the limit switches takes at the speed of a profile [s]."""

SHARE_OF_MOTOR_SPEED = 0.25
"""The speed of a profile is no more than this share of what the motor bears."""

RAMP_TIME, STOP_TIME, JERK_TIME = 0.25, 0.0625, 0.05
"""Time to the speed of a profile, from it by a quick stop, and to its acceleration [s]."""

SEARCH, ZERO = 0.5, 0.05
"""Speeds of homing, in speeds of a profile."""


def commission(dictionary: ObjectDictionary, axis: Axis) -> None:
    """Fill what the drive type, or the owner's EDS, leaves at 0, as its stored parameters.

    In units of power-on: encoder increments, mode 2 in rpm, torque in thousandths of the rated one.
    """
    for (index, subindex), value in _values(axis).items():
        variable = optional(dictionary, index, subindex)
        if variable is not None and variable.data_type not in FLOATS and variable.value == 0:
            store(variable, max(1.0, value))


def _values(axis: Axis) -> dict[tuple[int, int], float]:
    speed = profile_speed(axis)
    unit = axis.encoder.increments_per_revolution / (2.0 * pi)
    up, stop = speed / RAMP_TIME, speed / STOP_TIME
    return {
        (0x6081, 0): speed * unit,
        (0x6083, 0): up * unit,
        (0x6084, 0): up * unit,
        (0x6085, 0): stop * unit,
        (0x60A4, 1): up / JERK_TIME * unit,
        (0x6099, 1): SEARCH * speed * unit,
        (0x6099, 2): ZERO * speed * unit,
        (0x609A, 0): up * unit,
        (0x6048, 1): up / RPM,
        (0x6048, 2): 1.0,
        (0x6049, 1): up / RPM,
        (0x6049, 2): 1.0,
        (0x604A, 1): stop / RPM,
        (0x604A, 2): 1.0,
        (0x6087, 0): 1000.0,
    }


def profile_speed(axis: Axis) -> float:
    """Motor speed [rad/s] of a profile that nobody has set."""
    switches = axis.limit_switches
    stroke = abs(switches.positive - switches.negative) * axis.gear_ratio
    return min(stroke / CROSSING, SHARE_OF_MOTOR_SPEED * (axis.motor.max_speed or inf))
