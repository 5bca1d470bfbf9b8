"""Connects dictionary objects to quantities of the drive: hooks that read the loops and act on writes."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

from drivetwin.drive_profiles import DriveProfile
from drivetwin.drive_profiles.profile import FLOATS
from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value, saturate
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.drive.interpolation import Interpolation
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.machine import Axis as MachineAxis

LINEAR_RAMP, JERK_LIMITED_RAMP = 0, 3
"""Values of 6086h that this drive has; it has no sin² ramp (1) and no jerk-free ramp (2)."""


def role(dictionary: ObjectDictionary, profile: DriveProfile, name: str) -> Variable | None:
    """The variable that plays a role on this drive type, None where the type has none."""
    place = profile.roles.get(name)
    return None if place is None else dictionary[place.index, place.subindex]


def optional(dictionary: ObjectDictionary, index: int, subindex: int = 0) -> Variable | None:
    """The variable at an address, None where this drive type has none."""
    if (index, subindex) not in dictionary:
        return None
    return dictionary[index, subindex]


def number(variable: Variable | None, otherwise: float) -> float:
    """The stored value of a variable that may not exist."""
    return otherwise if variable is None else float(variable.value)


def commissioned(axis: MachineAxis) -> dict[str, float]:
    """Motor data and tuned gains of an axis by role, SI on the motor side."""
    loops, gear = axis.loops, axis.gear_ratio
    return {
        "rated_torque": axis.motor.rated_torque,
        "motor_inertia": axis.motor.inertia,
        "position_gain": loops.position_gain,
        "velocity_gain": loops.velocity_gain / gear**2,
        "integral_time": loops.integral_time or 0.0,
        "velocity_feedforward": loops.velocity_feedforward,
        "velocity_filter_time": 1.0 / (2.0 * pi * loops.velocity_filter_hz),
        "torque_limit": axis.motor.peak_torque,
        "servo_period": SERVO_PERIOD,
        "current_loop_time_constant": axis.current_loop_time_constant,
    }


def commission(dictionary: ObjectDictionary, profile: DriveProfile, axis: MachineAxis) -> None:
    """Put motor data and tuned gains where this drive type keeps them, as its stored parameters."""
    for name, value in commissioned(axis).items():
        variable = role(dictionary, profile, name)
        if variable is not None:
            store(variable, value / profile.roles[name].si_per_unit)
    store(dictionary[0x6076], axis.motor.rated_torque * 1000.0)
    store(dictionary[0x6072], 1000.0 * axis.motor.peak_torque / axis.motor.rated_torque)
    current = optional(dictionary, 0x6075)
    if current is not None:
        store(current, axis.motor.rated_current * 1000.0)
    increments = axis.encoder.increments_per_revolution
    for index in (0x608F, 0x6092):  # until a master scales it, a position unit is an encoder increment
        store(dictionary[index, 1], increments)
    resolution = optional(dictionary, 0x6090, 1)
    if resolution is not None:
        store(resolution, increments)
    _allow(resolution, increments)  # the speed is measured by the position encoder, there is no other
    for index in (0x608A, 0x608C, 0x608E):  # a unit has the dimension of the feed constant, which nothing here is told
        _allow(optional(dictionary, index), 0)
    _allow(optional(dictionary, 0x6086), LINEAR_RAMP, JERK_LIMITED_RAMP)
    _allow(optional(dictionary, 0x60A3), 1)


def _allow(variable: Variable | None, *values: int) -> None:
    """Refuse what the drive cannot do: a master may write `values` and no others."""
    if variable is None:
        return

    def check(written: Value) -> None:
        if written not in values:
            raise SdoAbort(AbortCode.INVALID_VALUE)

    variable.on_write = check


def store(variable: Variable, value: float) -> None:
    """Make `value` the variable's stored value: what it holds now and after a reset."""
    variable.commission(value if variable.data_type in FLOATS else round(value))


def on_read(dictionary: ObjectDictionary, index: int, read: Callable[[], int | float]) -> None:
    """Let `read` answer for an object, where this drive type has it."""
    if index in dictionary:
        dictionary[index].on_read = read


def on_change(variable: Variable | None, act: Callable[[float], None]) -> None:
    """Call `act` with each value that is about to be stored, where the variable exists."""
    if variable is not None:
        variable.on_write = lambda value: act(float(value))


def before_change(variable: Variable | None, act: Callable[[], None]) -> None:
    """Call `act` before each value is stored, after what the variable does already; where the variable exists."""
    if variable is None:
        return
    earlier = variable.on_write

    def both(value: Value) -> None:
        if earlier is not None:
            earlier(value)
        act()

    variable.on_write = both


def link_rated_torque(dictionary: ObjectDictionary, profile: DriveProfile) -> None:
    """6076h [mN·m] and the drive type's own rated torque are one quantity: a write to either is seen in both."""
    own, standard = role(dictionary, profile, "rated_torque"), dictionary[0x6076]
    if own is None or own is standard:
        return
    per_unit = 1000.0 * profile.roles["rated_torque"].si_per_unit
    on_change(own, lambda raw: standard.store(saturate(standard.data_type, round(raw * per_unit))))
    on_change(standard, lambda raw: own.store(raw / per_unit))


def per_mille(value: float, rated: float) -> int:
    """`value` in thousandths of `rated`, within 16 bits; 0 where nothing is rated."""
    if rated <= 0.0:
        return 0
    return max(-32768, min(32767, round(1000.0 * value / rated)))


def interpolation_of(profile: DriveProfile, raw: int) -> Interpolation:
    """Interpolation kind that this drive type means by `raw`; whatever is not the cubic spline is linear."""
    return Interpolation.CUBIC_SPLINE if raw == profile.interpolation_codes.get("cubic_spline") else Interpolation.LINEAR
