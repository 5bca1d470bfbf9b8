"""What may be added to a set of effects: the best of each effect on each axis, and what the set gains by it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log

import numpy as np

from drivetwin.diagnosis.model.solve import Fit
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.rigid import rigid_starts
from drivetwin.diagnosis.propose.search import BRIEFLY, ONE_STEP, REFINED, REFINED_REPLAYS, Begun, coarse, moved
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.bench import Bench
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import CLEARLY, Proposal
from drivetwin.diagnosis.weigh.state import NEARBY, State
from drivetwin.diagnosis.weigh.yielding import yields
from drivetwin.emulator.effects import AxisEffect, Effect, FrictionEffect, ModelEffect, PlacedEffect
from drivetwin.emulator.effects.delay import Delay
from drivetwin.foundation.errors import UserError

Kinds = Mapping[str, Sequence[type[Effect]]]
"""Effects that can be asked for, by axis."""

STEPPED = 16
"""Starts of a motion that is replayed, the best as they stand, that go one step down their valley: after it the best was of the
first six, wherever any gained something."""
HOPELESS = 1.0
"""Nats that a start must gain with its size free, to be moved at all. One whose size is not free may lie beside its valley, and
so may friction under what yields: that is moved from what is known of it."""


@dataclass(frozen=True)
class Proposer:
    """Of a bench; `part` is the same with fewer rows, on which starts are compared and moved."""

    bench: Bench
    part: Bench
    kinds: Kinds
    askew: Mapping[str, frozenset[str]]
    """Effects that the model speaks against, by axis: rare ones."""
    veiled: Kinds = field(default_factory=dict)
    """Effects that an axis cannot be asked for, because its recordings lack what sets them apart from others."""
    _best: dict[tuple[str, str], Effect] = field(init=False, default_factory=dict)
    """What each effect on each axis was when it was last asked for: a start for the next time."""
    _tried: dict[tuple[str, str], int] = field(init=False, default_factory=dict)

    def tried(self, axis: str) -> int:
        """Kinds of effects that could have been named on an axis."""
        return max(len(self.kinds[axis]), 1)

    def briefly(self) -> Proposer:
        """The same on the part alone, of effects of one axis that no motion is replayed for: they take little of the time."""
        kinds = {
            axis: [kind for kind in kinds if not yields(kind) and not issubclass(kind, ModelEffect)]
            for axis, kinds in self.kinds.items()
        }
        return replace(self, bench=self.part, kinds=kinds)

    def rated(self, state: State) -> float:
        """Log evidence of a set, less what it costs that each of its effects is one of many that were tried [nats]."""
        return state.reached - sum(log(self.tried(one.axis)) for one in state.effects)

    def further(self, pair: Pair, axes: Sequence[str]) -> list[Proposal]:
        """The best of every effect on some axes that a set may lack: where it leaves no more than what the comparison errs by,
        only of those that other axes feel as well."""
        done = pair.whole.within_error
        asked = [(axis, kind) for axis in axes for kind in self.kinds[axis]]
        return self._best_of(pair, [one for one in asked if one[0] not in done or issubclass(one[1], ModelEffect)])

    def proposals(self, pair: Pair, axes: Sequence[str] | None = None, only: Collection[str] | None = None) -> list[Proposal]:
        """The best of every effect on every axis, given a set; `only`: of those that yield, by name, for they take the time."""
        asked = [(axis, kind) for axis in (axes if axes is not None else list(self.kinds)) for kind in self.kinds[axis]]
        return self._best_of(pair, _restricted(asked, only))

    def instead(self, pair: Pair, one: PlacedEffect, only: Collection[str] | None = None) -> list[Proposal]:
        """The best of every effect on its axis in the place of one, given the set without it; `only`: as in `proposals`."""
        return self._best_of(pair, _restricted([(one.axis, kind) for kind in self.kinds[one.axis]], only), one)

    def _best_of(
        self, pair: Pair, asked: Sequence[tuple[str, type[Effect]]], instead: PlacedEffect | None = None
    ) -> list[Proposal]:
        """The best of each effect on its axis, of those that a set may have; `instead` of what stood there."""
        taken = {(one.effect.name, one.axis) for one in pair.whole.effects}
        asked = [(axis, kind) for axis, kind in asked if kind.several or (kind.name, axis) not in taken]
        asked = [(axis, kind) for axis, kind in asked if kind is not Delay or pair.whole.late.get(axis, 0.0) == 0.0]

        def proposed(axis: str, kind: type[Effect]) -> Proposal | None:
            known = self._best.get((axis, kind.name))
            if instead is not None:
                known = _like(pair.part, instead, kind) or known
                known = known if known is None or self._may_stand(pair.part, axis, kind, known) else None
            return self._proposed(pair, axis, kind, known)

        found = side_by_side(lambda one: proposed(*one), asked, lambda one: yields(one[1]))
        for one in found:
            if one is not None:
                self._best[one.effect.axis, one.effect.effect.name] = one.effect.effect
        return [one for one in found if one is not None]

    def veiled_ones(self, pair: Pair, axis: str) -> list[Proposal]:
        """The best of every effect that what is named on an axis may be, though its recordings cannot be asked for it."""
        found = self._best_of(pair, [(axis, kind) for kind in self.veiled.get(axis, ())])
        return [replace(one, only_listed=True) for one in found]

    def afresh(self, pair: Pair, axis: str, kind: type[Effect]) -> Proposal | None:
        """The best of an effect from all its starts, beside a set that has changed since they were compared."""
        return self._proposed(pair, axis, kind, None)

    def again(self, proposals: Sequence[Proposal], state: State) -> list[Proposal]:
        """Proposals on axes where nothing has changed, as they stand beside the set that is there now."""
        begun = [Begun(one.effect.axis, one.effect.effect, 0.0, one.tried) for one in proposals]
        found = side_by_side(lambda one: self.evaluated(state, one), begun)
        return [one for one in found if one is not None]

    def _may_stand(self, state: State, axis: str, kind: type[Effect], known: Effect) -> bool:
        """Whether none of its starts is better as it is than what is known of an effect that yields: that was found beside
        what now makes room, in a valley that need not be the deepest any more.
        """
        if not yields(kind):
            return True
        assert issubclass(kind, AxisEffect)
        try:
            starts = coarse(state.bench.beginnings(axis, kind, state.dynamics[axis]), state.frugal, state.held(kind.name, axis))
        except UserError:
            return True
        return not starts or starts[0].evidence <= state.evidence_with(axis, known) + CLEARLY

    def _proposed(self, pair: Pair, axis: str, kind: type[Effect], known: Effect | None) -> Proposal | None:
        """Sought on a part of the rows, from what is `known` of it too, judged on all, moved on there if it gains anything."""
        held = pair.part.held(kind.name, axis)
        begun = self._begun(pair.part, axis, kind, held, known)
        tried = [self._moved(pair.part, one, held) for one in begun]
        whole = [
            replace(one, effect=natural, tried=1)
            for one in tried
            if (natural := one.effect.natural(pair.part.dynamics[axis])) is not None
        ]
        tried += [self._moved(pair.part, one, held, BRIEFLY) for one in whole]
        if yields(kind):  # replays take the time: the likeliest that makes a mechanism is enough
            tried.sort(key=lambda one: -self._standing(pair.whole, one, held))
        judged = ((able, one) for one in tried if (able := self.evaluated(pair.whole, one)) is not None)
        found = next(judged, None) if yields(kind) else max(judged, key=lambda each: each[0].score, default=None)
        if found is None:
            return None
        best, one = found
        if self.part is self.bench or best.score < -CLEARLY:
            return best
        again = self._moved(pair.whole, replace(one, effect=best.effect.effect), held, BRIEFLY)
        return max(best, self.evaluated(pair.whole, again) or best, key=lambda each: each.score)

    def _standing(self, state: State, one: Begun, held: frozenset[int]) -> float:
        """Log evidence of a set with an effect where it is, less what its parameters cost [nats]."""
        try:
            less = state.system.whiten(state.predictor(one.axis)(one.effect))
        except UserError:
            return -np.inf
        independent = sum(own.colour.independent for own in state.axes.values())
        cost = 0.5 * len(state.fields(one.axis, one.effect)) * log(independent)
        found = state.system.fit_tuned((), less, held).evidence - cost + self._prior(state, one)
        return found if np.isfinite(found) else -np.inf

    def _prior(self, state: State, one: Begun) -> float:
        """Log probability of an effect, one of the kinds and starts that are tried [nats]: some are rare."""
        askew = log(self.bench.settings.askew) if one.effect.name in self.askew.get(one.axis, ()) else 0.0
        return askew - log(self.tried(one.axis)) - log(max(one.tried, 1)) - _rare(state, one)

    def _begun(self, state: State, axis: str, kind: type[Effect], held: frozenset[int], known: Effect | None) -> list[Begun]:
        """Where the local search begins: what is `known` of an effect, and the best starts."""
        begun = self._starts(state, axis, kind, held, known)
        if begun and known is not None and not kind.several:
            begun = [replace(begun[0], effect=known), *(one for one in begun if one.effect != known)]
        return begun[:REFINED]

    def _starts(self, state: State, axis: str, kind: type[Effect], held: frozenset[int], known: Effect | None) -> list[Begun]:
        """The starts of an effect, best first. Of those that have to be replayed one by one, the `known` one is enough."""
        try:
            if issubclass(kind, ModelEffect):
                told = state.bench.polynomials.get((axis, kind.name))
                return rigid_starts(state.frugal, axis, told, held) if told is not None else []
            assert issubclass(kind, AxisEffect)
            if known is not None and not kind.scales:
                return [Begun(axis, known, 0.0, self._tried[axis, kind.name])]
            begin = state.bench.beginnings(axis, kind, state.dynamics[axis])
            begun = coarse(begin, state.frugal, held)
        except UserError:
            return []
        if kind.scales and (not begun or begun[0].evidence - state.frugal_fit.evidence < HOPELESS):
            if known is None or not state.bends(axis, known):
                return []
            return [Begun(axis, known, 0.0, len(begin.starts))]
        if begun and not kind.scales:
            self._tried[axis, kind.name] = begun[0].tried
            begun = self._stepped(state, begun[:STEPPED], held)
            briefly = [self._moved(state, one, held, BRIEFLY) for one in begun[:REFINED_REPLAYS]]
            rated = [(each, self.evaluated(state, each)) for each in briefly]
            begun = [each for each, one in sorted(rated, key=lambda pair: -(pair[1].score if pair[1] else -np.inf))]
        return begun

    def _stepped(self, state: State, begun: Sequence[Begun], held: frozenset[int]) -> list[Begun]:
        """Each start one step down its own valley, best first: before that its damping decides as much as how it yields."""

        def step(one: Begun) -> Begun:
            ahead = self._moved(state, one, held, ONE_STEP)
            ahead = replace(ahead, evidence=state.evidence_with(one.axis, ahead.effect))
            return max(one, ahead, key=lambda each: each.evidence)

        return sorted(side_by_side(step, begun), key=lambda one: -one.evidence)

    def _moved(self, state: State, one: Begun, held: frozenset[int], evaluations: int | None = None) -> Begun:
        predict = state.predictor(one.axis)
        more = () if evaluations is None else (evaluations,)
        fields = state.fields(one.axis, one.effect)
        effect = moved(state.frugal, state.frugal_fit, one.effect, fields, predict, held, *more)
        return replace(one, effect=effect)

    def evaluated(self, state: State, one: Begun, free: int | None = None, *, in_set: bool = False) -> Proposal | None:
        """What a set gains by an effect; None if it makes no mechanism, as it stands or with the friction that its fit leaves,
        if it costs nothing, or if it is another axis's effect.

        `free`: how many of its parameters are, the first ones; all, if not told. `in_set`: the effect was already in the
        set, as a mechanism. The friction that one linear step leaves is then not checked.
        """
        try:
            felt = state.felt(one.axis, one.effect)
            state.rows.simulation.dynamics((*state.effects, placed(state.rows, one.axis, one.effect)))
        except UserError:
            return None
        tangents = felt.tangents[:free]
        if not all(np.isfinite(rows).all() for column in (felt.added, *tangents) for rows in column.values()):
            return None
        less, tangent = state.system.whiten(felt.added), [state.system.whiten(each) for each in tangents]
        held = state.held(one.effect.name, one.axis)
        fit = state.system.fit_tuned(tangent, less, held, NEARBY)
        if not in_set and not self._suits(state, one, fit):
            return None
        left = state.energy(state.patched, tangents, felt.added)
        taken = {axis: state.left[axis] - left[axis] for axis in felt.added}
        if one.effect.felt_at_home and taken.get(one.axis, 0.0) < self.bench.settings.least_share:
            return None
        gain = fit.evidence - state.fit.evidence
        prior = self._prior(state, one)
        effect = placed(state.rows, one.axis, one.effect)
        return Proposal(effect, gain + prior, prior, taken, less, tangent, held, one.tried, rare=_rare(state, one))

    def _suits(self, state: State, one: Begun, fit: Fit) -> bool:
        """Whether an effect on an axis makes a mechanism with what its fit makes of the model's friction there.

        What varies by more than the level that is left pushes. The level then has to be named first, and bounds the other.
        Where another effect of the set pushes, this one is not to blame: it would be refused though it stands in the set.
        """
        lower = [
            PlacedEffect(one.axis, effect, {})
            for number, each in enumerate(state.bench.nominals)
            if each.axis == one.axis and each.told and self._is_lower(fit, number)
            if isinstance(effect := each.off_by(float(fit.coefficients[number])), FrictionEffect)
        ]
        there = (*lower, *state.effects)
        whole = (*there, PlacedEffect(one.axis, one.effect, {}))
        return not lower or self._makes_mechanism(one.axis, whole) or not self._makes_mechanism(one.axis, there)

    def _makes_mechanism(self, axis: str, effects: Sequence[PlacedEffect]) -> bool:
        try:
            self.bench.rows.simulation.dynamics_of(axis, effects)
        except UserError:
            return False
        return True

    def _is_lower(self, fit: Fit, number: int) -> bool:
        amount, deviation = fit.coefficients[number], np.sqrt(max(fit.covariance[number, number], 0.0))
        return bool(amount < -self.bench.settings.off * deviation < 0.0)


def _rare(state: State, one: Begun) -> float:
    """How rare an effect is as it stands [nats], on top of a set."""
    return one.effect.unlikely(state.rows.motion[one.axis], state.dynamics[one.axis])


def _restricted(asked: Sequence[tuple[str, type[Effect]]], only: Collection[str] | None) -> list[tuple[str, type[Effect]]]:
    """Kinds on axes; of those that yield only the named ones, unless that is None."""
    return [one for one in asked if only is None or not yields(one[1]) or one[1].name in only]


def _like(state: State, one: PlacedEffect, kind: type[Effect]) -> Effect | None:
    """A friction on one's axis that costs most nearly what that one does, where there is something that yields; else None.

    Friction under what yields acts by its level, so that what a small one gains tells nothing of a large one.
    """
    able = issubclass(kind, FrictionEffect) and kind.scales and not kind.several
    able = able and isinstance(one.effect, AxisEffect) and one.effect.scales
    if not able or not any(each.axis == one.axis and yields(type(each.effect)) for each in state.effects):
        return None
    assert issubclass(kind, AxisEffect)
    try:
        begin = state.bench.beginnings(one.axis, kind, state.dynamics[one.axis])
        torque = state.felt(one.axis, one.effect).cost[one.axis]
    except UserError:
        return None
    if not np.isfinite(torque).all():
        return None
    found = []
    for start, costs in zip(begin.starts, begin.costs, strict=True):
        columns = np.column_stack([cost[one.axis] for cost in costs])
        if np.isfinite(columns).all() and state.bends(one.axis, start.members[0]):
            sizes, *_ = np.linalg.lstsq(columns, torque)
            effect = start.compose([float(size) for size in sizes])
            found += [(float(np.linalg.norm(torque - columns @ sizes)), effect)] if effect is not None else []
    return min(found, key=lambda each: each[0])[1] if found else None
