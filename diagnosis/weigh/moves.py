"""The search over sets of effects: adding, dropping and exchanging are equal moves, judged by one evidence."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.deflection import is_torque
from drivetwin.diagnosis.propose.placing import alike, placed
from drivetwin.diagnosis.propose.rigid import rigid_starts
from drivetwin.diagnosis.propose.search import BRIEFLY, ONE_STEP, REFINED, REFINED_REPLAYS, Begun, coarse, moved
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.bench import Bench
from drivetwin.diagnosis.weigh.colouring import coloured, read_anew
from drivetwin.diagnosis.weigh.proposal import Family, Found, Proposal, largest, makes_sense, rivals_of, same_kind
from drivetwin.diagnosis.weigh.state import NEARBY, State, first_colours, state_of
from drivetwin.diagnosis.weigh.yielding import best_together, level_that_yields, reduced, settled_on, simpler, yields
from drivetwin.emulator.effects import AxisEffect, Effect, ModelEffect, PlacedEffect
from drivetwin.emulator.effects.base import Look
from drivetwin.emulator.effects.delay import Delay
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]
Kinds = Mapping[str, Sequence[type[Effect]]]
"""Effects that can be asked for, by axis."""
Progress = Callable[[str, float], None]

SETTLED = 20
"""Gauss-Newton steps at most, with which all parameters move together to where the evidence gains no more."""
HOPELESS = 1.0
"""Nats that a start must gain with its size free, to be moved at all. One whose size is not free may lie beside its valley."""
CLEARLY = 0.5
"""Nats by which another effect must be better to take a place."""
TOGETHER = 5
"""Proposals of an axis, the best, that are tried two at a time."""
IN_PLACE = 3
"""Proposals, the best of those that take as much, that are settled in the place of an effect."""
BRIEF = 5
"""Steps at most of those: the best goes on, and what is still on its way is worse."""
EXCHANGES = 3
"""Rounds of exchanges, each of which may change every effect once."""


@dataclass(frozen=True)
class Search:
    """A search on a bench; `part` is the same with fewer rows, on which starts are compared and moved."""

    bench: Bench
    part: Bench
    kinds: Kinds
    askew: Mapping[str, frozenset[str]]
    """Effects that the model speaks against, by axis: rare ones."""
    progress: Progress
    _best: dict[tuple[str, str], Effect] = field(init=False, default_factory=dict)
    """What each effect on each axis was when it was last asked for: a start for the next time."""
    _tried: dict[tuple[str, str], int] = field(init=False, default_factory=dict)
    _rivals: dict[tuple[str, str], frozenset[str]] = field(init=False, default_factory=dict)
    """What else gained a good part of what each effect gained when it was added."""
    _families: dict[tuple[tuple[tuple[str, Effect], ...], Effect], Family] = field(init=False, default_factory=dict)
    """What could stand in the place of an effect beside what acts on its axis: asked again where that has changed."""

    def run(self) -> Found:
        """The set of effects that explains the recordings best."""
        effects: tuple[PlacedEffect, ...] = ()
        self.progress("every effect on every axis", 0.1)
        first = Pair(*(state_of(bench, effects, first_colours(bench), {}) for bench in (self.bench, self.part)))
        proposals: Sequence[Proposal] = self.proposals(first)
        pair = self.pair(first.whole, proposals)
        done: set[tuple[tuple[str, str], ...]] = set()
        for _ in range(EXCHANGES):
            pair, proposals = self.added(pair)
            pair, families, changed = self.exchanged(pair, proposals)
            if not changed or _names(pair.whole) in done:
                break
            done.add(_names(pair.whole))
        last = self.proposals(pair) if changed else self.again(proposals, pair.whole)
        return Found(pair.whole, families, last)

    def corrected(self, state: State) -> tuple[State, list[Family]]:
        """Nominal parameters of axes that are off by more than chance and by enough to matter, as effects of their own."""
        families: list[Family] = []
        for number, one in enumerate(self.bench.nominals):
            effect = one.off_by(float(state.fit.coefficients[number]))
            if effect is None or one.axis is None or not self._is_off(state, number):
                continue
            if type(effect) not in self.kinds.get(one.axis, ()):
                continue
            family = self._instead(state.holding(number), one.axis, effect)
            if family is None:
                continue
            assert family.chosen is not None
            try:
                later = state.of(_with(state.effects, family.chosen, one.value))
            except UserError:
                continue
            families.append(family)
            state = settled_on(later, SETTLED)
        return state, families

    def _instead(self, exact: State, axis: str, effect: Effect) -> Family | None:
        """A nominal parameter that is off, beside a set that has it as the model does, and all that could be so instead.

        Only its size is open: a body that is heavier has its place.
        """
        known = self.evaluated(exact, Begun(axis, effect, 0.0, 1), 1)
        if known is None:
            return None
        others = [one for one in self.proposals(Pair(exact, exact), [axis], ()) if not same_kind(one.effect, known.effect)]
        best = max(others, key=lambda one: one.score, default=known)
        return Family(best.effect if best.score > known.score + CLEARLY else known.effect, exact, [known, *others])

    def further(self, found: Found, state: State) -> Family:
        """What else could be added to the set that is left of what was found; what was given up of that is no news."""
        asked = {(one.chosen.effect.name, one.chosen.axis) for one in found.families if one.chosen is not None}
        open_ones = [one for one in found.further if (one.effect.effect.name, one.effect.axis) not in asked]
        return Family(None, state, self.again(open_ones, state))

    def heavier(self, state: State) -> frozenset[int]:
        """Bodies, by number, whose mass is off by more than chance and by enough to matter."""
        return frozenset(
            one.body for number, one in enumerate(self.bench.nominals) if one.body is not None and self._is_off(state, number)
        )

    def _is_off(self, state: State, number: int) -> bool:
        held = state.held()
        if number in held:
            return False
        amount, deviation = state.fit.coefficients[number], np.sqrt(max(state.fit.covariance[number, number], 0.0))
        if abs(amount) < self.bench.settings.off * deviation:
            return False
        if not self.bench.nominals[number].told:
            return True
        free = state.energy(state.patched - {number})
        return max(state.left[axis] - free[axis] for axis in free) >= self.bench.settings.least_share

    def added(self, pair: Pair) -> tuple[Pair, Sequence[Proposal]]:
        """The best effect added, and what it makes needless dropped, until nothing more is worth it."""
        most = self.bench.settings.rounds * len(self.bench.rows.axes)
        proposals: Sequence[Proposal] = ()
        known: dict[str, Sequence[Proposal]] = {}
        seen = {_names(pair.whole)}
        while True:
            count = len(pair.whole.effects)
            self.progress(f"{count} effects; every further effect on every axis", 0.1 + 0.5 * count / (count + 3))
            for axis in self.kinds:
                known[axis] = self.again(known[axis], pair.whole) if axis in known else self.proposals(pair, [axis])
            proposals = [one for each in known.values() for one in each]
            best = self.best(proposals, pair.whole)
            if not best or count >= most:
                return pair, proposals
            for one in best:
                self._rivals[one.effect.effect.name, one.effect.axis] = rivals_of(one, proposals)
            newest = [one.effect for one in best]
            ahead = settled_on(pair.whole.of((*pair.whole.effects, *newest)), SETTLED)
            ahead = self.with_yielding_friction(pair.whole, ahead, proposals, {one.axis for one in newest})
            newest = [one for one in ahead.effects if not any(same_kind(one, each) for each in pair.whole.effects)]
            pair = self.dropped(self.pair(ahead, proposals), newest)
            pair = self.yielding(pair, proposals, {one.axis for one in newest if yields(type(one.effect))})
            if (names := _names(pair.whole)) in seen:
                return pair, proposals
            seen.add(names)
            felt = any(isinstance(one.effect, ModelEffect) for one in newest)
            known = {} if felt else {k: v for k, v in known.items() if k not in {one.axis for one in newest}}

    def best(self, proposals: Sequence[Proposal], state: State) -> list[Proposal]:
        """The proposal with the best score, if it gains anything and takes a share of the gap, or the best two together; and
        of other axes what gains as much beside them as it does alone.

        Of two causes on an axis that overlap, one alone takes what is the other's, and is bent by it for good.
        """
        able = [one for one in proposals if one.score > 0.0 and one.takes >= self.bench.settings.least_share]
        by_axis = [self._best_of_axis([one for one in able if one.effect.axis == axis], state) for axis in self.kinds]
        found: list[Proposal] = []
        gained = 0.0
        for score, own in sorted((one for one in by_axis if one[1]), key=lambda one: -one[0]):
            beside = self._of_all(state, [*found, *own]) if found else score
            if beside - gained >= score - CLEARLY:
                found, gained = [*found, *own], beside
        return found

    def _best_of_axis(self, able: Sequence[Proposal], state: State) -> tuple[float, list[Proposal]]:
        """The best of the largest proposals of one axis, or the best two together, one of them large; and their gain [nats]."""
        if not able:
            return -np.inf, []
        best = sorted(largest(able, self.bench.settings.large), key=lambda one: -one.score)[:TOGETHER]
        beside = sorted(able, key=lambda one: -one.score)[:TOGETHER]
        pairs = [[one, two] for k, one in enumerate(best) for two in beside if all(two is not each for each in best[: k + 1])]
        scores = side_by_side(lambda two: self._of_all(state, two), pairs)
        able_pairs = [(score, two) for score, two in zip(scores, pairs, strict=True) if makes_sense(state, two)]
        score, two = max(able_pairs, key=lambda one: one[0], default=(-np.inf, []))
        return (score, two) if score > best[0].score + CLEARLY else (best[0].score, best[:1])

    def _of_all(self, state: State, several: Sequence[Proposal]) -> float:
        """What a set gains by several effects, the torque of each as if the others were not there [nats]."""
        axes = {axis for one in several for axis in one.column}
        column = {axis: np.asarray(sum(one.column[axis] for one in several if axis in one.column)) for axis in axes}
        tangents = [each for one in several for each in one.tangents]
        fit = state.system.fit_tuned(tangents, column, frozenset().union(*(one.held for one in several)), NEARBY)
        return fit.evidence - state.fit.evidence + sum(one.prior for one in several)

    def dropped(self, pair: Pair, newest: Sequence[PlacedEffect]) -> Pair:
        """Without the effects that say no more than they cost, beside the newest."""
        for one in pair.whole.effects:
            if any(same_kind(one, each) for each in newest):
                continue
            less = self._without(pair, one)
            if less is None:
                continue
            if less.whole.fit.evidence + log(self.tried(one.axis)) > pair.whole.fit.evidence:
                return self.dropped(less, newest)
        return pair

    def exchanged(self, pair: Pair, proposals: Sequence[Proposal]) -> tuple[Pair, list[Family], bool]:
        """Each effect again beside the others: nothing in its place, or what could stand there; the better takes it."""
        families, changed = [], False
        pair = Pair(settled_on(pair.whole, SETTLED), pair.part)
        for asked in pair.whole.effects:
            one = next((each for each in pair.whole.effects if alike(each, asked)), None)
            if one is None:
                continue
            beside = _what_acts_on(one.axis, pair.whole), one.effect
            if beside in self._families:
                families.append(self._families[beside])
                continue
            family = self._family(pair, one)
            if family is None:
                continue
            better = self._better(family, pair.whole)
            if better is not None:
                pair, changed = self.pair(better, proposals), True
                continue
            others = [each for each in family.proposals if each.settled is pair.whole or not same_kind(each.effect, one)]
            self._families[beside] = replace(family, proposals=others)
            families.append(self._families[beside])
        return pair, families, changed

    def _family(self, pair: Pair, one: PlacedEffect) -> Family | None:
        """Nothing and all that could stand in an effect's place, everything beside it moved to where it then belongs; None
        where the others make no mechanism without it.
        """
        self.progress(f"what else than {one.effect.name} on {one.axis}", 0.7)
        beside = self._without(pair, one)
        if beside is None:
            return None
        known = self.evaluated(beside.whole, Begun(one.axis, one.effect, 0.0, 1))
        rivals = self._rivals.get((one.effect.name, one.axis))
        others = [*self.proposals(beside, [one.axis], rivals), *self._simpler(beside.whole, one)]
        own = [replace(known, settled=pair.whole)] if known is not None else []
        return Family(one, settled_on(beside.whole, BRIEF), [*own, *self._in_place(beside.whole, others, known)])

    def _better(self, family: Family, state: State) -> State | None:
        """The set without an effect, or with another in its place, where that is better and leaves no more of the gap."""
        known = max((self._rated(one) for one in family.proposals if one.settled is state), default=-np.inf)
        nothing = family.state.reached - self._tried_for(family.state)
        best = max(family.proposals, key=self._rated, default=None)
        if best is not None and best.settled is not None and self._rated(best) > max(known + CLEARLY, nothing):
            better = settled_on(best.settled, SETTLED)
        elif nothing > known:
            better = family.state
        else:
            return None
        return None if _leaves_more(better, state) else better

    def _in_place(self, beside: State, found: Sequence[Proposal], known: Proposal | None) -> list[Proposal]:
        """What takes as much as could stand in the place of what is known there, best first, everything moved to where it
        then belongs: what stands beside them suits the known one.
        """
        settings = self.bench.settings
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
        kinds = [kind for kind in self.kinds[one.axis] if kind.name not in there]
        found = [self.evaluated(beside, Begun(one.axis, each, 0.0, 1)) for each in reduced(one.effect, kinds)]
        return [each for each in found if each is not None]

    def _settled(self, beside: State, one: Proposal) -> Proposal | None:
        """A proposal with its set settled, and less what that has made needless; None where that makes no mechanism."""
        try:
            state = settled_on(beside.of((*beside.effects, one.effect)), BRIEF)
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
            if less.reached + log(self.tried(one.axis)) > state.reached:
                return self._leaner(less, new)
        return state

    def _rated(self, one: Proposal) -> float:
        """Log evidence of its set, settled, less what it costs that so many effects were tried [nats]."""
        assert one.settled is not None
        return one.settled.reached + one.prior - self._tried_for(one.settled) + log(self.tried(one.effect.axis))

    def _tried_for(self, state: State) -> float:
        """What it costs that each effect of a set is one of many [nats]."""
        return sum(log(self.tried(one.axis)) for one in state.effects)

    def _without(self, pair: Pair, one: PlacedEffect) -> Pair | None:
        """The set less one effect, the noise coloured as it was; None where the others make no mechanism without it.

        A late torque looks like what yields: without that it is sought anew.
        """
        rest = [each for each in pair.whole.effects if each is not one]
        try:
            whole = aligned(pair.whole.of(rest))
            return Pair(whole, pair.part.of(rest).read(whole.late))
        except UserError:
            return None

    def with_yielding_friction(
        self, before: State, ahead: State, proposals: Sequence[Proposal], axes: Collection[str]
    ) -> State:
        """A set one step on, or what is better where a level of friction was added: another level, and how it yields."""
        for axis in axes:
            known = {(one.effect.name, one.axis) for one in before.effects}
            added = [one for one in ahead.effects if one.axis == axis and (one.effect.name, axis) not in known]
            kinds = [kind for kind in self.kinds[axis] if yields(kind) and Look.LEVEL in kind.looks]
            kinds = [kind for kind in kinds if (kind.name, axis) not in known]
            if not kinds or not any(Look.LEVEL in type(one.effect).looks for one in added):
                continue
            own = [one for one in proposals if one.effect.axis == axis]
            settings = self.bench.settings
            levels = [one.effect.effect for one in sorted(largest(own, settings.large), key=lambda one: -one.score)]
            levels = [effect for effect in levels if Look.LEVEL in effect.looks and not yields(type(effect))]
            levels = levels[: settings.levels_tried]
            others = [one for one in ahead.effects if all(one is not each for each in added)]
            for kind in kinds:
                found = level_that_yields(ahead.of(others), axis, levels, kind)
                if found is not None and found.reached > ahead.reached + CLEARLY:
                    ahead = found
        return ahead

    def yielding(self, pair: Pair, proposals: Sequence[Proposal], axes: Collection[str]) -> Pair:
        """Where something on one of the axes has begun to yield, what else may yield beside it, both moved together."""
        for axis in axes:
            own = {one.effect.name for one in pair.whole.effects if one.axis == axis and yields(type(one.effect))}
            others = [kind for kind in self.kinds[axis] if yields(kind) and kind.name not in own] if own else []
            found = [one for kind in others if (one := best_together(pair.part, axis, kind)) is not None]
            able = [one for one in found if one.reached > pair.part.reached + log(self.tried(axis))]
            able += [each for one in able for each in simpler(one, axis, others)]
            wholes = [settled_on(pair.whole.of(one.effects), SETTLED) for one in able]
            best = max(wholes, key=lambda one: one.reached, default=None)
            if best is None or best.reached < pair.whole.reached + log(self.tried(axis)) + CLEARLY:
                continue
            newest = [one for one in best.effects if one.axis == axis and type(one.effect) in others]
            pair = self.dropped(self.pair(best, proposals), newest)
        return pair

    def pair(self, found: State, proposals: Sequence[Proposal]) -> Pair:
        """The set's states, the noise coloured as what is left by the set and everything that could be asked beside it."""
        whole = coloured(read_anew(found, proposals), proposals)
        part = state_of(self.part, found.effects, first_colours(self.part), whole.late)
        return Pair(whole, coloured(part, proposals) if self.part is not self.bench else whole)

    def tried(self, axis: str) -> int:
        """Kinds of effects that could have been named on an axis."""
        return max(len(self.kinds[axis]), 1)

    def proposals(self, pair: Pair, axes: Sequence[str] | None = None, only: Collection[str] | None = None) -> list[Proposal]:
        """The best of every effect on every axis, given a set; `only`: of those that yield, by name, for they take the time."""
        asked = [(axis, kind) for axis in (axes if axes is not None else list(self.kinds)) for kind in self.kinds[axis]]
        asked = [(axis, kind) for axis, kind in asked if only is None or not yields(kind) or kind.name in only]
        taken = {(one.effect.name, one.axis) for one in pair.whole.effects}
        asked = [(axis, kind) for axis, kind in asked if kind.several or (kind.name, axis) not in taken]
        asked = [(axis, kind) for axis, kind in asked if kind is not Delay or pair.whole.late.get(axis, 0.0) == 0.0]
        found = side_by_side(lambda one: self._proposed(pair, *one), asked)
        return [one for one in found if one is not None]

    def again(self, proposals: Sequence[Proposal], state: State) -> list[Proposal]:
        """Proposals on axes where nothing has changed, as they stand beside the set that is there now."""
        begun = [Begun(one.effect.axis, one.effect.effect, 0.0, one.tried) for one in proposals]
        found = side_by_side(lambda one: self.evaluated(state, one), begun)
        return [one for one in found if one is not None]

    def _proposed(self, pair: Pair, axis: str, kind: type[Effect]) -> Proposal | None:
        state = pair.part if yields(kind) else pair.whole
        held = state.held(kind.name, axis)
        begun = self._begun(state, axis, kind, held)
        known = self._best.get((axis, kind.name))
        if begun and known is not None and not kind.several:
            begun = [replace(begun[0], effect=known), *begun[: REFINED - 1]]
        tried = [self._moved(state, one, held) for one in begun[:REFINED]]
        whole = [
            replace(one, effect=natural, tried=1)
            for one in tried
            if (natural := one.effect.natural(state.dynamics[axis])) is not None
        ]
        tried += [self._moved(state, one, held, BRIEFLY) for one in whole]
        judged = [self.evaluated(pair.whole, one) for one in tried]
        best = max((one for one in judged if one is not None), key=lambda one: one.score, default=None)
        if best is not None and self.part is not self.bench and yields(kind):
            again = self._moved(pair.whole, replace(tried[judged.index(best)], effect=best.effect.effect), held, BRIEFLY)
            best = max(best, self.evaluated(pair.whole, again) or best, key=lambda one: one.score)
        if best is not None:
            self._best[axis, kind.name] = best.effect.effect
        return best

    def _begun(self, state: State, axis: str, kind: type[Effect], held: frozenset[int]) -> list[Begun]:
        """Where the local search begins. Starts that have to be replayed one by one are compared once, without any effect."""
        try:
            if issubclass(kind, ModelEffect):
                told = state.bench.polynomials.get((axis, kind.name))
                return rigid_starts(state.frugal, axis, told, held) if told is not None else []
            assert issubclass(kind, AxisEffect)
            known = self._best.get((axis, kind.name))
            if known is not None and not kind.scales:
                return [Begun(axis, known, 0.0, self._tried[axis, kind.name])]
            begun = coarse(state.bench.beginnings(axis, kind, state.dynamics[axis]), state.frugal, held)
        except UserError:
            return []
        if begun and kind.scales and begun[0].evidence - state.frugal_fit.evidence < HOPELESS:
            return []
        if begun and not kind.scales:
            self._tried[axis, kind.name] = begun[0].tried
            begun = self._stepped(state, begun, held)
            briefly = [self._moved(state, one, held, BRIEFLY) for one in begun[:REFINED_REPLAYS]]
            rated = [(each, self.evaluated(state, each)) for each in briefly]
            begun = [each for each, one in sorted(rated, key=lambda pair: -(pair[1].score if pair[1] else -np.inf))]
        return begun

    def _stepped(self, state: State, begun: Sequence[Begun], held: frozenset[int]) -> list[Begun]:
        """Each start one step down its own valley, best first: before that its damping decides more than how it yields."""

        def step(one: Begun) -> Begun:
            ahead = self._moved(state, one, held, ONE_STEP)
            try:
                cost = state.system.whiten(state.predictor(one.axis)(ahead.effect))
            except UserError:
                return one
            return max(one, replace(ahead, evidence=state.frugal.fit((), cost, held).evidence), key=lambda each: each.evidence)

        return sorted(side_by_side(step, begun), key=lambda one: -one.evidence)

    def _moved(self, state: State, one: Begun, held: frozenset[int], evaluations: int | None = None) -> Begun:
        predict = state.predictor(one.axis)
        more = () if evaluations is None else (evaluations,)
        fields = state.fields(one.axis, one.effect)
        effect = moved(state.frugal, state.frugal_fit, one.effect, fields, predict, held, *more)
        return replace(one, effect=effect)

    def evaluated(self, state: State, one: Begun, free: int | None = None) -> Proposal | None:
        """What a set gains by an effect; None where it makes no mechanism there, or costs nothing.

        `free`: how many of its parameters are, the first ones; all, if not told.
        """
        try:
            felt = state.felt(one.axis, one.effect)
            state.rows.simulation.dynamics((*state.effects, placed(state.rows, one.axis, one.effect)))
        except UserError:
            return None
        if not all(np.isfinite(rows).all() for rows in felt.added.values()):
            return None
        tangents = felt.tangents[:free]
        less, tangent = state.system.whiten(felt.added), [state.system.whiten(each) for each in tangents]
        held = state.held(one.effect.name, one.axis)
        fit = state.system.fit_tuned(tangent, less, held, NEARBY)
        left = state.energy(state.patched, tangents, felt.added)
        taken = {axis: state.left[axis] - left[axis] for axis in felt.added}
        share = max(part for axis, part in taken.items() if is_torque(axis))
        gain = fit.evidence - state.fit.evidence
        rare = one.effect.unlikely(state.rows.motion[one.axis], state.dynamics[one.axis])
        if one.effect.name in self.askew.get(one.axis, ()):
            rare -= log(self.bench.settings.askew)
        prior = -log(self.tried(one.axis)) - log(max(one.tried, 1)) - rare
        effect, takes = placed(state.rows, one.axis, one.effect), max(taken.values())
        return Proposal(effect, gain + prior, prior, share, takes, less, tangent, held, one.tried)


@dataclass(frozen=True)
class Pair:
    """The same set on all rows, and on a part of them."""

    whole: State
    part: State


def _what_acts_on(axis: str, state: State) -> tuple[tuple[str, Effect], ...]:
    """The effects of an axis, and bodies of any."""
    return tuple((one.axis, one.effect) for one in state.effects if one.axis == axis or isinstance(one.effect, ModelEffect))


def _leaves_more(ahead: State, state: State) -> bool:
    """Whether a set leaves more of an axis's gap than another: noise with long tails has learned what the other explains."""
    return any(left > state.left[axis] + state.bench.settings.least_share for axis, left in ahead.left.items())


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


def _names(state: State) -> tuple[tuple[str, str], ...]:
    return tuple(sorted((one.effect.name, one.axis) for one in state.effects))
