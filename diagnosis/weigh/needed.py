"""What a patch still needs when all of a set is there: an effect may have become needless beside what was added after it."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial
from math import inf

from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.off import heavier
from drivetwin.diagnosis.weigh.pair import that_moves
from drivetwin.diagnosis.weigh.refit import CONVERGED, alone, least_squares, left_by
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import sets_without, settled_on
from drivetwin.emulator.effects import ModelEffect, PlacedEffect

ALIKE = 1e-4
"""Share of the gaps up to which two effects take the same: some of the least step. The first of the set goes."""


def needed(state: State) -> State:
    """The set without the effects that a patch does not need: the others, fitted again, leave hardly more of the gap.

    The most needless goes first, and the others are asked again (backward elimination: Efroymson, in Mathematical Methods for
    Digital Computers, 1960). What goes may cost as much as one effect has to take, all together. So what is needed in the whole
    set is needed in each part of it, and is not asked again.
    """
    whole, bodies = state, heavier(state)
    state = least_squares(state, bodies, CONVERGED)
    best, asked = left_by(state, bodies), list(state.effects)
    while asked:
        found = side_by_side(partial(_without, state, bodies), asked)
        best = min(best, *(left for left, _ in found))  # of a part: the whole set had not come to rest
        needless = [
            (one, left, rest) for one, (left, rest) in zip(asked, found, strict=True) if left - best < state.bench.least(one)
        ]
        if not needless:
            break
        least = min(left for _, left, _ in needless)
        gone, _, state = next(each for each in needless if each[1] <= least + ALIKE)
        open_ones = [one for one, _, _ in needless if one is not gone]
        asked = [each for each in state.effects if any(alike(each, one) for one in open_ones)]
    return whole if len(state.effects) == len(whole.effects) else settled_on(coloured(state, ()))


def _without(state: State, bodies: Collection[int], one: PlacedEffect) -> tuple[float, State]:
    """Share of the gaps that a set leaves without one of its effects, and that set; infinite where it makes no mechanism.

    `bodies`: of free mass; those of others are held. Several axes feel an effect of a body: with one in the set all move.
    """
    tried = sets_without(one, state.effects)
    bodies_move = any(isinstance(each.effect, ModelEffect) for each in tried[0])
    moves = None if bodies_move else that_moves(one)
    rests = [rest for kept in tried if (rest := alone(state, kept, bodies, moves)) is not None]
    return min(((left_by(rest, bodies), rest) for rest in rests), key=lambda each: each[0], default=(inf, state))
