"""What faults of single frames have in common: sender, direction, COB-ID, and how many frames they hit."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Number, Parameter, Whole, Word
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.choice import Choice, EveryNth, WithProbability
from drivetwin.emulator.wire.frames import Direction, Disturbance, Selective
from drivetwin.foundation.errors import UserError

FRAME_PARAMETERS: tuple[Parameter, ...] = (
    NODE,
    Word("direction", "frames that the drive sends, or those that it would receive", tuple(Direction)),
    Whole("cob_id", "only frames with this COB-ID", 0x000, 0x7FF, hexadecimal=True),
    Whole("every", "every n-th such frame; 1: all", 1, 1_000_000),
    Number("probability", "each such frame with this probability, in place of `every`", "", 0.0, 1.0),
    Whole("seed", "of the probability", 0, 2**32 - 1),
)


@dataclass(frozen=True)
class FrameFault(LastingFault):
    """A fault of the frames between a drive and the bus; of all of them, unless told which."""

    parameters: ClassVar[tuple[Parameter, ...]] = FRAME_PARAMETERS

    direction: str = Direction.SENT
    cob_id: int | None = None
    every: int | None = None
    probability: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.every is not None and self.probability is not None:
            raise UserError(f"{self.name}: give every or probability, not both")

    @abstractmethod
    def disturbance(self, virtual: VirtualMachine, axis: int) -> Disturbance:
        """What happens to a frame that is chosen."""

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        chosen = Selective(self.cob_id, self._choice(axis), self.disturbance(virtual, axis))
        virtual.wires[axis].disturb(Direction(self.direction), self, chosen)

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.wires[axis].mend(self)

    def _choice(self, axis: int) -> Choice:
        if self.probability is not None:
            return WithProbability(self.probability, self.seed + axis)
        return EveryNth(self.every or 1)
