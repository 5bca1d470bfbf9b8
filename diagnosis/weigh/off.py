"""Nominal parameters of the model that are off by more than chance, as effects of their own or bodies of another mass."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
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
from drivetwin.foundation.errors import UserError

EASED = 0.1
"""Nats by which other nominal parameters are asked less where what moved them is named."""
RIVALS = 3
"""Of what could be so instead, the best as a straight line has them: their sets are settled."""


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
        family = _instead(proposer, state, number, effect)
        if family is None or family.chosen is None:
            continue
        with suppress(UserError):
            state = settled_on(state.of(_with(state.effects, family.chosen, state.bench.nominals[number].value)))
            families.append(family)


def _off(state: State, proposer: Proposer, number: int) -> PlacedEffect | None:
    """What a nominal parameter is if it is off; None where it is not, or cannot be asked.

    Bodies that are heavier are free beside it: where their motor is lighter by as much, neither shows alone.
    """
    one = state.bench.nominals[number]
    effect = one.off_by(float(state.fit.coefficients[number]))
    if effect is None or one.axis is None or type(effect) not in proposer.kinds.get(one.axis, ()):
        return None
    bodies = heavier(state)
    held = state.patched - {k for k, each in enumerate(state.bench.nominals) if each.body in bodies}
    return PlacedEffect(one.axis, effect, {}) if _is_off(state, number, held) else None


def heavier(state: State) -> frozenset[int]:
    """Bodies, by number, whose mass is off by more than chance and by enough to matter."""
    return frozenset(
        one.body
        for number, one in enumerate(state.bench.nominals)
        if one.body is not None and _is_off(state, number, state.patched)
    )


def _instead(proposer: Proposer, state: State, number: int, off: PlacedEffect) -> Family | None:
    """A nominal parameter that is off, beside a set that has it as the model does, and all that could be so instead.

    Only its size is open: a body that is heavier has its place. Most parameters are off by a little, so it costs what its prior
    says, if that is less than what it costs to name one of many effects.
    """
    exact = state.holding(number)
    named = proposer.evaluated(exact, Begun(off.axis, off.effect, 0.0, 1), 1)
    if named is None:
        return None
    usual = replace(named, score=state.fit.evidence - exact.fit.evidence, prior=-state.system.strain_of(state.fit, number))
    known = max(named, usual, key=lambda one: one.score)
    others = [one for one in proposer.proposals(Pair(exact, exact), [off.axis], ()) if not same_kind(one.effect, known.effect)]
    best = _better(state, number, known.score - usual.score, exact, others)
    return Family(best.effect if best is not None else known.effect, exact, [known, *others])


def _better(state: State, number: int, named: float, exact: State, others: Sequence[Proposal]) -> Proposal | None:
    """What takes the place of a nominal parameter: what is better, its set settled, and asks no more of the other parameters,
    or as good and asks less of them: what moved several is one cause. None where nothing does.

    `named`: what the parameter gains by being named instead of free [nats]. Without it everything is far from its place, and
    what a straight line promises there is no judge of a few nats.
    """
    best = sorted(others, key=lambda one: -one.score)[:RIVALS]
    settled = zip(best, side_by_side(lambda one: _settled_with(exact, one), best), strict=True)
    found = [(one.prior + ahead.reached, one, ahead) for one, ahead in settled if ahead is not None]
    if not found:
        return None
    score, one, ahead = max(found, key=lambda each: each[0])
    gained = score - state.reached - named
    eased = state.strain - state.system.strain_of(state.fit, number) - ahead.strain
    better = gained > -CLEARLY and (eased > EASED or (gained > CLEARLY and eased > -CLEARLY))
    return one if better else None


def _settled_with(exact: State, one: Proposal) -> State | None:
    """A set with a proposal, all parameters where they then belong; None where it makes no mechanism."""
    found = tried_set(exact, (*exact.effects, one.effect))
    return settled_on(found) if found is not None else None


def _is_off(state: State, number: int, held: frozenset[int]) -> bool:
    """By more than chance, and by enough to matter where others are `held`."""
    if number in state.held():
        return False
    amount, deviation = state.fit.coefficients[number], np.sqrt(max(state.fit.covariance[number, number], 0.0))
    if abs(amount) < state.bench.settings.off * deviation:
        return False
    if not state.bench.nominals[number].told:
        return True
    left, free = state.energy(held), state.energy(held - {number})
    return max(left[axis] - free[axis] for axis in free) >= state.bench.settings.least_share


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
