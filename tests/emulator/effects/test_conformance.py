"""Every effect is what it says: in a plant, for a search, in a file, elsewhere and in another unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.emulator.conformance import findings
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects import (
    AxisEffect,
    DriveEffect,
    ModelEffect,
    Parameter,
    Start,
    TorqueEffect,
    UnnamedEffect,
    library,
)
from drivetwin.emulator.effects.base import DAMPING
from drivetwin.emulator.effects.spring import Spring

Array = NDArray[np.float64]


@pytest.mark.parametrize("name", library())
def test_an_effect_is_what_it_says(name: str) -> None:
    found = findings(library()[name])
    print(*found, sep="\n")
    assert [str(one) for one in found if not one.holds] == []


def test_every_effect_of_the_library_says_how_it_is_judged() -> None:
    judged = AxisEffect | DriveEffect | ModelEffect | UnnamedEffect
    unjudged = {name for name, kind in library().items() if not issubclass(kind, judged)}
    assert unjudged == {"belt_elasticity"}


def broken(kind: type[AxisEffect], monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is found wrong of an effect that stands in for the one of its name."""
    monkeypatch.setitem(library(), kind.name, kind)
    return [one.what for one in findings(kind) if not one.holds]


@dataclass(frozen=True)
class _PushesTheOtherWay(Spring):
    def predict(self, motion: Motion, axis: AxisDynamics) -> Array:
        return -super().predict(motion, axis)


@dataclass(frozen=True)
class _SaysNothingOfItsPlace(Spring):
    needs: ClassVar = frozenset()


@dataclass(frozen=True)
class _BeginsFarOff(Spring):
    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [Start((cls(1.0, 900.0),), lambda found: cls(abs(found[0]), 900.0))]


@dataclass(frozen=True)
class _MixesUnits(TorqueEffect):
    """A drag that is 1 N·m too stiff, whatever its parameter."""

    name: ClassVar[str] = "spring"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("drag", DAMPING),)

    drag: float

    def resistance(self, position: Array, velocity: Array, time: Array) -> Array:
        return (self.drag + 1.0) * velocity

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [Start((cls(0.0),), lambda found: cls(found[0] - 1.0))]


WRONG = {
    _PushesTheOtherWay: "what the prediction leaves of the plant",
    _SaysNothingOfItsPlace: "the same elsewhere",
    _BeginsFarOff: "what the search leaves of the plant",
    _MixesUnits: "in another unit of force",
}


@pytest.mark.parametrize("kind", WRONG, ids=lambda kind: kind.__name__)
def test_an_effect_that_is_not_what_it_says_is_found_out(kind: type[AxisEffect], monkeypatch: pytest.MonkeyPatch) -> None:
    assert {f"{bench}: {WRONG[kind]}" for bench in ("hinge", "slide")} <= set(broken(kind, monkeypatch))
