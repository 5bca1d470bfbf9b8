"""What an exciting motion is: a name, what it is for, and pieces of path within limits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar

from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path
from drivetwin.emulator.effects import Exciting


class Excitation(ABC):
    """One motion of one axis; pieces are joined by whoever asks (path.joined)."""

    name: ClassVar[Exciting]
    """Effects say by it in which motions they show."""
    purpose: ClassVar[str]
    """One sentence: what an effect shows in it that another does not."""

    @abstractmethod
    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        """Positions (n,) [m or rad], one every `period` [s], each piece from rest to rest within `limits`."""
