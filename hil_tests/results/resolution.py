"""The smallest meaningful difference of two figures: the drives' measuring resolution, or the last displayed digit."""

from __future__ import annotations

from math import floor, isfinite, log10, tau

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.results.wording import DIGITS


def resolution(bench: Bench, unit: str, axis: str | None, value: float) -> float:
    """The least difference [unit] that counts between figures of about `value`: the greater of step and last shown digit."""
    return max(_step(bench, unit, axis), _last_digit(value))


def _step(bench: Bench, unit: str, axis: str | None) -> float:
    """Of a quantity on the joint side; 0 where it has none.

    A position is resolved to an encoder increment, a speed to one in a cycle, a torque to the current sensor's step, and a
    time in lockstep to the cycle: whatever is finer no controller can know of.
    """
    if unit == "s":
        return bench.cycle if bench.clock == "sync" and not bench.bit_timing else 0.0
    drive = None if axis is None else bench.virtual.axes.get(axis)
    if drive is None:
        return 0.0
    increment = tau / (drive.encoder.increments_per_revolution * drive.gear_ratio)
    match unit:
        case "m" | "rad":
            return increment
        case "m/s" | "rad/s":
            return increment / bench.cycle
        case "N" | "N·m":
            return drive.current_sensor.resolution * drive.motor.rated_torque * drive.gear_ratio
    return 0.0


def _last_digit(value: float) -> float:
    """One in the last of the digits that reports show of a value."""
    if value == 0.0 or not isfinite(value):
        return 0.0
    return float(10.0 ** (floor(log10(abs(value))) - DIGITS + 1))
