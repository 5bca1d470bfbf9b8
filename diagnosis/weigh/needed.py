"""What a set still needs when all of it is there: an effect may have become needless beside what was added after it."""

from __future__ import annotations

from functools import partial
from math import inf, log

from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.pair import Pair, that_moves
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import PlacedEffect

BRIEF = 5
"""Steps at most in which the others take over what an effect explained."""


def needed(state: State, proposer: Proposer) -> State:
    """The set, moved together, without the effects that it does not need: those that take next to nothing of the gap, and those
    that take little and say no more than they cost. The most needless goes first, and the others are asked again.
    """
    state = settled_on(state)
    while state.effects:
        gained, rest = max(side_by_side(partial(_without, state, proposer), state.effects), key=lambda each: each[0])
        if gained <= 0.0:
            break
        state = rest
    return state


def _without(state: State, proposer: Proposer, one: PlacedEffect) -> tuple[float, State]:
    """What a set gains without one of its effects [nats], and what is left of it: infinite where that takes next to nothing, 0
    where it takes more than a little or the others make no mechanism without it.

    It takes what is then left of the gap more, whether the others stay where they are or move.
    """
    less = Pair(state, state).without(one)
    if less is None:
        return 0.0, state
    rest = settled_on(less.whole, BRIEF, that_moves(one))
    takes = min(_taken(state, each) for each in (less.whole, rest))
    if takes < state.bench.least(one):
        return inf, rest
    gained = rest.reached + log(proposer.tried(one.axis)) - state.reached
    return gained if takes < state.bench.settings.least_share else 0.0, rest


def _taken(state: State, rest: State) -> float:
    """Share of an axis's gap that a set explains beyond another, on the axis where that is most."""
    left = _left(state)
    return max(without - left[axis] for axis, without in _left(rest).items())


def _left(state: State) -> dict[str, float]:
    """Share of the gap's energy that the patch leaves on each axis."""
    return state.energy(state.patched | state.as_recorded)
