"""The jerk of profiles (CiA 402-2: 6086h, 60A3h, 60A4h), for modes 1 and 3."""

from __future__ import annotations

from math import inf

from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.objects import JERK_LIMITED_RAMP, number, optional


def profile_jerk(axis: Axis, acceleration: float) -> float:
    """[rad/s³]: 60A4h:01, or the acceleration [rad/s²] over the drive type's jerk time; infinite unless 6086h is 3."""
    if number(optional(axis.dictionary, 0x6086), 0.0) != JERK_LIMITED_RAMP:
        return inf
    jerk = optional(axis.dictionary, 0x60A4, 1)
    if jerk is not None:
        return axis.scaling.angular_acceleration(float(jerk.value)) or inf
    smoothing = axis.role("jerk_time")
    time = 0.0 if smoothing is None else float(smoothing.value) * axis.profile.roles["jerk_time"].si_per_unit
    return acceleration / time if time > 0.0 else inf
