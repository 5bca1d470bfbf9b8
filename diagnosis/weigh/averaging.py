"""From families of sets to probabilities: averaged over sets, each weighed by how well it predicts motion that was held out.

Pseudo-Bayesian model averaging with the Bayesian bootstrap: Yao, Vehtari, Simpson, Gelman, Bayesian Analysis 13(3), 2018, sec.
3.4. Blocks of contiguous time are drawn instead of samples, for neighbours tell the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.moves import CLEARLY, Family, Proposal
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

DRAWS = 400
AS_GOOD = 0.05
"""Share of the draws in which another effect predicts no worse, from which the two are not distinguished."""
SUBSTITUTES = 0.5
"""Of the share that the chosen effect takes, that another must take to stand in its place: what takes less is one beside it."""
PROBABLE = 0.5
CONSIDERED = 8
"""Members of a family, the best by evidence, that are predicted with."""


@dataclass(frozen=True)
class Weighed:
    """One effect: its weight among what could stand in its place, and whether it is distinguished from the chosen one."""

    proposal: Proposal
    weight: float
    as_good: bool


@dataclass(frozen=True)
class Answer:
    """Of one family: the chosen effect with the probability that it or one as good is there, and its members by weight."""

    chosen: PlacedEffect | None
    probability: float
    members: tuple[Weighed, ...]

    @property
    def indistinguishable(self) -> tuple[str, ...]:
        """Other effects that predict as well, most probable first."""
        assert self.chosen is not None
        names = [one.proposal.effect.effect.name for one in self.members if one.as_good]
        return tuple(dict.fromkeys(name for name in names if name != self.chosen.effect.name))


def weighed(family: Family, settings: Settings) -> Answer:
    """Probabilities of a family's members, and of none of them."""
    chosen = family.chosen
    own = next((one for one in family.proposals if chosen is not None and _same(one, chosen)), None)
    least = SUBSTITUTES * own.share if own is not None else -np.inf
    considered = sorted((one for one in family.proposals if one.share >= least), key=lambda one: -one.score)[:CONSIDERED]
    if chosen is not None and not any(_same(one, chosen) for one in considered):
        considered.extend(one for one in family.proposals if _same(one, chosen))
    densities = [_held_out(family, (), None, _without(family), settings)]
    densities += [_held_out(family, one.tangents, one.column, one.held, settings) for one in considered]
    told = np.array(densities)
    told -= told[0]
    prior = -np.array(
        [
            _strain(family, (), None, _without(family)),
            *(_strain(family, one.tangents, one.column, one.held) for one in considered),
        ]
    )
    prior += np.array([0.0, *(one.prior for one in considered)])
    count = told.shape[1]
    draws = np.random.default_rng(settings.seed).dirichlet(np.ones(count), DRAWS) * count
    scores = draws @ told.T + prior
    scores -= scores.max(axis=1, keepdims=True)
    weights = np.exp(scores)
    weights /= weights.sum(axis=1, keepdims=True)
    mean = weights.mean(axis=0)
    place = next((k for k, one in enumerate(considered, start=1) if chosen is not None and _same(one, chosen)), None)
    members = []
    for k, one in enumerate(considered, start=1):
        better = float(np.mean(scores[:, k] > scores[:, place] - CLEARLY)) if place is not None else 0.0
        members.append(Weighed(one, min(1.0, float(mean[k])), place is not None and (k == place or better >= AS_GOOD)))
    probability = sum(one.weight for one in members if one.as_good)
    return Answer(chosen, min(1.0, float(probability)), tuple(sorted(members, key=lambda one: -one.weight)))


def believed(state: State, answers: Sequence[Answer]) -> State:
    """The set without the effects that are less probable than not: the median probability model, which predicts best.

    Barbieri and Berger, Annals of Statistics 32(3), 2004. As it was where the others make no mechanism without them.
    """
    doubted = [one.chosen for one in answers if one.chosen is not None and one.probability < PROBABLE]
    kept = [one for one in state.effects if not any(alike(one, each) for each in doubted)]
    if len(kept) == len(state.effects):
        return state
    try:
        return state_of(state.bench, kept, state.system.axes)
    except UserError:
        return state


def _strain(family: Family, tangents: Sequence[Column], column: Column | None, held: frozenset[int]) -> float:
    """What a member asks of nominal parameters [nats], which what is held out does not tell."""
    system = family.state.system
    return system.strain(system.fit(tangents, column, held))


def _without(family: Family) -> frozenset[int]:
    """Nominal parameters that are not free where nothing is off: those that the chosen effect is."""
    if family.chosen is None or not family.chosen.effect.of_model:
        return family.state.held()
    return family.state.held(family.chosen.effect.name, family.chosen.axis)


def _held_out(
    family: Family, tangents: Sequence[Column], column: Column | None, held: frozenset[int], settings: Settings
) -> Array:
    """Log density [nats] of all blocks of all axes, (B,)."""
    system = family.state.system
    folds = {axis: np.arange(int(own.blocks.max(initial=-1)) + 1) % settings.folds for axis, own in system.axes.items()}
    found = system.held_out(folds, settings.folds, tangents, column, held)
    return np.concatenate([found[axis] for axis in sorted(found)])


def _same(one: Proposal, chosen: PlacedEffect) -> bool:
    return (one.effect.effect.name, one.effect.axis) == (chosen.effect.name, chosen.axis) and one.effect.effect == chosen.effect
