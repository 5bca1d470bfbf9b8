"""What a patch still needs when all of a set is there: an effect may have become needless beside what was added after it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from math import inf

from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.off import heavier
from drivetwin.diagnosis.weigh.pair import that_moves
from drivetwin.diagnosis.weigh.refit import least_squares, left_by
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.foundation.errors import UserError

ROUNDED = 6
"""Digits of a share of energy, up to which two effects take the same."""


def needed(state: State) -> State:
    """The set without the effects that a patch does not need: the others, fitted anew, leave hardly more of the gap.

    The most needless of an axis goes first, and the others are asked again (backward elimination: Efroymson, in Mathematical
    Methods for Digital Computers, 1960).
    """
    whole, bodies = state, heavier(state)
    state = least_squares(state, bodies)
    for axis in sorted(state.rows.axes):  # in whichever order they were recorded
        while own := [one for one in state.effects if one.axis == axis]:
            needs, rest = _least_needed(state, bodies, own)
            if needs >= 0.0:
                break
            state = rest
    return whole if len(state.effects) == len(whole.effects) else settled_on(state)


def _least_needed(state: State, bodies: Collection[int], own: Sequence[PlacedEffect]) -> tuple[float, State]:
    """Of some effects the one that takes least beyond what it has to: how much that is, and the set without it.

    `bodies`: of free mass; those of others are held. Equal ones go in the order of the set, whatever the rounding.
    """
    return min(side_by_side(partial(_without, state, bodies), own), key=lambda each: round(each[0], ROUNDED))


def _without(state: State, bodies: Collection[int], one: PlacedEffect) -> tuple[float, State]:
    """What an effect takes of the gaps of all axes beyond what it has to, and the set without it.

    Infinite where the others make no mechanism.
    """
    try:
        rest = state.of([each for each in state.effects if each is not one])
    except UserError:
        return inf, state
    rest = least_squares(rest, bodies, that_moves(one))
    return left_by(rest, bodies) - left_by(state, bodies) - state.bench.least(one), rest
