"""From the set that a search found to the one that is named: less what is doubtful, needless or not worth what it costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import log

from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.averaging import Answer, believed
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.off import corrected, heavier
from drivetwin.diagnosis.weigh.proposal import Family
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.refit import left_by
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on, tried_set
from drivetwin.emulator.effects import PlacedEffect

Weigh = Callable[[Family], Answer]


def named(state: State, answers: Sequence[Answer], proposer: Proposer, weigh: Weigh) -> tuple[State, list[Answer]]:
    """The set that is named, and the answers with those about nominal parameters that are off.

    What was worth its cost beside an effect that has gone may not be so without it: a weight beside a torque constant, say.
    Then nominal parameters take its place, if that leaves no more of the gap, and all is asked again.
    """
    state, told = _named(state, answers, proposer, weigh)
    while True:
        lean = _affordable(state, proposer)
        if lean is state:
            return state, told
        ahead, others = _named(lean, answers, proposer, weigh)
        if _left(ahead) > _left(state) + state.bench.settings.least_share:
            return state, told
        state, told = ahead, others


def _named(state: State, answers: Sequence[Answer], proposer: Proposer, weigh: Weigh) -> tuple[State, list[Answer]]:
    """Less what is doubtful, with nominal parameters that are off as effects, and less what a patch does not need."""
    state, off = corrected(believed(state, answers), proposer)
    told = [*answers, *map(weigh, off)]
    return needed(aligned(believed(state, told))), told


def _affordable(state: State, proposer: Proposer) -> State:
    """Without the effects that say less than they cost, the worst first; nominal parameters are free in their place."""
    best, most = state, state.reached
    for one in state.effects:
        less = None if _is_nominal(one, state) else tried_set(state, [each for each in state.effects if each is not one])
        cost = log(proposer.tried(one.axis))
        if less is None or less.fit.evidence + cost <= most:
            continue
        less = settled_on(less)
        if less.reached + cost > most:
            best, most = less, less.reached + cost
    return best if best is state else _affordable(best, proposer)


def _is_nominal(one: PlacedEffect, state: State) -> bool:
    """Whether an effect is a parameter of the model that is off: it costs what its prior says, not a name."""
    return any(each.told and (each.effect, each.axis) == (one.effect.name, one.axis) for each in state.bench.nominals)


def _left(state: State) -> float:
    return left_by(state, heavier(state))
