"""A frame between a drive and the bus, and what a fault may do to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from drivetwin.emulator.wire.choice import Choice


class Direction(StrEnum):
    """As the drive sees it."""

    SENT = "sent"
    RECEIVED = "received"


@dataclass(frozen=True)
class Frame:
    """A data or remote frame with an 11-bit identifier."""

    cob_id: int
    data: bytes
    remote: bool = False


Carry = Callable[[Frame], None]
"""Takes a frame one step further on its way."""


class Disturbance(Protocol):
    """What happens to frames at one place of their way."""

    def meet(self, frame: Frame, carry: Carry) -> None:
        """A frame comes by: carry it on, as it is or changed, once, several times, later or not at all."""


@dataclass(frozen=True)
class Selective:
    """A disturbance of those frames that have a COB-ID (None: any) and that a choice takes."""

    cob_id: int | None
    choice: Choice
    disturbance: Disturbance

    def meet(self, frame: Frame, carry: Carry) -> None:
        if self.cob_id in (None, frame.cob_id) and self.choice.takes():
            self.disturbance.meet(frame, carry)
        else:
            carry(frame)
