"""Which frames are lost."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random
from typing import Protocol


class Loss(Protocol):
    """A rule of losing frames, asked once a frame in their order."""

    def loses(self) -> bool:
        """Whether the next frame is lost."""


@dataclass
class EveryNth:
    """Lose the n-th frame, the 2 n-th and so on; n from 1, which loses all."""

    n: int
    _count: int = field(default=0, init=False)

    def loses(self) -> bool:
        self._count = (self._count + 1) % self.n
        return self._count == 0


@dataclass
class WithProbability:
    """Lose each frame with a probability, by a generator of its own: the same seed loses the same frames."""

    probability: float
    seed: int = 0
    _random: Random = field(init=False)

    def __post_init__(self) -> None:
        self._random = Random(self.seed)

    def loses(self) -> bool:
        return self._random.random() < self.probability
