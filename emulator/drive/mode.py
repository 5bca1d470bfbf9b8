"""What a mode of operation is: it plans the demand of a cycle, looks at what came of it, and owns statusword bits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar, Protocol

from emulator.canopen.object_dictionary import ObjectDictionary
from emulator.drive.interpolation import Interpolation
from emulator.drive.scaling import Scaling
from emulator.drive.servo import Loop, Servo


class LimitSwitches(Protocol):
    """The two limit switches of an axis, actuated by the motor's true angle [rad]."""

    def negative(self, angle: float) -> bool:
        """Whether the negative switch is actuated at `angle`."""
        ...

    def positive(self, angle: float) -> bool:
        """Whether the positive switch is actuated at `angle`."""
        ...


@dataclass
class Axis:
    """What a mode works with: the drive's dictionary, its loops, its factor group, its switches."""

    dictionary: ObjectDictionary
    servo: Servo
    switches: LimitSwitches
    scaling: Scaling
    interpolation: Interpolation

    def move_origin(self, angle: float) -> None:
        """Make motor angle `angle` [rad] the zero of positions."""
        self.scaling = replace(self.scaling, origin=angle)

    def ramp(self, index: int) -> float:
        """Motor acceleration [rad/s²] that an object gives; one that is 0 is no limit: the speed changes within a period."""
        value = abs(self.scaling.angular(float(self.dictionary[index].value)))
        return value if value > 0.0 else inf

    def torque_offset(self) -> float:
        """60B2h [N·m]."""
        return int(self.dictionary[0x60B2].value) * self.rated_torque() / 1000.0

    def velocity_offset(self) -> float:
        """60B1h [rad/s]."""
        return self.scaling.angular(float(self.dictionary[0x60B1].value))

    def rated_torque(self) -> float:
        """6076h [N·m]."""
        return int(self.dictionary[0x6076].value) / 1000.0


class Mode(ABC):
    """One mode of operation. `plan` and `after` run once a communication cycle while operation is enabled."""

    code: ClassVar[int]

    def __init__(self, axis: Axis) -> None:
        self.axis = axis

    @abstractmethod
    def enter(self) -> None:
        """Operation is enabled in this mode: start from where the axis is, without a jump."""

    @abstractmethod
    def plan(self, controlword: int) -> Loop:
        """Fill `axis.servo.demand` for the coming cycle; the loops that it needs closed."""

    def after(self) -> None:
        """The cycle has been run: look at what came of it."""
        return

    @abstractmethod
    def status_bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword in this mode."""
