"""Whether an axis stands, at any cycle: an axis that moves is waited for, one whose encoder flickers is not."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from drivetwin.controller.cycle import Cycle
from drivetwin.controller.stop import _still_moving


@dataclass
class Axis:
    """As much of a drive as is looked at: its position [units], a unit of it [rad]."""

    speed: float
    """rad/s, falling by `brakes` rad/s²."""
    brakes: float = 0.0
    unit: float = 1e-7
    flickers: bool = False
    """Between two increments, from one cycle to the next."""
    travelled: float = 0.0
    cycles: int = 0
    answers: bool = True
    axis: Any = field(default_factory=lambda: SimpleNamespace(max_speed=2.0))

    @property
    def position(self) -> int:
        return round(self.travelled / self.unit) + (self.cycles % 2 if self.flickers else 0)

    def go_on(self, seconds: float) -> None:
        self.travelled += self.speed * seconds
        self.speed = max(0.0, self.speed - self.brakes * seconds)
        self.cycles += 1


def cycle(axis: Axis, period: float) -> Cycle:
    return cast(Cycle, SimpleNamespace(period=period, run=lambda: axis.go_on(period)))


@pytest.mark.parametrize("period", [0.001, 0.002, 0.05])
def test_an_axis_that_goes_on_is_not_taken_to_stand(period: float) -> None:
    axis: Any = Axis(speed=0.5)
    assert _still_moving(cycle(axis, period), [axis]) == [axis]


@pytest.mark.parametrize("period", [0.001, 0.002, 0.05])
def test_one_that_brakes_is_waited_for(period: float) -> None:
    axis: Any = Axis(speed=0.5, brakes=1.0)
    assert _still_moving(cycle(axis, period), [axis]) == []
    assert axis.speed < 0.004


def test_one_whose_encoder_is_coarse_stands_while_it_flickers() -> None:
    axis: Any = Axis(speed=0.0, unit=1e-3, flickers=True)
    assert _still_moving(cycle(axis, 0.02), [axis]) == []
