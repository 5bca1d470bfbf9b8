"""Cyclic synchronous velocity mode (9): 60FFh each cycle (CiA 402-2, clause 'Cyclic synchronous velocity mode')."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.emulator.drive.limits import cap_speed
from drivetwin.emulator.drive.mode import Axis, Mode
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, VELOCITY_OFFSET, Loop
from drivetwin.emulator.drive.speed_demand import SpeedDemand
from drivetwin.emulator.drive.state_machine import Statusword


class CyclicSynchronousVelocity(Mode):
    """Target velocity 60FFh, a straight line from one to the next, plus 60B1h and 60B2h."""

    code: ClassVar[int] = 9

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._speed = SpeedDemand(axis)

    def enter(self) -> None:
        self._speed.start()

    def plan(self, controlword: int) -> Loop:
        axis = self.axis
        demand = axis.servo.demand
        target = cap_speed(axis, axis.scaling.angular(float(axis.dictionary[0x60FF].value)))
        allowed = self._speed.position_allows(target, axis.ramp(0x6084))
        self._speed.line(allowed, axis.servo.interval if allowed == target else len(demand))  # no delay at a limit
        demand[:, VELOCITY_OFFSET] = axis.velocity_offset()
        demand[:, TORQUE_OFFSET] = axis.torque_offset()
        return Loop.VELOCITY

    def status_bits(self) -> int:
        """Bit 12: the drive follows the command value, which no limit has cut."""
        return 0 if self.axis.limit_active else Statusword.MODE_BIT_12
