"""From families of sets to probabilities: averaged over sets, each weighed by how well it predicts motion that was held out.

Pseudo-Bayesian model averaging with the Bayesian bootstrap: Yao, Vehtari, Simpson, Gelman, Bayesian Analysis 13(3), 2018, sec.
3.4. Blocks of contiguous time are drawn instead of samples, for neighbours tell the same. So it is decided which effects
predict best. How probable they are is another question: a model of the wrong form errs alike in all blocks. What the blocks of
an axis scatter by is enlarged by the design effect of a cluster (Kish, Survey Sampling, 1965, sec. 5.4), 1 + (blocks - 1) rho,
whose intraclass correlation rho is the share of what is left that is neither noise nor what a model misses.

A density with an unknown that is large predicts anything, and then decides nothing. So an effect also counts as one that
predicts where it leaves less energy of motion that was held out, without an unknown: what a patch is judged by. It is then at
least as probable as that.

A part of an unknown torque looks like one of many effects, and does so in all blocks. So does a part of what the comparison
errs by. A member that takes little beside much of either has less weight, and a chosen one that is rather an imitation
predicts nothing (`_no_imitation`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.system import System
from drivetwin.diagnosis.prepare.deflection import axis_of
from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Family, Proposal
from drivetwin.diagnosis.weigh.state import NEARBY, State
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

Set = tuple[State, Sequence[Column], Column | None, frozenset[int]]
"""A set of effects with further columns, and nominal parameters that are not free."""

DRAWS = 400
PROBABLE = 0.5
CERTAIN = 0.95
"""Share of the draws in which less energy is left, from which an effect predicts: the usual level of a test."""
ROUNDING = 1e-6
"""Share of energy, or difference of weights, below which two are the same."""
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
    """Of one family: the chosen effect with the probability that it or one as good is there, and its members by weight.

    `predicts`: whether it or one as good predicts motion that was held out better than nothing in its place, by density or by
    the energy that is left.
    """

    chosen: PlacedEffect | None
    probability: float
    predicts: bool
    members: tuple[Weighed, ...]
    body: int | None = None
    """The body, by number, whose mass may be one of the members instead."""

    @property
    def believed(self) -> bool:
        """Whether it goes into a patch: it predicts, and is rather there than not."""
        return self.predicts and self.probability >= PROBABLE

    @property
    def indistinguishable(self) -> tuple[str, ...]:
        """Other effects that predict as well, most probable first."""
        assert self.chosen is not None
        names = [one.proposal.effect.effect.name for one in self.members if one.as_good]
        return tuple(dict.fromkeys(name for name in names if name != self.chosen.effect.name))


@dataclass(frozen=True)
class Unexplained:
    """Of the energy that a patch leaves on each axis, the share that is not noise, and the share that is `systematic`: neither
    noise nor what a model misses.
    """

    no_noise: Mapping[str, float]
    systematic: Mapping[str, float]


def weighed(family: Family, unexplained: Unexplained, settings: Settings) -> Answer:
    """Probabilities of a family's members, and of none of them."""
    systematic = unexplained.systematic
    chosen = family.chosen
    own = next((one for one in family.proposals if chosen is not None and _same(one, chosen)), None)
    least = settings.substitutes * own.takes if own is not None else -np.inf
    able = sorted((one for one in family.proposals if one.takes >= least), key=lambda one: -one.score)
    considered = [one for one in able if not one.only_listed][:CONSIDERED]
    considered += [one for one in able if one.only_listed]
    if chosen is not None and not any(_same(one, chosen) for one in considered):
        considered.extend(one for one in family.proposals if _same(one, chosen))
    sets = [(family.state, (), None, _without(family)), *(_set_with(family, one) for one in considered)]
    told = np.array([_held_out(*each, settings) for each in sets])
    told -= told[0]
    prior = -np.array([_strain(*each) for each in sets])
    prior += np.array([0.0, *(one.prior for one in considered)])
    draws = np.random.default_rng(settings.seed).dirichlet(np.ones(told.shape[1]), DRAWS) * told.shape[1]
    scores = draws @ told.T + prior
    doubted = (1.0 + (draws - 1.0) * _enlarged(family, systematic)) @ told.T + prior
    real = np.array([1.0, *(_no_imitation(one, family, unexplained.no_noise, settings) for one in considered)])
    named = np.array([True, *(not one.only_listed for one in considered)])
    mean, plain = real * _weights(doubted), np.where(named, _weights(np.where(named, scores, -np.inf)), 0.0)
    place = next((k for k, one in enumerate(considered, start=1) if chosen is not None and _same(one, chosen)), None)
    members = []
    for k, one in enumerate(considered, start=1):
        better = float(np.mean(doubted[:, k] > doubted[:, place] - CLEARLY)) if place is not None else 0.0
        as_good = place is not None and (k == place or better >= settings.as_good or _is_as_close(one, own, settings))
        members.append(Weighed(one, min(1.0, float(mean[k])), as_good))
    alike_ones = [k for k, one in enumerate(members, start=1) if one.as_good]
    probability, best = (min(1.0, float(each[alike_ones].sum())) for each in (mean, plain))
    certain, believed = _leaves_less(family, own, systematic, settings)
    there = float(real[place]) if place is not None else 1.0
    return Answer(
        chosen,
        max(probability, there * believed) if certain else probability,
        (certain or best >= PROBABLE) and there >= PROBABLE,
        tuple(sorted(members, key=lambda one: -one.weight)),
    )


def _no_imitation(one: Proposal, family: Family, no_noise: Mapping[str, float], settings: Settings) -> float:
    """Probability that a member does not imitate a part of what is left, by the rows on which it takes most of a gap.

    Some effect always takes a part of a torque that has no name, unknown or what a model misses, usually `imitated` of
    it: one that takes as much is as likely there as not, and the odds grow with the square of what it takes. What nominal
    parameters explain has a name. `no_noise`: of what is left on each axis, the share that is not noise.
    """
    rows, without = family.state.rows, family.state.left
    acted = [name for name in one.column if rows.gap_energy[name] > 0.0]
    taken = one.taken if one.settled is None else {name: without[name] - one.settled.left[name] for name in acted}
    most = max(acted, key=lambda name: taken[name], default=None)
    if most is None:
        return 1.0
    takes = max(taken[most], 0.0)
    beside = one.settled or family.state
    left = beside.energy_still(beside.held())[most] - (0.0 if one.settled is not None else takes)
    imitation = settings.imitated * max(left, 0.0) * no_noise[axis_of(most)]
    return takes**2 / (takes**2 + imitation**2) if imitation > 0.0 else 1.0


def _is_as_close(one: Proposal, own: Proposal | None, settings: Settings) -> bool:
    """Whether a member, settled, leaves hardly more of any gap than the chosen one, and is not rare beside it.

    What sets them apart is then less than a real machine differs from either, however many nats that is: an asymmetry of
    friction is an offset except where the motion turns round.
    """
    if own is None or own.settled is None or one.settled is None or one.prior < own.prior + np.log(settings.as_good):
        return False
    most = min(settings.least_share, settings.as_close * own.takes)
    return all(left <= own.settled.left[axis] + most for axis, left in one.settled.left.items())


def _leaves_less(
    family: Family, own: Proposal | None, systematic: Mapping[str, float], settings: Settings
) -> tuple[bool, float]:
    """Whether the chosen set certainly leaves less energy of motion that was held out than nothing in the effect's place; and
    how probable it is that it does, with the scatter enlarged."""
    if own is None or own.settled is None:
        return False, 0.0
    held = _without(family)
    gain = _energy_held_out(own.settled, held | own.settled.held(), settings) - _energy_held_out(family.state, held, settings)
    draws = np.random.default_rng(settings.seed).dirichlet(np.ones(len(gain)), DRAWS) * len(gain)
    doubted = 1.0 + (draws - 1.0) * _enlarged(family, systematic)
    return float(np.mean(draws @ gain > 0.0)) >= CERTAIN, float(np.mean(doubted @ gain > 0.0))


def _energy_held_out(state: State, held: frozenset[int], settings: Settings) -> Array:
    """Log density [nats] of all blocks of all axes, (B,), of white noise about the set.

    `held`: nominal parameters as modelled; the others have their priors.
    """
    return _of_blocks(state.plain, (), None, held, settings)


def _weights(scores: Array) -> Array:
    """Weight of nothing and of each member (M,), averaged over draws of their scores (D, M) [nats]."""
    weights = np.exp(scores - scores.max(axis=1, keepdims=True))
    return np.asarray((weights / weights.sum(axis=1, keepdims=True)).mean(axis=0))


def _enlarged(family: Family, systematic: Mapping[str, float]) -> Array:
    """Of each block of each axis (B,), by how much its scatter is enlarged: the square root of the axis's design effect."""
    counts = {axis: int(own.blocks.max(initial=-1)) + 1 for axis, own in family.state.system.axes.items()}
    return np.concatenate([np.full(n, np.sqrt(1.0 + (n - 1) * systematic[axis_of(axis)])) for axis, n in counts.items()])


def preferred(state: State, answers: Sequence[Answer]) -> tuple[State, list[Answer]]:
    """The set with the most probable of what cannot be distinguished in the place of what the search chose, moved together,
    where that leaves no more of the gap.

    A nominal parameter that the chosen one stands for is fixed beside it. So it is beside the other when the two are compared.
    """
    found = []
    for answer in answers:
        best = _more_probable(answer)
        named = answer
        if answer.chosen is not None and best is not None:
            others = [one for one in state.effects if not alike(one, answer.chosen)]
            with suppress(UserError):
                ahead = settled_on(state.of((*others, best)))
                likely = _holding(ahead, state.held()).reached > state.reached - CLEARLY
                if likely and not ahead.leaves_more_than(state):
                    state, named = ahead, replace(answer, chosen=best)
        found.append(named)
    return state, found


def _holding(state: State, held: frozenset[int]) -> State:
    """The set, more of the nominal parameters as modelled."""
    fair = state
    for number in held - state.held():
        fair = fair.holding(number)
    return fair if fair is state else settled_on(fair)


def _more_probable(answer: Answer) -> PlacedEffect | None:
    """What is more probable than the chosen effect, and as good; of what the recordings can be asked for.

    Effects of one torque under several names share its weight: on a slide an offset, an asymmetry of friction and gravity. So
    each counts with all of the same torque.
    """
    able = [one for one in answer.members if one.as_good and not one.proposal.only_listed]
    if answer.chosen is None or not able:
        return None
    ranks = [_rank(one, able) for one in able]
    own = next((rank for one, rank in zip(able, ranks, strict=True) if _same(one.proposal, answer.chosen)), (0.0, 0.0))
    best = max(range(len(able)), key=lambda k: (*ranks[k], able[k].proposal.effect.effect.name))
    return able[best].proposal.effect if ranks[best] > own else None


def _rank(one: Weighed, able: Sequence[Weighed]) -> tuple[float, float]:
    """Weight of a torque under all its names and under this one, to the digits that are no rounding."""
    together = sum(other.weight for other in able if _unlike(one.proposal, other.proposal) < ROUNDING)
    return round(together / ROUNDING) * ROUNDING, round(one.weight / ROUNDING) * ROUNDING


def _unlike(one: Proposal, other: Proposal) -> float:
    """Share of the energy of a torque that no multiple of another one explains, whitened."""
    product = sum(float(rows @ other.column[axis]) for axis, rows in one.column.items() if axis in other.column)
    energies = [sum(float(rows @ rows) for rows in each.column.values()) for each in (one, other)]
    return 1.0 - product**2 / max(energies[0] * energies[1], np.finfo(float).tiny)


def believed(state: State, answers: Sequence[Answer]) -> State:
    """The set without the effects that have less than half of the weight: the median probability model, which predicts best.

    Barbieri and Berger, Annals of Statistics 32(3), 2004. As it was where the others make no mechanism without them. The noise
    is coloured as what is left now: that of the whole set does not know what the others explained.
    """
    doubted = [one.chosen for one in answers if one.chosen is not None and not one.believed]
    kept = [one for one in state.effects if not any(alike(one, each) for each in doubted)]
    if len(kept) == len(state.effects):
        return state
    try:
        return coloured(state.of(kept), ())
    except UserError:
        return state


def _set_with(family: Family, one: Proposal) -> Set:
    """A member's set: settled, or else the family's with what the member costs and its tangents."""
    if one.settled is not None:
        return one.settled, (), None, one.settled.held()
    return family.state, one.tangents, one.column, one.held


def _strain(state: State, tangents: Sequence[Column], column: Column | None, held: frozenset[int]) -> float:
    """What a member asks of nominal parameters [nats], which what is held out does not tell."""
    system = state.system
    return system.strain(system.fit(tangents, column, held, NEARBY))


def _without(family: Family) -> frozenset[int]:
    """Nominal parameters that are not free where nothing is off: those that the chosen effect is."""
    if family.chosen is None or not family.chosen.effect.of_model:
        return family.state.held()
    return family.state.held(family.chosen.effect.name, family.chosen.axis)


def _held_out(
    state: State, tangents: Sequence[Column], column: Column | None, held: frozenset[int], settings: Settings
) -> Array:
    """Log density [nats] of all blocks of all axes, (B,)."""
    return _of_blocks(state.system, tangents, column, held, settings)


def _of_blocks(
    system: System, tangents: Sequence[Column], column: Column | None, held: frozenset[int], settings: Settings
) -> Array:
    folds = {axis: np.arange(int(own.blocks.max(initial=-1)) + 1) % settings.folds for axis, own in system.axes.items()}
    found = system.held_out(folds, settings.folds, tangents, column, held, NEARBY)
    return np.concatenate(list(found.values()))


def _same(one: Proposal, chosen: PlacedEffect) -> bool:
    return (one.effect.effect.name, one.effect.axis) == (chosen.effect.name, chosen.axis) and one.effect.effect == chosen.effect
