"""A transmission's effects sought again from all their starts, in white noise, once the rest of an axis is named.

Of play on a stiff flank every impact counts, so its likelihood has many valleys. Which one a search went down was decided
before the friction beside it was named. The colour of what that valley left then speaks against every other one: here each set
is compared in its own colour.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.diagnosis.weigh.colouring import in_its_noise
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, first_colours, state_of
from drivetwin.emulator.effects import Effect, PlacedEffect
from drivetwin.emulator.effects.transmission_effect import TransmissionEffect
from drivetwin.foundation.errors import UserError


def restarted(pair: Pair, proposals: Sequence[Proposal], proposer: Proposer) -> Pair:
    """The set, or a better one with another effect of the same kinds in the place of those of a transmission."""
    for axis in pair.whole.axes_of([one for one in pair.whole.effects if _of_transmission(one)]):
        kinds = [type(one.effect) for one in pair.whole.effects if one.axis == axis and _of_transmission(one)]
        found = [_sought_again(pair, axis, kind, proposer) for kind in kinds]
        able = [one for one in found if one is not None]
        best = max(able, key=proposer.rated, default=None)
        if best is None:
            continue
        stands = in_its_noise(pair.whole, pair.whole, axis)
        if proposer.rated(best) > proposer.rated(stands) + CLEARLY and not best.leaves_more_than(stands):
            pair = pair.as_noise_is(best, proposals)
    return pair


def _of_transmission(one: PlacedEffect) -> bool:
    return isinstance(one.effect, TransmissionEffect)


def _sought_again(pair: Pair, axis: str, kind: type[Effect], proposer: Proposer) -> State | None:
    """The set with one effect of a kind in the place of all of the axis's transmission, settled, in its own colour."""
    others = [one for one in pair.whole.effects if not (one.axis == axis and _of_transmission(one))]
    try:
        white = Pair(*(_white(one, others) for one in (pair.whole, pair.part)))
        best = proposer.afresh(white, axis, kind)
        if best is None:
            return None
        return in_its_noise(white.settled([*others, best.effect], axis=axis), pair.whole, axis)
    except UserError:
        return None


def _white(state: State, effects: Sequence[PlacedEffect]) -> State:
    return state_of(state.bench, effects, first_colours(state.bench), state.late)
