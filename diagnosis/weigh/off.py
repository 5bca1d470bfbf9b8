"""Nominal parameters of the model that are off by more than chance, as effects of their own or bodies of another mass."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from math import log

import numpy as np

from drivetwin.diagnosis.propose.placing import Name, name_of
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.weigh.averaging import CONSIDERED, PROBABLE, Answer, Weighed
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Family, Proposal, same_kind
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on, tried_set
from drivetwin.emulator.effects import ModelEffect, PlacedEffect
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.foundation.errors import UserError

Weigh = Callable[[Family], Answer]

EASED = 0.1
"""Nats by which other nominal parameters are asked less where what moved them is named."""


def corrected(state: State, proposer: Proposer, weigh: Weigh, given_up: Collection[Name] = ()) -> tuple[State, list[Answer]]:
    """Nominal parameters of axes that are off by more than chance and by enough to matter, as effects of their own.

    Each is asked again when another has become one: a mass that is off may hide what an inertia is. One that is not believed
    has no part in the set: the others would move to make up for it. `given_up`: effects that do not come back in their place.
    """
    answers, doubted = list[Answer](), dict[int, Answer]()
    state, done = settled_on(state), set[int]()
    while True:
        open_ones = [number for number in range(len(state.bench.nominals)) if number not in done]
        off = next(((number, effect) for number in open_ones if (effect := _off(state, proposer, number)) is not None), None)
        if off is None:
            return state, [*answers, *doubted.values()]
        number, effect = off
        done.add(number)
        family = _instead(proposer, state, number, effect, given_up)
        if family is None or family.chosen is None:
            continue
        answer = weigh(family)
        if not answer.believed:
            doubted[number] = answer
            continue
        with suppress(UserError):
            state = settled_on(state.of(_with(state.effects, family.chosen, state.bench.nominals[number].value)))
            answers.append(answer)
            done -= set(doubted)
            doubted.clear()


def _off(state: State, proposer: Proposer, number: int) -> PlacedEffect | None:
    """What a nominal parameter is if it is off; None where it is not, or cannot be asked."""
    one = state.bench.nominals[number]
    within = state.bench.settings.off * float(np.sqrt(max(state.fit.covariance[number, number], 0.0)))
    effect = one.off_by(float(state.fit.coefficients[number]), within)
    if effect is None or one.axis is None or type(effect) not in proposer.kinds.get(one.axis, ()):
        return None
    return PlacedEffect(one.axis, effect, {}) if is_off(state, number) else None


def heavier(state: State) -> frozenset[int]:
    """Bodies, by number, whose mass is off by more than chance and by enough to matter."""
    return frozenset(
        one.body for number, one in enumerate(state.bench.nominals) if one.body is not None and is_off(state, number)
    )


def instead_of_masses(state: State, proposer: Proposer, given_up: Collection[Name] = ()) -> tuple[State, list[Answer]]:
    """The set with an effect in the place of each body of another mass where that is more probable; and what else each may be.

    No effect of the library makes a body lighter. A force that never changes costs nearly the same on a lift. `given_up`:
    effects that are not named.
    """
    state, answers = settled_on(state), []
    for number, one in enumerate(state.bench.nominals):
        if one.body is None or not is_off(state, number):
            continue
        answer = _instead_of_mass(state, number, proposer, given_up)
        if answer.chosen is not None:
            ahead = tried_set(state, (*state.effects, answer.chosen))
            ahead = settled_on(ahead) if ahead is not None else state
            if is_off(ahead, number) or ahead is state:
                answer = replace(answer, chosen=None, predicts=False)
            else:
                state = ahead
        answers.append(answer)
    return state, answers


def _instead_of_mass(state: State, number: int, proposer: Proposer, given_up: Collection[Name]) -> Answer:
    """Weighed by evidence: the body's mass free, or as modelled beside an effect, no other mass, that takes half as much."""
    axis, body = state.bench.nominals[number].loaded_axis, state.bench.nominals[number].body
    exact = state.holding(number)
    least = state.bench.settings.substitutes * max(_explained_by(state, number).values())
    asked = proposer.proposals(Pair(exact, exact), [axis], ())
    found = [one for one in asked if one.takes >= least and not isinstance(one.effect.effect, ModelEffect)]
    likeliest = sorted(found, key=lambda one: -one.score)[:CONSIDERED]
    sets = [(one, tried_set(exact, (*exact.effects, one.effect))) for one in likeliest]
    able = [(one, settled_on(each, axis=axis).reached + one.prior + one.rare) for one, each in sets if each is not None]
    best = max((score for _, score in able), default=-np.inf)
    weights = np.exp(np.array([state.reached, *(score for _, score in able)]) - max(best, state.reached))
    weights /= weights.sum()
    members = [
        Weighed(one, float(weight), score > best - CLEARLY) for (one, score), weight in zip(able, weights[1:], strict=True)
    ]
    alike_ones = [one for one in members if one.as_good and name_of(one.proposal.effect) not in given_up]
    probability = sum(one.weight for one in alike_ones)
    named = max(alike_ones, key=lambda one: (round(one.weight, 6), one.proposal.effect.effect.name), default=None)
    chosen = named.proposal.effect if named is not None and probability >= PROBABLE else None
    return Answer(chosen, probability, chosen is not None, tuple(sorted(members, key=lambda one: -one.weight)), body)


def _instead(proposer: Proposer, state: State, number: int, off: PlacedEffect, given_up: Collection[Name]) -> Family | None:
    """A nominal parameter that is off, in a set that has it as the model does, and all that could be so instead. It may be what
    was given up as well.

    Only its size is open: a body that is heavier has its place. Most parameters are off by a little, so it costs what its prior
    says, if that is less than what it costs to name one of many effects. Something else takes its place where it is better and
    asks no more of the other parameters, or as good and asks less of them: what moved several is one cause. So is what leaves
    none of its axis off, if it is clearly worse by no more than what their names cost.
    """
    exact = state.holding(number)
    named = proposer.evaluated(exact, Begun(off.axis, off.effect, 0.0, 1), 1)
    if named is None:
        return None
    explained = _explained_by(state, number)
    named = replace(named, taken={name: explained[name] for name in named.column})
    usual = replace(named, score=state.fit.evidence - exact.fit.evidence, prior=-state.system.strain_of(state.fit, number))
    known = max(named, usual, key=lambda one: one.score)
    pair = Pair(exact, exact)
    others = [one for one in proposer.proposals(pair, [off.axis], ()) if not same_kind(one.effect, known.effect)]
    others = [replace(one, only_listed=True) if name_of(one.effect) in given_up else one for one in others]
    spared = _spared(others, known, exact, proposer)
    others = [replace(one, score=one.score + more, prior=one.prior + more) for one, more in zip(others, spared, strict=True)]
    able = [(one, more) for one, more in zip(others, spared, strict=True) if not one.only_listed]
    best, more = max(able, key=lambda each: each[0].score, default=(known, 0.0))
    instead = best.score > known.score - CLEARLY if more > 0.0 else _instead_of(known, best, state, number)
    chosen = best.effect if instead else known.effect
    return Family(chosen, exact, [known, *others, *proposer.veiled_ones(pair, off.axis)])


def _instead_of(known: Proposal, best: Proposal, state: State, number: int) -> bool:
    gained = best.score - known.score
    if gained <= -CLEARLY:
        return False
    eased = state.strain - state.system.strain_of(state.fit, number) - _strained(state.holding(number), best.effect)
    return eased > EASED or (gained > CLEARLY and eased > -CLEARLY)


def _spared(others: Sequence[Proposal], known: Proposal, exact: State, proposer: Proposer) -> list[float]:
    """What each of other effects spares: what it would cost to name the nominal parameters of the axis that are off beside the
    known one, where none of them is beside it [nats].

    A torque constant is friction, inertia and weight that are off alike: each of them would be one of many that were tried.
    """
    axis, nominals = known.effect.axis, exact.bench.nominals
    own = [number for number, one in enumerate(nominals) if one.loaded_axis == axis and not one.timing]
    name = log(proposer.tried(axis))
    able = [known.score - one.score < CLEARLY + name * len(own) for one in others]
    most = name * _off_beside(known, exact, own) if any(able) else 0.0
    return [
        most if most > 0.0 and may and not _off_beside(one, exact, own) else 0.0 for one, may in zip(others, able, strict=True)
    ]


def _off_beside(one: Proposal, exact: State, own: Collection[int]) -> int:
    """How many of some nominal parameters are off in a set with one effect more."""
    state = settled_on(exact.of((*exact.effects, one.effect)))
    return sum(is_off(state, number) for number in own)


def _strained(exact: State, effect: PlacedEffect) -> float:
    """What a set with an effect asks of nominal parameters once it has settled [nats]."""
    return settled_on(exact.of((*exact.effects, effect))).strain


def is_off(state: State, number: int) -> bool:
    """Whether a nominal parameter is off by more than chance, and by enough to matter beside the effects where they are.

    They could move to imitate it; its deviation says how well, with the parameter free.
    """
    held = state.held()
    if number in held:
        return False
    amount, deviation = state.fit.coefficients[number], np.sqrt(max(state.fit.covariance[number, number], 0.0))
    if abs(amount) < state.bench.settings.off * deviation:
        return False
    if not state.bench.nominals[number].told:
        return True
    return max(_explained_by(state, number).values()) >= state.bench.settings.least_share


def _explained_by(state: State, number: int) -> dict[str, float]:
    """Share of the energy of each gap that a nominal parameter explains beside the effects where they are."""
    as_modelled, free = state.energy_still(state.patched), state.energy_still(state.patched - {number})
    return {axis: as_modelled[axis] - free[axis] for axis in free}


def _with(effects: Sequence[PlacedEffect], new: PlacedEffect, before: float) -> tuple[PlacedEffect, ...]:
    """With another Coulomb level beneath it, a Stribeck effect keeps its height above that."""
    raised = getattr(new.effect, "coulomb", before) - before
    kept = [
        replace(one, effect=replace(one.effect, static_torque=max(0.0, one.effect.static_torque + raised)))
        if isinstance(one.effect, Stribeck) and one.axis == new.axis
        else one
        for one in effects
    ]
    return (*kept, new)
