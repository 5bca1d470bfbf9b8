"""A transmission's effects sought again from all their starts, in white noise, once the rest of an axis is named.

Of play on a stiff flank every impact counts, so its likelihood has many valleys. Which one a search went down was decided
before the friction beside it was named: alone, play is bent to how that friction yields, and beside such play the friction
finds nothing left of it. So both are also sought together. The colour of what a valley left speaks against every other one:
here each set is compared in its own colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from drivetwin.diagnosis.propose.placing import Name, name_of, placed
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.colouring import in_its_noise
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import BRIEF, tried_set, yields
from drivetwin.emulator.effects import AxisEffect, Effect, PlacedEffect
from drivetwin.emulator.effects.base import Look
from drivetwin.emulator.effects.transmission_effect import TransmissionEffect
from drivetwin.foundation.errors import UserError

ALONE = 24
"""Starts of a transmission's effect, the best alone, that are compared beside every start of a friction."""
BOTH = 4
"""Starts of both, the best, that are moved: in white noise they differ by little."""


@dataclass(frozen=True)
class Restart:
    """Of a search. Both kinds of effects are sought together once beside the same others: it takes its time."""

    proposer: Proposer
    _asked: set[tuple[str, type[Effect], type[Effect], frozenset[Name]]] = field(init=False, default_factory=set)

    def restarted(self, pair: Pair, proposals: Sequence[Proposal]) -> Pair:
        """The set, or a better one with another effect of the same kinds in the place of those of a transmission."""
        for axis in pair.whole.axes_of([one for one in pair.whole.effects if _of_transmission(one)]):
            kinds = [type(one.effect) for one in pair.whole.effects if one.axis == axis and _of_transmission(one)]
            found = [_sought_again(pair, axis, kind, self.proposer) for kind in kinds]
            found += [self._together(pair, axis, *both) for both in product(kinds, self._frictions(pair, axis))]
            able = [one for one in found if one is not None]
            best = max(able, key=self.proposer.rated, default=None)
            if best is None:
                continue
            stands = in_its_noise(pair.whole, pair.whole, axis)
            if self.proposer.rated(best) > self.proposer.rated(stands) + CLEARLY and not best.leaves_more_than(stands):
                pair = pair.as_noise_is(best, proposals)
        return pair

    def _frictions(self, pair: Pair, axis: str) -> list[type[Effect]]:
        """Kinds of friction that yields; none where the torque is what a drive would have asked for, which errs by more."""
        if any(run.axes[axis].asked is not None for run in pair.whole.rows.runs):
            return []
        return [kind for kind in self.proposer.kinds[axis] if yields(kind) and Look.LEVEL in kind.looks]

    def _together(self, pair: Pair, axis: str, kind: type[Effect], friction: type[Effect]) -> State | None:
        others = [one for one in pair.whole.effects if not (one.axis == axis and yields(type(one.effect)))]
        asked = axis, kind, friction, frozenset(map(name_of, others))
        if asked in self._asked:
            return None
        self._asked.add(asked)
        return _sought_together(pair, axis, others, kind, friction)


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


def _sought_together(
    pair: Pair, axis: str, others: Sequence[PlacedEffect], kind: type[Effect], friction: type[Effect]
) -> State | None:
    """The same with friction that yields before it slides, beside the others: both from all their starts."""
    assert issubclass(kind, AxisEffect)
    assert issubclass(friction, AxisEffect)
    try:
        white = Pair(*(_white(one, others) for one in (pair.whole, pair.part)))
        likeliest = _begun_together(white.part, axis, kind, friction)
        settled = side_by_side(lambda both: white.settled([*others, *both], axis=axis), likeliest)
        own = side_by_side(lambda one: in_its_noise(one, pair.whole, axis, BRIEF), settled)
        best = max(own, key=lambda one: one.reached, default=None)
        return in_its_noise(best, pair.whole, axis) if best is not None else None
    except UserError:
        return None


def _begun_together(
    alone: State, axis: str, kind: type[AxisEffect], friction: type[AxisEffect]
) -> list[tuple[PlacedEffect, PlacedEffect]]:
    """Both effects from their starts: the likeliest beside a set that has nothing that yields."""
    motion, dynamics = alone.rows.motion[axis], alone.dynamics[axis]
    starts, frictions = ([start.members[0] for start in each.starts(motion, dynamics)] for each in (kind, friction))
    best = sorted(zip(_evidence(alone, axis, starts), starts, strict=True), key=lambda one: -one[0])
    likely = [effect for _, effect in best[:ALONE]]
    found: list[tuple[float, Effect, Effect]] = []
    for yielding in frictions:
        beside = tried_set(alone, (*alone.effects, placed(alone.rows, axis, yielding)))
        if beside is not None:
            found += [(reached, yielding, one) for reached, one in zip(_evidence(beside, axis, likely), likely, strict=True)]
    able = sorted((one for one in found if one[0] > -np.inf), key=lambda one: -one[0])
    return [(placed(alone.rows, axis, yielding), placed(alone.rows, axis, one)) for _, yielding, one in able[:BOTH]]


def _evidence(state: State, axis: str, effects: Sequence[Effect]) -> list[float]:
    """Log evidence [nats] of the set with each of several effects where it is; -inf where nothing can follow it."""
    return side_by_side(lambda effect: state.evidence_with(axis, effect), effects)


def _white(state: State, effects: Sequence[PlacedEffect]) -> State:
    return state_of(state.bench, effects, state.bench.white, state.late)
