"""What a foreign effect is: something that acts on one axis and that no effect of the library is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

Draw = np.random.Generator
Values = dict[str, float]


@dataclass(frozen=True)
class Scale:
    """By what a foreign effect is drawn; N·m, rad, kg·m² or N, m, kg.

    `torque` is the rms that it is to have, `friction` the axis's Coulomb friction; travel, and what the motion has as rms.
    """

    torque: float
    axis_torque: float
    friction: float
    room: float
    acceleration: float


@dataclass(frozen=True)
class Axis:
    """What an effect sees at the beginning of a cycle: the joint's state, time since power-on, the cycle's length [s]."""

    position: float
    velocity: float
    time: float
    cycle: float


@dataclass(frozen=True)
class Influence:
    """What it does in that cycle: a torque on the joint [N·m or N], factors of its friction and of its motor's torque."""

    pull: float = 0.0
    friction: float = 1.0
    gain: float = 1.0


class Foreign(ABC):
    """A foreign effect at work. `name` is what a case calls it, after `foreign:`."""

    name: ClassVar[str]

    def __init__(self, values: Values, draw: Draw) -> None:
        """From its parameters; `draw` is for what is random while it acts."""
        self.values = values
        self.draw = draw

    @staticmethod
    @abstractmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        """Parameters of a size that matters."""

    @abstractmethod
    def act(self, axis: Axis) -> Influence:
        """What it does in the coming cycle; called once a cycle."""
