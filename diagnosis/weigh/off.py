"""Nominal parameters of the model that are off by more than chance, as effects of their own or bodies of another mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Family, Proposal, same_kind
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on, tried_set
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.stribeck import Stribeck

EASED = 0.1
"""Nats by which other nominal parameters are asked less where what moved them is named."""
RIVALS = 3
"""What could be so instead, the best by their scores, whose sets are settled."""


def corrected(state: State, proposer: Proposer) -> tuple[State, list[Family]]:
    """Nominal parameters of axes that are off by more than chance and by enough to matter, as effects of their own.

    Each is asked again when another has become one: a mass that is off may hide what an inertia is.
    """
    families: list[Family] = []
    state, done = settled_on(state), set[int]()
    while True:
        open_ones = [number for number in range(len(state.bench.nominals)) if number not in done]
        off = next(((number, effect) for number in open_ones if (effect := _off(state, proposer, number)) is not None), None)
        if off is None:
            return state, families
        number, effect = off
        done.add(number)
        found = _instead(proposer, state, number, effect)
        if found is not None:
            family, state = found
            families.append(family)


def _off(state: State, proposer: Proposer, number: int) -> PlacedEffect | None:
    """What a nominal parameter is if it is off; None where it is not, or cannot be asked.

    The masses of the other bodies that are heavier are free: a motor that is lighter by as much hides them, and they hide it.
    """
    one = state.bench.nominals[number]
    effect = one.off_by(float(state.fit.coefficients[number]))
    if effect is None or one.axis is None or type(effect) not in proposer.kinds.get(one.axis, ()):
        return None
    if not _by_more_than_chance(state, number):
        return None
    bodies = heavier(state)
    others = {k for k, each in enumerate(state.bench.nominals) if each.body in bodies and k != number}
    return PlacedEffect(one.axis, effect, {}) if _matters(state, number, state.patched - others) else None


def heavier(state: State) -> frozenset[int]:
    """Bodies, by number, whose mass is off by more than chance and by enough to matter."""
    return frozenset(
        one.body
        for number, one in enumerate(state.bench.nominals)
        if one.body is not None and _by_more_than_chance(state, number) and _matters(state, number, state.patched)
    )


def _by_more_than_chance(state: State, number: int) -> bool:
    if number in state.held():
        return False
    amount, deviation = state.fit.coefficients[number], np.sqrt(max(state.fit.covariance[number, number], 0.0))
    return bool(abs(amount) >= state.bench.settings.off * deviation)


def _matters(state: State, number: int, held: frozenset[int]) -> bool:
    """Whether more of the gap is left without the correction of a parameter, while others are `held`."""
    if not state.bench.nominals[number].told:
        return True
    left = state.left if held == state.patched else state.energy(held)
    free = state.energy(held - {number})
    return max(left[axis] - free[axis] for axis in free) >= state.bench.settings.least_share


def _instead(proposer: Proposer, state: State, number: int, off: PlacedEffect) -> tuple[Family, State] | None:
    """A nominal parameter that is off, in a set that has it as the model does, and all that could be so instead; and the set
    with what it is. None where that makes no mechanism.

    Only its size is open: a body that is heavier has its place. Most parameters are off by a little, so it costs what its prior
    says, if that is less than what it costs to name one of many effects.
    """
    exact = state.holding(number)
    by_name = proposer.evaluated(exact, Begun(off.axis, off.effect, 0.0, 1), 1)
    if by_name is None:
        return None
    usual = replace(by_name, score=state.fit.evidence - exact.fit.evidence, prior=-state.system.strain_of(state.fit, number))
    known = max(by_name, usual, key=lambda one: one.score)
    others = [one for one in proposer.proposals(Pair(exact, exact), [off.axis], ()) if not same_kind(one.effect, known.effect)]
    rival = _better(state, number, known.score - usual.score, others)
    if rival is not None:
        chosen, ahead = rival
        return Family(chosen.effect, exact, [known, *others]), ahead
    named = tried_set(state, _with(state.effects, known.effect, state.bench.nominals[number].value))
    return (Family(known.effect, exact, [known, *others]), settled_on(named)) if named is not None else None


def _better(state: State, number: int, gained_by_name: float, others: Sequence[Proposal]) -> tuple[Proposal, State] | None:
    """The rival that takes the place of a nominal parameter, and the set with it; None where none does.

    It has to be better and to ask no more of the other parameters, or to be as good and ask less: what moved several is one
    cause. Each rival is judged by its set, settled. With the parameter held everything is far from its place, and a straight
    line errs there by more than a few nats. `gained_by_name`: what the parameter gains by being named instead of free [nats].
    """
    best = sorted(others, key=lambda one: -one.score)[:RIVALS]
    settled = zip(best, side_by_side(lambda one: _settled_with(state, number, one), best), strict=True)
    found = []
    for one, ahead in settled:
        if ahead is None:
            continue
        gained = one.prior + ahead.reached - state.reached - gained_by_name
        eased = _asked_of_others(state, number) - _asked_of_others(ahead, number)
        if gained > -CLEARLY and (eased > EASED or (gained > CLEARLY and eased > -CLEARLY)):
            found.append((gained, one, ahead))
    return max(found, key=lambda each: each[0])[1:] if found else None


def _settled_with(state: State, number: int, one: Proposal) -> State | None:
    """A set with a proposal, all parameters where they then belong: with a nominal parameter held at first, for where that is
    free the others have little to do. None where it makes no mechanism.
    """
    held = tried_set(state.holding(number), (*state.effects, one.effect))
    free = tried_set(state, settled_on(held).effects) if held is not None else None
    return settled_on(free) if free is not None else None


def _asked_of_others(state: State, number: int) -> float:
    """What a set asks of all nominal parameters but one [nats]."""
    return state.strain - (state.system.strain_of(state.fit, number) if number not in state.held() else 0.0)


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
