"""The search over sets of effects: adding, dropping and exchanging are equal moves, judged by one evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import log

import numpy as np

from drivetwin.diagnosis.progress import Progress
from drivetwin.diagnosis.propose.placing import Name, name_of
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.exchange import Exchange
from drivetwin.diagnosis.weigh.pair import Pair, empty, that_moves
from drivetwin.diagnosis.weigh.proposal import (
    CLEARLY,
    RIVAL,
    Found,
    Proposal,
    largest,
    makes_sense,
    rivals_of,
    same_kind,
)
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.restart import Restart
from drivetwin.diagnosis.weigh.state import NEARBY, State
from drivetwin.diagnosis.weigh.yielding import best_together, level_that_yields, settled_on, simpler, tried_set, yields
from drivetwin.emulator.effects import ModelEffect, PlacedEffect
from drivetwin.emulator.effects.base import Look

TOGETHER = 5
"""Proposals of an axis, the best, that are tried two at a time."""
EXCHANGES = 3
"""Rounds of exchanges, each of which may change every effect once."""


@dataclass(frozen=True)
class Search:
    """From no effect to the set that explains the recordings best."""

    proposer: Proposer
    progress: Progress
    _rivals: dict[tuple[str, str], frozenset[str]] = field(init=False, default_factory=dict)
    """What else gained a good part of what each effect gained when it was added."""

    def begun(self) -> State:
        """A set that adding alone finds: enough to place recordings by."""
        pair, _ = self.added(self._first())
        return pair.whole

    def _first(self) -> Pair:
        """No effect, the noise as it is where each of them could be."""
        self.progress("every effect on every axis", 0.1)
        pair = empty(self.proposer.bench, self.proposer.part)
        return pair.as_noise_is(pair.whole, self.proposer.further(pair, list(self.proposer.kinds)))

    def run(self) -> Found:
        """The set of effects that explains the recordings best."""
        pair = self._first()
        exchange, restart = Exchange(self.proposer, self._rivals, self.progress), Restart(self.proposer)
        done: set[tuple[Name, ...]] = set()
        for _ in range(EXCHANGES):
            pair, proposals = self.added(pair)
            again = restart.restarted(pair, proposals)
            if again is not pair:
                pair, proposals = self.added(again)
            pair, families, changed = exchange.exchanged(pair, proposals)
            if not changed or _names(pair.whole) in done:
                break
            done.add(_names(pair.whole))
        else:  # what came last in the place of another may call for one more
            pair, _ = self.added(pair)
        last = self.proposer.further(pair, list(self.proposer.kinds)) if changed else self.proposer.again(proposals, pair.whole)
        return Found(pair.whole, exchange.completed(pair) if changed else families, last)

    def added(self, pair: Pair) -> tuple[Pair, Sequence[Proposal]]:
        """The best effect added, and what it makes needless dropped, until nothing more is worth it.

        Not where that leaves more of a gap that it acts on, however likely the noise has it: then, of several, the first alone,
        and the next best. What it leaves of others is no fault of its own: all settle again in noise of another colour.
        """
        most = self.proposer.bench.settings.rounds * len(self.proposer.bench.rows.axes)
        proposals: Sequence[Proposal] = ()
        known: dict[str, Sequence[Proposal]] = {}
        seen = {_names(pair.whole)}
        refused: set[Name] = set()
        partly: frozenset[str] = frozenset()
        while True:
            count = len(pair.whole.effects)
            self.progress(f"{count} effects; every further effect on every axis", 0.1 + 0.5 * count / (count + 3))
            done = pair.whole.within_error
            for axis in self.proposer.kinds:
                again = axis in known and (axis in partly) == (axis in done)
                known[axis] = self.proposer.again(known[axis], pair.whole) if again else self.proposer.further(pair, [axis])
            partly = done
            proposals = [one for each in known.values() for one in each]
            best = self.best([one for one in proposals if name_of(one.effect) not in refused], pair.whole)
            if not best or count >= most:
                return pair, proposals
            ahead = self._with(pair, best, proposals)
            if len(best) > 1 and ahead.whole.leaves_more_than(pair.whole, _acted_on(best)):
                best = best[:1]
                ahead = self._with(pair, best, proposals)
            if ahead.whole.leaves_more_than(pair.whole, _acted_on(best)):
                refused |= {name_of(best[0].effect)}
                continue
            for one in best:
                self._rivals[one.effect.effect.name, one.effect.axis] = rivals_of(one, proposals)
            newest = [one for one in ahead.whole.effects if not any(same_kind(one, each) for each in pair.whole.effects)]
            pair = self.yielding(ahead, proposals, pair.whole.axes_of([one for one in newest if yields(type(one.effect))]))
            refused = set()
            if (names := _names(pair.whole)) in seen:
                return pair, proposals
            seen.add(names)
            felt = any(isinstance(one.effect, ModelEffect) for one in newest)
            known = {} if felt else {k: v for k, v in known.items() if k not in {one.axis for one in newest}}

    def _with(self, pair: Pair, best: Sequence[Proposal], proposals: Sequence[Proposal]) -> Pair:
        """A set one step on, less what that makes needless."""
        ahead = _settled(pair, [one.effect for one in best])
        ahead = self.with_yielding_friction(pair, ahead, proposals, pair.whole.axes_of([one.effect for one in best]))
        newest = [one for one in ahead.effects if not any(same_kind(one, each) for each in pair.whole.effects)]
        return self.dropped(pair.as_noise_is(ahead, proposals), newest)

    def best(self, proposals: Sequence[Proposal], state: State) -> list[Proposal]:
        """The proposal with the best score, if it gains anything and takes a share of the gap, or the best two together; and
        of other axes what gains as much beside them as it does alone.

        Of two causes on an axis that overlap, one alone takes what is the other's, and is bent by it for good. The axis with
        the best single proposal comes first: two that together gain more may imitate it from an axis that only feels it.
        """
        able = [one for one in proposals if one.score > 0.0 and one.takes >= state.bench.least(one.effect)]
        by_axis = [[one for one in able if one.effect.axis == axis] for axis in self.proposer.kinds]
        by_axis = sorted((each for each in by_axis if each), key=lambda each: -max(one.score for one in each))
        found: list[Proposal] = []
        gained = 0.0
        for score, own in (self._best_of_axis(each, state) for each in by_axis):
            beside = self._of_all(state, [*found, *own]) if found else score
            if beside - gained >= score - CLEARLY:
                found, gained = [*found, *own], beside
        return found

    def _best_of_axis(self, able: Sequence[Proposal], state: State) -> tuple[float, list[Proposal]]:
        """The best of the largest proposals of one axis, and its gain [nats]; or the best two together, one of them large.

        These where they gain a good part more: what gains little beside another is found once that is there.
        """
        if not able:
            return -np.inf, []
        best = sorted(largest(able, self.proposer.bench.settings.large), key=lambda one: -one.score)[:TOGETHER]
        beside = sorted(able, key=lambda one: -one.score)[:TOGETHER]
        pairs = [[one, two] for k, one in enumerate(best) for two in beside if all(two is not each for each in best[: k + 1])]
        scores = side_by_side(lambda two: self._of_all(state, two), pairs)
        able_pairs = [(score, two) for score, two in zip(scores, pairs, strict=True) if makes_sense(state, two)]
        score, two = max(able_pairs, key=lambda one: one[0], default=(-np.inf, []))
        alone = best[0].score
        return (score, two) if score > alone + max(CLEARLY, RIVAL * alone) else (alone, best[:1])

    def _of_all(self, state: State, several: Sequence[Proposal]) -> float:
        """What a set gains by several effects, the torque of each as if the others were not there [nats]."""
        axes = dict.fromkeys(axis for one in several for axis in one.column)
        column = {axis: np.asarray(sum(one.column[axis] for one in several if axis in one.column)) for axis in axes}
        tangents = [each for one in several for each in one.tangents]
        fit = state.system.fit_tuned(tangents, column, frozenset().union(*(one.held for one in several)), NEARBY)
        return fit.evidence - state.fit.evidence + sum(one.prior for one in several)

    def dropped(self, pair: Pair, newest: Sequence[PlacedEffect]) -> Pair:
        """Without the effects that say no more than they cost, beside the newest; not where more of a gap is left without one:
        then it is a nominal parameter that takes its place, and no patch has that.
        """
        for one in pair.whole.effects:
            if any(same_kind(one, each) for each in newest):
                continue
            less = pair.without(one)
            if less is None or less.whole.promised + log(self.proposer.tried(one.axis)) <= pair.whole.promised:
                continue
            if not less.whole.leaves_more_than(pair.whole):
                return self.dropped(less, newest)
        return pair

    def with_yielding_friction(self, before: Pair, ahead: State, proposals: Sequence[Proposal], axes: Sequence[str]) -> State:
        """A set one step on, or what is better where a level of friction was added: another level, and how it yields."""
        for axis in axes:
            known = {(one.effect.name, one.axis) for one in before.whole.effects}
            added = [one for one in ahead.effects if one.axis == axis and (one.effect.name, axis) not in known]
            kinds = [kind for kind in self.proposer.kinds[axis] if yields(kind) and Look.LEVEL in kind.looks]
            kinds = [kind for kind in kinds if (kind.name, axis) not in known]
            if not kinds or not any(Look.LEVEL in type(one.effect).looks for one in added):
                continue
            own = [one for one in proposals if one.effect.axis == axis]
            settings = self.proposer.bench.settings
            levels = [one.effect.effect for one in sorted(largest(own, settings.large), key=lambda one: -one.score)]
            levels = [effect for effect in levels if Look.LEVEL in effect.looks and not yields(type(effect))]
            levels = levels[: settings.levels_tried]
            others = [one for one in ahead.effects if all(one is not each for each in added)]
            beside = tried_set(before.part, others) or before.part  # where the others have moved to what needs the new ones
            for kind in kinds:
                begun = level_that_yields(beside, axis, levels, kind)
                whole = tried_set(before.whole, begun.effects) if begun is not None else None
                found = settled_on(whole, axis=axis) if whole is not None else None
                if found is not None and found.reached > ahead.reached + CLEARLY:
                    ahead = found
        return ahead

    def yielding(self, pair: Pair, proposals: Sequence[Proposal], axes: Sequence[str]) -> Pair:
        """Where something on one of the axes has begun to yield, what else may yield beside it, both moved together."""
        for axis in axes:
            own = {one.effect.name for one in pair.whole.effects if one.axis == axis and yields(type(one.effect))}
            others = [kind for kind in self.proposer.kinds[axis] if yields(kind) and kind.name not in own] if own else []
            found = [one for kind in others if (one := best_together(pair.part, axis, kind)) is not None]
            able = [one for one in found if one.reached > pair.part.reached + log(self.proposer.tried(axis))]
            able += [each for one in able for each in simpler(one, axis, others)]
            wholes = [settled_on(pair.whole.of(one.effects), axis=axis) for one in able]
            best = max(wholes, key=lambda one: one.reached, default=None)
            if best is None or best.reached < pair.whole.reached + log(self.proposer.tried(axis)) + CLEARLY:
                continue
            newest = [one for one in best.effects if one.axis == axis and type(one.effect) in others]
            pair = self.dropped(pair.as_noise_is(best, proposals), newest)
        return pair


def _settled(pair: Pair, added: Sequence[PlacedEffect]) -> State:
    """A set and some effects more, settled on the axes where these move something: all others settle before an exchange."""
    effects = [*pair.whole.effects, *added]
    axes = dict.fromkeys(that_moves(one) for one in added)
    if None in axes:
        return pair.settled(effects)
    state = pair.whole
    for axis in axes:
        state = pair.settled(effects, axis=axis)
        effects = list(state.effects)
    return state


def _acted_on(best: Sequence[Proposal]) -> set[str]:
    """The rows on which some effects act."""
    return {name for one in best for name, rows in one.column.items() if rows.any()}


def _names(state: State) -> tuple[Name, ...]:
    return tuple(sorted(name_of(one) for one in state.effects))
