"""The base of a mode of operation: it plans a cycle's demand, evaluates the result, and owns its statusword bits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.servo import Loop

__all__ = ["Axis", "Mode", "Ramps"]


@dataclass(frozen=True)
class Ramps:
    """Decelerations of the slow-down ramp and of the quick-stop ramp [rad/s²]."""

    slow_down: float
    quick_stop: float

    @classmethod
    def of(cls, axis: Axis) -> Ramps:
        """6084h and 6085h."""
        return cls(axis.ramp(0x6084), axis.ramp(0x6085))


class Mode(ABC):
    """One mode of operation. `plan` and `after` run once a communication cycle while operation is enabled."""

    code: ClassVar[int]

    def __init__(self, axis: Axis) -> None:
        self.axis = axis

    @abstractmethod
    def enter(self) -> None:
        """Operation is enabled in this mode: start from where the axis is, without a jump."""

    def resume(self) -> None:
        """Halt has ended: go on; where the mode has nothing to keep, as if it were entered."""
        self.enter()

    def notice(self, controlword: int) -> None:
        """A controlword has been written while operation is enabled, perhaps several in a cycle."""
        return

    def ramps(self) -> Ramps:
        """How a stop out of this mode decelerates: the slow-down ramp is that of the mode (CiA 402-2, 605Ah..605Eh)."""
        return Ramps.of(self.axis)

    def halt(self) -> Loop | None:
        """Plan a cycle of halting by the mode's own slow-down ramp; None where that is a ramp of the speed."""
        return None

    @abstractmethod
    def plan(self, controlword: int) -> Loop:
        """Fill `axis.servo.demand`, or write the set-point to follow, for the coming cycle; the loops that it needs closed."""

    def after(self) -> None:
        """The cycle has been run: look at what came of it."""
        return

    @abstractmethod
    def status_bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword in this mode."""

    def following_error_bits(self) -> int:
        """Bits that tell a following error, from the fault until its reset; bit 13 where the mode has it."""
        return 0
