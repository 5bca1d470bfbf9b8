"""Profile torque mode (4): torque ramps to 6071h with the slope 6087h (CiA 402-2, clause 'Profile torque mode')."""

from __future__ import annotations

from math import inf
from typing import ClassVar

from drivetwin.emulator.drive.mode import Axis, Mode
from drivetwin.emulator.drive.objects import number, optional
from drivetwin.emulator.drive.ramp import approach
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, Loop
from drivetwin.emulator.drive.state_machine import Statusword


class ProfileTorque(Mode):
    """6071h in thousandths of rated torque, 6087h in thousandths a second (0: at once).

    Bit 10: the slope has ended, and no limit cuts the torque.
    """

    code: ClassVar[int] = 4

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._torque = 0.0
        self._target = 0.0

    def enter(self) -> None:
        self._torque = float(self.axis.servo.state["torque_demand"])

    def halt(self) -> Loop:
        """The mode's slow-down ramp is the torque slope: the torque goes to 0 by 6087h, its offset included."""
        return self._go_to(-self.axis.torque_offset())

    def plan(self, controlword: int) -> Loop:
        self._target = int(self.axis.dictionary[0x6071].value) * self.axis.rated_torque() / 1000.0
        return self._go_to(self._target)

    def status_bits(self) -> int:
        cut = bool(self.axis.servo.state["limited"])
        return Statusword.TARGET_REACHED if self._torque == self._target and not cut else 0

    def _go_to(self, target: float) -> Loop:
        axis = self.axis
        slope = number(optional(axis.dictionary, 0x6087), 0.0) * axis.rated_torque() / 1000.0
        demand = axis.servo.demand
        demand[:] = 0.0
        self._torque = approach(self._torque, target, slope if slope > 0.0 else inf, demand[:, TORQUE_OFFSET])
        demand[:, TORQUE_OFFSET] += axis.torque_offset()
        return Loop.TORQUE
