"""What could stand in the place of each effect of a set, or nothing: the better takes it, the others are its family."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.progress import Progress
from drivetwin.diagnosis.propose.placing import alike, placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.alignment import LEAST
from drivetwin.diagnosis.weigh.colouring import in_its_noise
from drivetwin.diagnosis.weigh.pair import Pair, that_moves
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Family, Proposal, same_kind
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import BRIEF, ENOUGH, STEPS, reduced, sets_without, settled_on, yields
from drivetwin.emulator.effects import AxisEffect, Effect, ModelEffect, PlacedEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

ALIKE = 0.3
"""Cosine of the torques of two effects of an axis, from which they may be one: a convention."""
MOST_ALIKE = 2
"""Of those, that are sought again without the first: each takes a search of its kind."""
IN_PLACE = 3
"""Proposals, the best of those that take as much, that are settled in the place of an effect."""


@dataclass(frozen=True)
class _Asked:
    """What could stand in the place of an effect, with what acted on its axis and how late its torque was read [s]."""

    acts: tuple[PlacedEffect, ...]
    late: float
    family: Family


@dataclass(frozen=True)
class Exchange:
    """Of the effects of a set, each in turn."""

    proposer: Proposer
    rivals: Mapping[tuple[str, str], frozenset[str]]
    """What else gained a good part of what each effect gained when it was added, by name and axis."""
    progress: Progress
    _families: list[_Asked] = field(init=False, default_factory=list)

    def exchanged(self, pair: Pair, proposals: Sequence[Proposal]) -> tuple[Pair, list[Family], bool]:
        """Each effect again beside the others: nothing in its place, or what could stand there; the better takes it.

        The largest first: what stands wrongly in the place of another bends those beside it.
        """
        families, changed = [], False
        pair = Pair(settled_on(pair.whole), pair.part)
        stands: dict[str | None, State] = {}
        for asked in _largest_first(pair.whole):
            one = next((each for each in pair.whole.effects if alike(each, asked)), None)
            if one is None:
                continue
            known = self._known(pair.whole, one)
            if known is not None:
                families.append(known)
                continue
            family = self._family(pair, one)
            if family is None:
                continue
            moves = that_moves(one)
            if moves not in stands:
                stands[moves] = in_its_noise(pair.whole, pair.whole, moves)
            moved = replace(family, proposals=[*family.proposals, *self._sought_again(pair, family)])
            better = self._better(moved, pair.whole, stands[moves])
            if better is not None:
                pair, changed, stands = pair.as_noise_is(better, proposals), True, {}
                continue
            families.append(self._whole(pair, one, family))
            acts, late = _what_acts_on(one.axis, pair.whole), pair.whole.late.get(one.axis, 0.0)
            self._families.append(_Asked(acts, late, families[-1]))
        return pair, families, changed

    def completed(self, pair: Pair) -> list[Family]:
        """The families of the effects in a set in which nothing is exchanged any more: those that are known, of what acts on
        their axis as it is, and the others asked for.
        """
        found = []
        for one in pair.whole.effects:
            known = self._known(pair.whole, one)
            if known is None and (asked := self._family(pair, one)) is not None:
                known = self._whole(pair, one, asked)
            if known is not None:
                found.append(known)
        return found

    def _known(self, state: State, one: PlacedEffect) -> Family | None:
        """The family of an effect of a set, where it was asked for, and what acts on its axis has moved by less since than a
        further step would have to bring.
        """
        acts, late = _what_acts_on(one.axis, state), state.late.get(one.axis, 0.0)
        place = next(k for k, each in enumerate(acts) if each is one)
        for asked in reversed(self._families):
            same = len(asked.acts) == len(acts) and asked.acts[place] is asked.family.chosen
            if same and abs(asked.late - late) < LEAST and state.moved_by(asked.acts, acts) < ENOUGH:
                return asked.family
        return None

    def _whole(self, pair: Pair, one: PlacedEffect, family: Family) -> Family:
        """An effect's family, with what it may be that does not take its place."""
        others = [each for each in family.proposals if each.settled is pair.whole or not same_kind(each.effect, one)]
        return replace(family, proposals=[*others, *self._hidden(pair, one, others), *self._veiled(pair, one, others)])

    def _family(self, pair: Pair, one: PlacedEffect) -> Family | None:
        """Nothing and all that could stand in an effect's place, everything beside it moved to where it then belongs; None
        where the others make no mechanism without it.
        """
        self.progress(f"what else than {one.effect.name} on {one.axis}", 0.7)
        beside = pair.without(one)
        if beside is None:
            return None
        known = self.proposer.evaluated(beside.whole, Begun(one.axis, one.effect, 0.0, 1), in_set=True)
        rivals = self.rivals.get((one.effect.name, one.axis))
        others = [*self.proposer.instead(beside, one, rivals), *self._simpler(beside.whole, one)]
        own = [replace(known, settled=pair.whole)] if known is not None else []
        return Family(one, self._nothing(beside, one), [*own, *self._in_place(beside, others, known)])

    def _nothing(self, beside: Pair, one: PlacedEffect) -> State:
        """The set without an effect, moved to where it then belongs. Another that yields may have been fitted stiffer for it,
        and a simpler one on its axis may be what it was: play that has closed is a spring.
        """
        moves, effects = that_moves(one), beside.whole.effects
        rest, *softer = sets_without(one, effects)
        found = [beside.settled(rest, BRIEF, moves)]
        for each in softer:
            with suppress(UserError):
                found.append(beside.settled(each, BRIEF, moves))
        for other in effects:
            rest = [each for each in effects if each is not other]
            for both in _as_one(one, other):
                with suppress(UserError):
                    found.append(beside.settled([*rest, placed(beside.whole.rows, one.axis, both)], BRIEF, moves))
        return max(found, key=lambda state: state.reached)

    def _sought_again(self, pair: Pair, family: Family) -> list[Proposal]:
        """Without the chosen effect, each that is most like it, sought from all its starts, where that is better: two may
        imitate what is one.

        Beside a constant level that was found first, a warming explains only what varies about that. This is a move of the
        search and no alternative: the other effect is in the set anyway.
        """
        assert family.chosen is not None
        beside = pair.without(family.chosen)
        if beside is None:
            return []
        asked = [(other, neither) for other in _most_alike(pair.whole, family.chosen) if (neither := beside.without(other))]
        begun = [(neither, self.proposer.afresh(neither, other.axis, type(other.effect))) for other, neither in asked]
        found = [self._settled(neither, again) for neither, again in begun if again is not None]
        least = family.state.reached + CLEARLY
        return [one for one in found if one is not None and one.settled is not None and one.settled.reached > least]

    def _hidden(self, pair: Pair, one: PlacedEffect, known: Sequence[Proposal]) -> list[Proposal]:
        """What else than an effect of the model's own parameters could stand in its place, these as the model has them.

        Where they are free, they take what a rival would explain: the mass of a lift takes a friction that differs with the
        direction.
        """
        own = next((each for each in known if each.settled is pair.whole), None)
        beside = pair.without(one) if one.effect.of_model else None
        if beside is None or own is None:
            return []
        for number in pair.whole.held() - beside.whole.held():
            beside = Pair(beside.whole.holding(number), beside.part.holding(number))
        asked = self.proposer.instead(beside, one, self.rivals.get((one.effect.name, one.axis)))
        there = {each.effect.effect.name for each in known}
        return self._in_place(beside, [each for each in asked if each.effect.effect.name not in there], own)

    def _veiled(self, pair: Pair, one: PlacedEffect, known: Sequence[Proposal]) -> list[Proposal]:
        """What an effect may be as well, though the recordings lack what sets that apart."""
        own = next((each for each in known if each.settled is pair.whole), None)
        beside = pair.without(one) if self.proposer.veiled.get(one.axis) else None
        if beside is None or own is None:
            return []
        return self._in_place(beside, self.proposer.veiled_ones(beside, one.axis), own)

    def _better(self, family: Family, state: State, stands: State) -> State | None:
        """The set without an effect, or with another in its place, where that is better and leaves no more of the gap.

        With another in its place each is judged in the noise that it leaves itself; `stands`: the set in its own. Without it in
        the noise as it is: in that of what is left without, an effect passes as noise.
        """
        if _too_small(family, state):
            return family.state
        own = next((one for one in family.proposals if one.settled is state), None)
        others = [one for one in family.proposals if one is not own and one.settled is not None]
        moves = that_moves(family.chosen) if family.chosen is not None else None
        best = self._best_rival(others, state, stands, moves)
        known = self._rated(replace(own, settled=stands)) if own is not None else self.proposer.rated(stands)
        if best is not None and self._rated(best) > known + CLEARLY:
            return best.settled
        nothing = self.proposer.rated(family.state)
        worthless = own is None or nothing > self._rated(own)
        return family.state if worthless and not family.state.leaves_more_than(state) else None

    def _best_rival(self, others: Sequence[Proposal], state: State, stands: State, moves: str | None) -> Proposal | None:
        """The best of several in the noise that each leaves itself, of those that leave no more of the gap: all are settled
        there a few steps, and the best to its end.
        """

        def settled(one: Proposal, steps: int) -> Proposal:
            assert one.settled is not None
            return replace(one, settled=in_its_noise(one.settled, state, moves, steps))

        def able(one: Proposal) -> bool:
            return one.settled is not None and not one.settled.leaves_more_than(stands)

        begun = zip(side_by_side(lambda one: settled(one, BRIEF), others), others, strict=True)
        rated = sorted(begun, key=lambda each: -self._rated(each[0]))
        best = next((each for each in rated if able(each[0])), None)
        found = settled(best[1], STEPS) if best is not None else None
        return found if found is not None and able(found) else None

    def _in_place(self, beside: Pair, found: Sequence[Proposal], known: Proposal | None) -> list[Proposal]:
        """What takes as much as could stand in the place of what is known there, best first, everything moved to where it
        then belongs: what stands beside them suits the known one.
        """
        settings = self.proposer.bench.settings
        least = settings.substitutes * known.takes if known is not None else settings.least_share
        able = [one for one in found if one.takes >= least]
        if known is not None:
            able = [one for one in able if one.score > known.score + CLEARLY or not same_kind(one.effect, known.effect)]
        best = sorted(able, key=lambda one: -one.score)[:IN_PLACE]
        settled = side_by_side(lambda one: self._settled(beside, one), best)
        return [one for one in settled if one is not None]

    def _simpler(self, beside: State, one: PlacedEffect) -> list[Proposal]:
        """An effect as each kind that has all its parameters but some."""
        there = {each.effect.name for each in beside.effects if each.axis == one.axis}
        kinds = [kind for kind in self.proposer.kinds[one.axis] if kind.name not in there]
        found = [self.proposer.evaluated(beside, Begun(one.axis, each, 0.0, 1)) for each in reduced(one.effect, kinds)]
        return [each for each in found if each is not None]

    def _settled(self, beside: Pair, one: Proposal) -> Proposal | None:
        """A proposal with its set settled, and less what that has made needless; None where that makes no mechanism."""
        try:
            state = beside.settled((*beside.whole.effects, one.effect), BRIEF, that_moves(one.effect))
        except UserError:
            return None
        return replace(one, settled=self._leaner(state, one.effect))

    def _leaner(self, state: State, new: PlacedEffect) -> State:
        """Without effects of an axis that say no more than they cost beside a new one, as everything stands."""
        for one in state.effects:
            if one.axis != new.axis or same_kind(one, new):
                continue
            try:
                less = state.of([each for each in state.effects if each is not one])
            except UserError:
                continue
            if less.reached + log(self.proposer.tried(one.axis)) > state.reached and not less.leaves_more_than(state):
                return self._leaner(less, new)
        return state

    def _rated(self, one: Proposal) -> float:
        """Log evidence of its set, settled, less what it costs that so many effects were tried [nats]."""
        assert one.settled is not None
        return self.proposer.rated(one.settled) + one.prior + one.rare + log(self.proposer.tried(one.effect.axis))


def _what_acts_on(axis: str, state: State) -> tuple[PlacedEffect, ...]:
    """The effects of an axis, and bodies of any."""
    return tuple(one for one in state.effects if one.axis == axis or isinstance(one.effect, ModelEffect))


def _largest_first(state: State) -> list[PlacedEffect]:
    """The effects of a set by the energy of their torque on their axis, as a share of the energy of its gap."""

    def share(number: int) -> float:
        one = state.effects[number]
        torque = state.felts[number].cost.get(one.axis)
        return 0.0 if torque is None else float(torque @ torque) / max(state.rows.gap_energy[one.axis], 1e-300)

    return [state.effects[number] for number in sorted(range(len(state.effects)), key=lambda number: -share(number))]


def _most_alike(state: State, one: PlacedEffect) -> list[PlacedEffect]:
    """Other effects of its axis whose torque is like that of one of a set, most like it first.

    What yields is sought again elsewhere (`restart.py`): it takes its time.
    """
    felts = [(each, felt) for each, felt in zip(state.effects, state.felts, strict=True) if each.axis == one.axis]
    costs = [(each, felt.cost[one.axis]) for each, felt in felts if isinstance(each.effect, AxisEffect)]
    own = next((torque for each, torque in costs if each is one), np.zeros(state.rows.count(one.axis)))
    others = [(_cosine(own, torque), each) for each, torque in costs if each is not one and not yields(type(each.effect))]
    able = sorted((each for each in others if each[0] > ALIKE), key=lambda each: -each[0])
    return [other for _, other in able[:MOST_ALIKE]]


def _cosine(one: Array, other: Array) -> float:
    """Between two torques (N,), without its sign; 0 where one is none."""
    sizes = float(np.linalg.norm(one) * np.linalg.norm(other))
    return abs(float(one @ other)) / sizes if sizes > 0.0 else 0.0


def _as_one(one: PlacedEffect, other: PlacedEffect) -> list[Effect]:
    """An effect as the kind of a simpler one on its axis: as it stands, and with each parameter as the other has it."""
    if one.axis != other.axis:
        return []
    names = [each.name for each in other.effect.parameters]
    return [
        begun
        for each in reduced(one.effect, [type(other.effect)])
        for begun in (each, *(replace(each, **{name: getattr(other.effect, name)}) for name in names))
    ]


def _too_small(family: Family, state: State) -> bool:
    """Whether an effect that errors of the comparison look like explains no more than these, all nominal parameters free; or
    one that its own axis has to feel explains nothing there.
    """
    one = family.chosen
    if one is None or not (one.effect.like_errors or one.effect.felt_at_home):
        return False
    left, without = (each.energy(each.held())[one.axis] for each in (state, family.state))
    return without - left < (state.bench.least(one) if one.effect.like_errors else state.bench.settings.least_share)
