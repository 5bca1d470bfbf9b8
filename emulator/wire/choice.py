"""Selects the frames that a fault hits."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random
from typing import Protocol


class Choice(Protocol):
    """A rule that is asked once a frame, in their order."""

    def takes(self) -> bool:
        """Whether the next frame is touched."""


@dataclass
class EveryNth:
    """The n-th frame, the 2 n-th and so on; n from 1, which is all."""

    n: int
    _count: int = field(default=0, init=False)

    def takes(self) -> bool:
        self._count = (self._count + 1) % self.n
        return self._count == 0


@dataclass
class WithProbability:
    """Each frame with a probability, by a generator of its own: the same seed takes the same frames."""

    probability: float
    seed: int = 0
    _random: Random = field(init=False)

    def __post_init__(self) -> None:
        self._random = Random(self.seed)

    def takes(self) -> bool:
        return self._random.random() < self.probability
