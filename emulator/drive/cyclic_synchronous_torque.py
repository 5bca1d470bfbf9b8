"""Cyclic synchronous torque mode (10): 6071h and 60B2h each cycle (CiA 402-2, clause 'Cyclic synchronous torque mode')."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.emulator.drive.mode import Mode
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, Loop
from drivetwin.emulator.drive.state_machine import Statusword


class CyclicSynchronousTorque(Mode):
    """Target torque plus torque offset, in thousandths of rated torque, as they stand at SYNC."""

    code: ClassVar[int] = 10

    def enter(self) -> None:
        return

    def plan(self, controlword: int) -> Loop:
        axis = self.axis
        demand = axis.servo.demand
        demand[:] = 0.0
        target = int(axis.dictionary[0x6071].value) * axis.rated_torque() / 1000.0
        demand[:, TORQUE_OFFSET] = target + axis.torque_offset()
        return Loop.TORQUE

    def status_bits(self) -> int:
        """Bit 12: the drive follows the command value, which no limit of torque or speed has cut."""
        return 0 if self.axis.servo.state["limited"] else Statusword.MODE_BIT_12
