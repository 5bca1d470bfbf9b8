"""What a machine needs and no effect of the library names, as tables: over the position, and over the velocity each way."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.effects.base import POSITION, TORQUE, VELOCITY, Need, Parameter, UnnamedEffect
from drivetwin.emulator.effects.ground import Ground

Array = NDArray[np.float64]

PLACES, SPEEDS = 13, 6
"""Knots of a table: over the position, and over the speed in each direction."""
SLOW = 0.02
"""Share of the top speed below which a direction is not yet one: there a table goes through 0, for stiction is the model's."""

_POSITION = tuple(f"position_{k:02d}" for k in range(PLACES))
_REVERSING = tuple(f"reversing_{k:02d}" for k in range(PLACES))
_FORWARD = tuple(f"forward_{k}" for k in range(1, SPEEDS + 1))
_BACKWARD = tuple(f"backward_{k}" for k in range(1, SPEEDS + 1))


@dataclass(frozen=True)
class ResidualTable(UnnamedEffect):
    """Torque that the motor must give: position(q) + way(v) reversing(q), and forward(|v|) for v > 0, -backward(|v|) for v < 0.

    Each is a table joined by straight lines: `position` and `reversing` on even knots from `low` to `high`, constant beyond;
    the others on knots that are even in log(1 + |v| / (0.02 top)) up to `top`, 0 at rest. way(v) = v / (0.02 top), at most 1.
    """

    name: ClassVar[str] = "residual_table"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ABSOLUTE_POSITION})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("low", POSITION),
        Parameter("high", POSITION),
        Parameter("top", VELOCITY, low=1e-9),
        *(Parameter(name, TORQUE) for name in (*_POSITION, *_REVERSING, *_FORWARD, *_BACKWARD)),
    )

    low: float
    high: float
    top: float
    position_00: float = 0.0
    position_01: float = 0.0
    position_02: float = 0.0
    position_03: float = 0.0
    position_04: float = 0.0
    position_05: float = 0.0
    position_06: float = 0.0
    position_07: float = 0.0
    position_08: float = 0.0
    position_09: float = 0.0
    position_10: float = 0.0
    position_11: float = 0.0
    position_12: float = 0.0
    reversing_00: float = 0.0
    reversing_01: float = 0.0
    reversing_02: float = 0.0
    reversing_03: float = 0.0
    reversing_04: float = 0.0
    reversing_05: float = 0.0
    reversing_06: float = 0.0
    reversing_07: float = 0.0
    reversing_08: float = 0.0
    reversing_09: float = 0.0
    reversing_10: float = 0.0
    reversing_11: float = 0.0
    reversing_12: float = 0.0
    forward_1: float = 0.0
    forward_2: float = 0.0
    forward_3: float = 0.0
    forward_4: float = 0.0
    forward_5: float = 0.0
    forward_6: float = 0.0
    backward_1: float = 0.0
    backward_2: float = 0.0
    backward_3: float = 0.0
    backward_4: float = 0.0
    backward_5: float = 0.0
    backward_6: float = 0.0

    def resistance(self, position: Array, velocity: Array, time: Array) -> Array:
        places, speeds = place_of(position, self.low, self.high), speed_of(velocity, self.top)
        at, over = self._knots
        torque = np.interp(places, at, self._position) + way_of(velocity, self.top) * np.interp(places, at, self._reversing)
        each = np.where(velocity > 0.0, np.interp(speeds, over, self._forward), -np.interp(speeds, over, self._backward))
        return np.asarray(torque + each)

    @classmethod
    def of_knots(
        cls, span: tuple[float, float], top: float, position: Array, reversing: Array, forward: Array, backward: Array
    ) -> ResidualTable:
        """From the torques at the knots: (13,) over the position, (6,) over the speed."""
        names = (*_POSITION, *_REVERSING, *_FORWARD, *_BACKWARD)
        values = np.concatenate([position, reversing, forward, backward])
        return cls(*span, top, **{name: float(value) for name, value in zip(names, values, strict=True)})

    @classmethod
    def example(cls, ground: Ground) -> ResidualTable:
        """A hump of friction, a pull over the travel and a drag that bends: none of them an effect of the library."""
        at = np.linspace(0.0, 1.0, PLACES)
        hump, pull = np.exp(-(((at - 0.6) / 0.2) ** 2)), at**3
        speeds = np.linspace(0.0, 1.0, SPEEDS + 1)[1:]
        size = 0.1 * ground.torque_rms
        travel = (float(ground.travel[0]), float(ground.travel[1]))
        return cls.of_knots(travel, ground.max_speed, size * pull, size * hump, size * speeds**2, 0.5 * size * speeds)

    @cached_property
    def _knots(self) -> tuple[Array, Array]:
        return np.linspace(0.0, 1.0, PLACES), np.linspace(0.0, 1.0, SPEEDS + 1)

    @cached_property
    def _position(self) -> Array:
        return self._table(_POSITION)

    @cached_property
    def _reversing(self) -> Array:
        return self._table(_REVERSING)

    @cached_property
    def _forward(self) -> Array:
        return np.concatenate([[0.0], self._table(_FORWARD)])

    @cached_property
    def _backward(self) -> Array:
        return np.concatenate([[0.0], self._table(_BACKWARD)])

    def _table(self, names: tuple[str, ...]) -> Array:
        return np.array([getattr(self, name) for name in names])


def place_of(position: Array, low: float, high: float) -> Array:
    """Positions (n,) as a coordinate from 0 to 1."""
    return np.asarray(np.clip((position - low) / max(high - low, 1e-12), 0.0, 1.0))


def speed_of(velocity: Array, top: float) -> Array:
    """Speeds of velocities (n,) as a coordinate from 0 to 1: friction bends on a logarithmic scale."""
    return np.asarray(np.clip(np.log1p(np.abs(velocity) / (SLOW * top)) / np.log1p(1.0 / SLOW), 0.0, 1.0))


def way_of(velocity: Array, top: float) -> Array:
    """Direction of velocities (n,), -1 to 1, without a step at rest."""
    return np.asarray(np.clip(velocity / (SLOW * top), -1.0, 1.0))
