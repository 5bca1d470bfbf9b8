"""A case of the wide generator: what is there, what it costs along the recorded motion, and what makes its world again."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.blind.case import Case, Cause


@dataclass(frozen=True)
class Item(Cause):
    """An effect that is there, what it costs over the axis's torque (rms in motion), and its share of the gap's energy."""

    size: float
    share: float


@dataclass(frozen=True)
class Level:
    """Of one axis in motion, rms [N·m or N]: torque, noise-free gap to the nominal model, noise of the recorded torque."""

    torque: float
    gap: float
    noise: float


@dataclass(frozen=True)
class WideCase(Case):
    """A case of this generator; `machine` is its family, `causes` and `nuisances` are items, `levels` go by axis.

    `attempt`, `slower` and `micro` (n,) make the same world again; `noise` (n,) is added to the channels of a clean case.
    """

    axes: tuple[str, ...]
    friction: tuple[str, ...]
    drive: str
    nuisances: tuple[Item, ...]
    levels: dict[str, Level]
    attempt: int
    slower: float
    micro: tuple[float, ...]
    noise: tuple[float, ...]

    @property
    def all_effects(self) -> tuple[Cause, ...]:
        """Causes and nuisances, a position that is recorded late as the library's `delay`."""
        return (*self.causes, *(_of_library(item) for item in self.nuisances))

    @property
    def items(self) -> tuple[Cause, ...]:
        """Everything that acts, but for the presliding that every axis has."""
        return (*self.causes, *self.beside)

    @property
    def beside(self) -> tuple[Item, ...]:
        """Nuisances but for the presliding that every axis has."""
        return tuple(item for item in self.nuisances if item.effect != "presliding")


def _of_library(item: Cause) -> Cause:
    late = item.effect == "out_of_step" and item.parameters["delay"] > 0.0
    return Cause("delay", item.axis, item.parameters) if late else item
