"""Cyclic synchronous velocity mode (9): 60FFh each cycle (CiA 402-2, clause 'Cyclic synchronous velocity mode')."""

from __future__ import annotations

from typing import ClassVar

from emulator.drive.limits import PositionLimits, cap_speed
from emulator.drive.mode import Axis, Mode
from emulator.drive.ramp import approach
from emulator.drive.servo import TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop
from emulator.drive.state_machine import Statusword


class CyclicSynchronousVelocity(Mode):
    """Target velocity 60FFh, a straight line from cycle to cycle, plus 60B1h and 60B2h."""

    code: ClassVar[int] = 9

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._limits = PositionLimits(axis)
        self._velocity = 0.0

    def enter(self) -> None:
        self._velocity = float(self.axis.servo.state["velocity"])

    def plan(self, controlword: int) -> Loop:
        axis = self.axis
        demand = axis.servo.demand
        target = cap_speed(axis, axis.scaling.angular(float(axis.dictionary[0x60FF].value)))
        target = self._limits.cap_speed(target, float(axis.servo.state["position"]), axis.ramp(0x6084))
        rate = abs(target - self._velocity) / axis.cycle
        self._velocity = approach(self._velocity, target, rate, demand[:, VELOCITY])
        demand[:, VELOCITY_OFFSET] = axis.velocity_offset()
        demand[:, TORQUE_OFFSET] = axis.torque_offset()
        return Loop.VELOCITY

    def status_bits(self) -> int:
        """Bit 12: the drive follows the command value."""
        return Statusword.MODE_BIT_12
