"""What may be added to a set of effects, and what could stand in the place of one that is in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drivetwin.diagnosis.prepare.deflection import is_torque
from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.propose.placing import in_order, name_of
from drivetwin.diagnosis.weigh.state import State
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.foundation.errors import UserError

CLEARLY = 0.5
"""Nats by which another effect must be better to take a place."""
RIVAL = 0.1
"""Of what an effect gains and takes, that another must, to be asked for in its place."""


@dataclass(frozen=True)
class Proposal:
    """An effect that may be added to a set: what it costs and its tangents, whitened; `score`: what the set gains [nats].

    The score is the difference of log evidence less the logarithm of how many effects and starts were tried: a uniform prior.
    """

    effect: PlacedEffect
    score: float
    prior: float
    """Of the score, the logarithm of how rare it is, and how many effects and starts were tried."""
    taken: Mapping[str, float]
    """Share of the energy of a gap, or of a deflection, that it takes from what is left, on all rows that it acts on."""
    column: Column
    tangents: Sequence[Column]
    held: frozenset[int]
    tried: int
    """Starts that were compared."""
    settled: State | None = None
    """The set with it, moved together to where the evidence gains no more, where that was done."""
    rare: float = 0.0
    """Of the prior, what it costs that the effect is rare as it stands [nats]: `State.unlikely` of a set has it."""
    only_listed: bool = False
    """Whether it is listed beside what is named, and not named itself: nothing sets it apart, or it was given up."""

    @property
    def takes(self) -> float:
        """What it takes where that is most: of a gap, or of a deflection."""
        return max(self.taken.values())

    @property
    def share(self) -> float:
        """What it takes of a gap, on the axis where that is most."""
        return max(part for rows, part in self.taken.items() if is_torque(rows))


@dataclass(frozen=True)
class Family:
    """What could stand in one effect's place beside the others, and nothing: the sets that its probability is averaged over.

    `state`: the set with nothing there.
    """

    chosen: PlacedEffect | None
    state: State
    proposals: Sequence[Proposal]


@dataclass(frozen=True)
class Found:
    """The set with the best score, the families about it, and what could be added to it."""

    state: State
    families: Sequence[Family]
    further: Sequence[Proposal]

    def beyond(self, named: State) -> Family:
        """What else could be added to the whole set. Effects that were given up later are still in it, so that no other gets
        credit for their part. Effects of that set, and of the one that is `named`, are left out.
        """
        told = {name_of(one) for one in (*self.state.effects, *named.effects)}
        return Family(None, self.state, [one for one in self.further if name_of(one.effect) not in told])


def makes_sense(state: State, two: Sequence[Proposal]) -> bool:
    """Whether two effects make a mechanism together with those of a set."""
    try:
        state.rows.simulation.dynamics(in_order([*state.effects, *(one.effect for one in two)]))
    except UserError:
        return False
    return True


def rivals_of(best: Proposal, proposals: Sequence[Proposal]) -> frozenset[str]:
    """Effects on the same axis that could have taken its place."""
    return frozenset(
        one.effect.effect.name
        for one in proposals
        if one.effect.axis == best.effect.axis and one.score > RIVAL * best.score and one.takes > RIVAL * best.takes
    )


def same_kind(one: PlacedEffect, other: PlacedEffect) -> bool:
    """Whether two effects have one name and one axis."""
    return (one.effect.name, one.axis) == (other.effect.name, other.axis)


def largest(proposals: Sequence[Proposal], large: float) -> list[Proposal]:
    """Those that take a `large` part of what the largest on their axis takes: the small is told when the large is there."""
    most: dict[str, float] = {}
    for one in proposals:
        most[one.effect.axis] = max(one.takes, most.get(one.effect.axis, 0.0))
    return [one for one in proposals if one.takes >= large * most[one.effect.axis]]
