"""What one case of the blind test is: the truth that its machine is built from, and that the diagnosis never sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

FOREIGN = "foreign:"
"""Prefix of the causes that the library of effects does not have."""

Kind = Literal["clean", "single", "double", "four", "foreign"]


@dataclass(frozen=True)
class Cause:
    """One effect on one axis, its parameters in the units of docs/effects.md; `foreign:NAME` is outside the library."""

    effect: str
    axis: str
    parameters: dict[str, float]


@dataclass(frozen=True)
class Case:
    """One drawn case; everything else about it follows from `seed`.

    `machine` is a family of `blind/machines.py`, `formulation` the way the withheld plant is written (`blind/plants/`).
    """

    number: int
    seed: int
    machine: str
    kind: Kind
    causes: tuple[Cause, ...]
    formulation: str

    @property
    def all_effects(self) -> tuple[Cause, ...]:
        """Everything that is there, small things beside the causes included."""
        return self.causes

    @property
    def there(self) -> frozenset[tuple[str, str]]:
        """Effect and axis of all of them."""
        return frozenset((one.effect, one.axis) for one in self.all_effects)
