"""What a mode of operation is: it plans the demand of a cycle, looks at what came of it, and owns statusword bits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from emulator.drive.axis import Axis
from emulator.drive.servo import Loop

__all__ = ["Axis", "Mode"]


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

    @abstractmethod
    def plan(self, controlword: int) -> Loop:
        """Fill `axis.servo.demand` for the coming cycle; the loops that it needs closed."""

    def after(self) -> None:
        """The cycle has been run: look at what came of it."""
        return

    @abstractmethod
    def status_bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword in this mode."""
