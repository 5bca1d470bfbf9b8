"""Profile velocity mode (3): the drive ramps to 60FFh by itself (CiA 402-2, clause 'Profile velocity mode')."""

from __future__ import annotations

from typing import ClassVar

from emulator.drive.mode import Axis, Mode
from emulator.drive.ramp import ramp_cycle
from emulator.drive.servo import TORQUE_OFFSET, VELOCITY_OFFSET, Loop
from emulator.drive.state_machine import Statusword

REACHED = 0.01
"""Share of the target speed within which it counts as reached, where the drive has no 606Dh."""


class ProfileVelocity(Mode):
    """Ramps by 6083h and 6084h, limited to 607Fh; bit 10 is target reached, bit 12 is speed 0."""

    code: ClassVar[int] = 3

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._velocity = 0.0
        self._target = 0.0

    def enter(self) -> None:
        self._velocity = float(self.axis.servo.state["velocity"])

    def plan(self, controlword: int) -> Loop:
        axis, dictionary = self.axis, self.axis.dictionary
        limit = abs(axis.scaling.angular(float(dictionary[0x607F].value)))
        target = axis.scaling.angular(float(dictionary[0x60FF].value))
        self._target = max(-limit, min(limit, target)) if limit > 0.0 else target
        demand = axis.servo.demand
        position = float(axis.servo.state["position"])
        ramp_cycle(position, self._velocity, self._target, axis.ramp(0x6083), axis.ramp(0x6084), demand)
        demand[:, VELOCITY_OFFSET] = axis.velocity_offset()
        demand[:, TORQUE_OFFSET] = axis.torque_offset()
        self._velocity = float(demand[-1, 1])
        return Loop.VELOCITY

    def status_bits(self) -> int:
        actual = float(self.axis.servo.state["velocity"])
        window = max(REACHED * abs(self._target), 0.05)
        reached = Statusword.TARGET_REACHED if abs(actual - self._target) < window else 0
        standing = Statusword.MODE_BIT_12 if abs(actual) < 0.05 else 0
        return reached | standing
