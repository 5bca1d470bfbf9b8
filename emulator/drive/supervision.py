"""What a drive supervises: following error, current, I2t, speed, DC link, safe torque off, encoder, limit switches."""

from __future__ import annotations

from math import inf, nan

from drivetwin.emulator.drive import faults
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.faults import Fault
from drivetwin.emulator.drive.limits import motor_speed_limit
from drivetwin.emulator.drive.objects import number, optional
from drivetwin.emulator.drive.servo import Alarm, filter_share
from drivetwin.emulator.machine import Motor

OFF = 0xFFFFFFFF
"""A following error window of this value, or 0, is switched off (6065h; 22E7h of a ServoOne)."""
TRIP = 1.25
"""Current at which the power stage switches off, in peak currents."""
OVERSPEED = 1.2
"""Speed that is a fault, in speeds of 6080h."""
UNDERVOLTAGE, OVERVOLTAGE = 0.6, 1.25
"""DC link voltages that are faults, in nominal ones."""
COOL = 0.9
"""I2t below which an overload can be reset."""
CREEP = 0.5
"""Measured motor speed that counts as motion into a limit switch where the speed is not demanded [rad/s]."""

_ALARMS = {
    Alarm.OVERCURRENT: faults.OVERCURRENT,
    Alarm.OVERLOAD: faults.OVERLOAD,
    Alarm.OVERSPEED: faults.OVERSPEED,
    Alarm.FOLLOWING_ERROR: faults.FOLLOWING_ERROR,
}


class Supervision:
    """Sets the thresholds of the loops, and says which faults are there."""

    def __init__(self, axis: Axis, motor: Motor) -> None:
        self._axis = axis
        self._motor = motor
        self._limit = axis.role("following_error_limit")
        self._timeout = optional(axis.dictionary, 0x6066)
        self._alarms = 0
        self._scale = nan
        parameters = axis.servo.parameters
        self._position, self._found = axis.servo.state.cell("position"), axis.servo.state.cell("alarms")
        self._trip, self._alive = parameters.cell("trip_torque"), parameters.cell("encoder_alive")
        parameters["heating"] = 1.0 / motor.rated_torque**2
        parameters["thermal_share"] = filter_share(motor.thermal_time_constant)

    def refresh(self) -> None:
        """Write the thresholds that objects give into the loops' parameters."""
        parameters = self._axis.servo.parameters
        parameters["error_limit"] = self._following_error_limit()
        parameters["error_timeout"] = number(self._timeout, 0.0) / 1000.0 + 1e-9
        parameters["speed_limit"] = motor_speed_limit(self._axis)
        parameters["overspeed"] = min(OVERSPEED * motor_speed_limit(self._axis), self._motor.max_speed or inf)

    def sense(self) -> None:
        """Let the loops of the coming cycle have the hardware as it is."""
        hardware = self._axis.hardware
        self._alive[0] = 1.0 if hardware.encoder_alive else 0.0
        if hardware.current_scale != self._scale:
            self._scale = hardware.current_scale
            self._trip[0] = TRIP * self._motor.peak_torque / max(self._scale, 1e-9)

    def alarms(self) -> list[Fault]:
        """Faults that the loops found in the cycle that has passed."""
        self._alarms = alarms = self._found[0]
        if alarms == 0:
            return []
        self._found[0] = 0
        return [fault for alarm, fault in _ALARMS.items() if self._alarms & alarm]

    def hardware_faults(self) -> list[Fault]:
        """Faults of the hardware that are there now."""
        hardware = self._axis.hardware
        found = []
        if hardware.sto:
            found.append(faults.SAFE_TORQUE_OFF)
        if not hardware.encoder_alive:
            found.append(faults.ENCODER_LOSS)
        if hardware.dc_link_voltage < UNDERVOLTAGE * hardware.nominal_voltage:
            found.append(faults.UNDERVOLTAGE)
        elif hardware.dc_link_voltage > OVERVOLTAGE * hardware.nominal_voltage:
            found.append(faults.OVERVOLTAGE)
        return found

    def is_between_limits(self) -> bool:
        """Whether no limit switch is actuated."""
        switches = self._axis.hardware.switches
        return bool(switches.low < self._position[0] < switches.high)

    def limit_switch_fault(self, speed: float) -> Fault | None:
        """The limit switch into which the axis is moved at `speed` [rad/s] of the motor, not 0."""
        axis, angle = self._axis, self._position[0]
        forwards = speed * axis.scaling.position_per_radian > 0.0
        if not axis.limit_switch(1 if forwards else -1, angle):
            return None
        return faults.POSITIVE_LIMIT_SWITCH if forwards else faults.NEGATIVE_LIMIT_SWITCH

    def may_reset(self) -> bool:
        """Whether the cause of every fault is gone."""
        hot = float(self._axis.servo.state["heat"]) > COOL
        lasting = self._alarms & (Alarm.OVERCURRENT | Alarm.OVERSPEED)
        return not (hot or lasting or self.hardware_faults())

    def voltage_enabled(self) -> bool:
        """Bit 4 of the statusword: high voltage is there."""
        hardware = self._axis.hardware
        return hardware.dc_link_voltage >= UNDERVOLTAGE * hardware.nominal_voltage

    def _following_error_limit(self) -> float:
        """[rad]; beyond half a unit more than the raw value says, as errors are told in whole units."""
        raw = number(self._limit, 0.0)
        if not 0.0 < raw < OFF:
            return inf
        return abs(self._axis.scaling.angular_distance(raw + 0.5))
