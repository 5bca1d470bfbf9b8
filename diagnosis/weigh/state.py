"""A set of effects as the model in which everything further is tried: its parameters free about where they are."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import log

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.axis_system import AxisSystem
from drivetwin.diagnosis.model.colour import Colour
from drivetwin.diagnosis.model.solve import Fit
from drivetwin.diagnosis.model.system import System, system_of
from drivetwin.diagnosis.prepare.deflection import axis_of
from drivetwin.diagnosis.prepare.rows import Column, Rows
from drivetwin.diagnosis.propose.nominal import Nominal
from drivetwin.diagnosis.propose.placing import in_order, name_of
from drivetwin.diagnosis.propose.search import Field, Predict, movable_fields
from drivetwin.diagnosis.weigh.bench import Bench, Felt, Later
from drivetwin.diagnosis.weigh.explained import colour_in, explained, plain_axis
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import AxisEffect, Effect, FrictionEffect, PartEffect, PlacedEffect
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

FARTHEST = 1.0
"""Steps that matter to a parameter, by which it is moved at most at once: a linear fit holds near by."""
NEARBY = 1.0 / FARTHEST**2
"""Of a tangent, the inverse square of the same: what only a parameter farther away explains is no evidence for this one."""
LATEST = 0.03
"""By which a torque is recorded at most after its motion [s]: filters and buses of drives, a low-pass of 5 Hz. No more than
what is left out at the ends of a recording at 48 Hz."""
APART = 3.0
"""Deviations by which two readings of a row may be apart in time where energy that is left is told."""
REMEMBERED = 3
"""Systems of an axis that are remembered: of what stands there, and of the last trials."""
WHITENED, FELT = 128, 64
"""Columns that are remembered, whitened, and nominal parameters as a set bends them."""


@dataclass(frozen=True)
class State:
    """A set of effects, in the order in which torque passes them, and the system of equations about it.

    The slopes of its effects take most of the time. A set that is only compared with others where it stands is not asked for
    them.
    """

    bench: Bench
    effects: tuple[PlacedEffect, ...]
    felts: tuple[Felt, ...]
    """Each effect on top of those before it."""
    axes: Mapping[str, AxisSystem]
    target: Mapping[str, Array]
    """Torque that the effects leave, as it is felt [N·m or N]."""
    late: Mapping[str, float]
    """By how much the torque of each axis is read earlier [s]: it was recorded after the motion that needed it."""
    exact: frozenset[int] = frozenset()
    """Nominal parameters, by number, that are as the model has them."""

    def of(self, effects: Sequence[PlacedEffect]) -> State:
        """Another set, the noise coloured and the torque read as in this one. Raises UserError where it makes no mechanism."""
        return state_of(self.bench, effects, self.axes, self.late, self.exact)

    def holding(self, number: int) -> State:
        """The same set, one nominal parameter as the model has it."""
        return state_of(self.bench, self.effects, self.axes, self.late, self.exact | {number})

    def recorded_late(self) -> dict[str, float]:
        """By how much the torque of each axis was recorded late [s], of those too whose torque is read as recorded, where it is
        more than chance.

        A motion that is slow leaves no more of the gap for it. What the drive's loops asked for shows every part of a
        millisecond.
        """
        found = {}
        for axis in self.rows.axes:
            number, late = self.bench.timing(axis), self.late.get(axis, 0.0)
            moved, deviation = self.fit.coefficients[number], np.sqrt(max(self.fit.covariance[number, number], 0.0))
            if late > 0.0 or abs(moved) > self.bench.settings.off * deviation:
                found[axis] = min(max(0.0, late - float(moved)), LATEST)
        return found

    def apart(self) -> dict[str, float]:
        """By how much torque and position of a sample differ in time [s], of every axis whose torque is not read earlier."""
        told = [axis for axis in self.rows.axes if self.late.get(axis, 0.0) == 0.0]
        return {axis: abs(float(self.fit.coefficients[self.bench.timing(axis)])) for axis in told}

    def read(self, late: Mapping[str, float]) -> State:
        """The same set, the torque of each axis read otherwise [s]."""
        return state_of(self.bench, self.effects, self.axes, late, self.exact)

    def axes_of(self, effects: Sequence[PlacedEffect]) -> list[str]:
        """The axes of some effects, each once, in the recordings' order: what is done on one depends on those before it."""
        there = {one.axis for one in effects}
        return [axis for axis in self.rows.axes if axis in there]

    @property
    def rows(self) -> Rows:
        """What is compared."""
        return self.bench.rows

    @cached_property
    def bare(self) -> System:
        """The system of the nominal parameters alone."""
        columns = self._whitened(self.nominal_columns)
        spreads = np.array([one.spread for one in self.bench.nominals])
        return system_of(self.axes, columns, spreads, self.bench.settings.nominal_freedom, known=self.bench.products)

    @cached_property
    def nominal_columns(self) -> Sequence[Column]:
        """What a unit of each nominal parameter costs in the set [N·m or N]."""
        return [self._in_the_set(one) for one in self.bench.nominals]

    def _in_the_set(self, one: Nominal) -> Column:
        """A friction gives way and warms as the set has it; what the model says nothing of, and what the set has, does not."""
        effect = one.off_by(one.spread) if one.told else None
        taken = any((each.effect.name, each.axis) == (one.effect, one.axis) for each in self.effects)
        if one.axis is None or not isinstance(effect, FrictionEffect) or taken:
            return one.column
        with suppress(UserError):
            if self._place(one.axis, effect)[1]:
                felt = self.felt(one.axis, effect)
                return self.bench.bent.get((one, felt), lambda: _of_one(felt.added, one.spread), FELT)
        return one.column

    @cached_property
    def owners(self) -> tuple[int, ...]:
        """Which effect each further column is a tangent of, after those of the nominal parameters."""
        return tuple(number for number, felt in enumerate(self.felts) for _ in felt.movable)

    @cached_property
    def columns(self) -> Sequence[Column]:
        """The system's columns, as they are felt [N·m or N]."""
        return [*self.nominal_columns, *(each for felt in self.felts for each in felt.tangents)]

    @cached_property
    def system(self) -> System:
        """Nominal parameters, and the slopes of the effects, with amplitudes of the unknown where the evidence is highest."""
        return self._untuned.tuned(self.held())

    @cached_property
    def _untuned(self) -> System:
        """The same with the unknown as large as it usually is."""
        tangents = np.full(len(self.owners), np.inf)
        near = np.concatenate([np.zeros(len(self.bench.nominals)), np.full(len(self.owners), NEARBY)])
        whitened = [*self.bare.columns, *self._whitened(self.columns[len(self.bench.nominals) :])]
        spreads = np.concatenate([self.bare.spreads, tangents])
        return system_of(self.axes, whitened, spreads, self.bench.settings.nominal_freedom, near, self.bench.products)

    def _whitened(self, columns: Sequence[Column]) -> list[Column]:
        return [{axis: self._white(axis, rows) for axis, rows in column.items()} for column in columns]

    def _white(self, axis: str, rows: Array) -> Array:
        colour = self.axes[axis].colour
        return self.bench.whitened.get((colour, rows), lambda: colour.whiten(rows), WHITENED)

    @cached_property
    def fit(self) -> Fit:
        """Of the set as it stands."""
        return self.system.fit(held=self.held())

    @cached_property
    def standing(self) -> Fit:
        """Of the set with its parameters where they are."""
        return self.bare.fit_tuned((), None, self.held())

    @cached_property
    def reached(self) -> float:
        """Log evidence of that, less how rare the effects are as they stand [nats]; see `promised`."""
        independent = sum(own.colour.independent for own in self.axes.values())
        return self.standing.evidence - 0.5 * len(self.owners) * log(independent) - self.unlikely

    @property
    def promised(self) -> float:
        """The same where a straight line has the parameters: that is not reached yet."""
        return self.fit.evidence - self.unlikely

    @cached_property
    def unlikely(self) -> float:
        """How rare the effects are as they stand [nats], whatever the recordings say."""
        motion = self.rows.motion
        return sum(felt.effect.unlikely(motion[felt.axis], felt.dynamics) for felt in self.felts)

    @property
    def strain(self) -> float:
        """What the set asks of nominal parameters [nats]."""
        return self.system.strain(self.fit)

    def ahead(self, damping: float) -> Fit:
        """Where a straight line has the parameters, held so many times nearer; the unknown as large as it is without moving."""
        system = self._untuned
        return replace(system.at(self.standing.amplitude), near=damping * system.near).fit(held=self.held())

    @cached_property
    def frugal(self) -> System:
        """The set's system with no more of the unknown than usual: what a search begins in. Else that has what is sought."""
        usual = {axis: np.minimum(self.system.amplitude[axis], own.usual) for axis, own in self.system.axes.items()}
        return self.system.at(usual)

    @cached_property
    def frugal_fit(self) -> Fit:
        """Of the set as it stands, with that."""
        return self.frugal.fit(held=self.held())

    def evidence_with(self, axis: str, effect: Effect) -> float:
        """Log evidence of the set with an effect where it is [nats], in `frugal`; -inf where nothing can follow it."""
        try:
            cost = self.system.whiten(self.predictor(axis)(effect))
        except UserError:
            return -np.inf
        found = self.frugal.fit((), cost, self.held(effect.name, axis)).evidence
        return found if np.isfinite(found) else -np.inf

    @cached_property
    def plain(self) -> System:
        """The same without colour and unknown: what energy is left."""
        return self._plain(self.columns, self.system.spreads, self.system.near)

    @cached_property
    def still(self) -> System:
        """`plain` with the effects where they are: nobody has to ask for their slopes."""
        count = len(self.bench.nominals)
        return self._plain(self.nominal_columns, self.bare.spreads, np.zeros(count))

    def _plain(self, columns: Sequence[Column], spreads: Array, near: Array) -> System:
        bench, white = self.bench, self.bench.white
        bare = {
            axis: bench.plain.get((white[axis], target), partial(plain_axis, bench, axis, target), REMEMBERED * len(white))
            for axis, target in self.target.items()
        }
        flat = [
            {
                axis: bench.flat.get((white[axis], torque), partial(white[axis].whiten, torque), WHITENED)
                for axis, torque in column.items()
            }
            for column in columns
        ]
        return system_of(bare, flat, spreads, near=near, known=bench.plain_products)

    @cached_property
    def dynamics(self) -> dict[str, AxisDynamics]:
        """Each axis with the effects."""
        return self.rows.simulation.dynamics(self.effects)

    def held(self, effect: str | None = None, axis: str | None = None) -> frozenset[int]:
        """Nominal parameters that an effect, tried or in the set, takes the place of, by number."""
        chosen = {(one.effect.name, one.axis) for one in self.effects}
        if effect is not None and axis is not None:
            chosen.add((effect, axis))
        by_name = frozenset(
            number
            for number, one in enumerate(self.bench.nominals)
            if one.axis is not None and ((one.effect, one.axis) in chosen or (one.timing and ("delay", one.axis) in chosen))
        )
        return self.exact.union(by_name, *(self.bench.same.get((on, name), ()) for name, on in chosen))

    def fields(self, axis: str, effect: Effect) -> list[Field]:
        """An effect's parameters as a search moves them on top of the set."""
        return movable_fields(effect, self.rows.motion[axis], self.dynamics[axis], self.bench.settings.wide_step)

    def moving(self, number: int) -> list[Field]:
        """The parameters of an effect of the set, by its number, that anything hangs on: one of the system's columns each."""
        one, names = self.effects[number], {each.name for each in self.felts[number].movable}
        return [each for each in self.fields(one.axis, one.effect) if each.name in names]

    def moved_by(self, earlier: Sequence[PlacedEffect], now: Sequence[PlacedEffect]) -> float:
        """What it means to the fit that some of its effects are where they are `now`, and not where they were earlier [nats]:
        the evidence that a straight line loses between the two, all others where they are. Infinite for other effects, and
        where what is fixed was another.
        """
        if [name_of(one) for one in earlier] != [name_of(one) for one in now]:
            return np.inf
        for last, one in zip(earlier, now, strict=True):
            fixed = one.effect.fixed(self.dynamics[one.axis])
            if any(getattr(one.effect, name) != getattr(last.effect, name) for name in fixed):
                return np.inf
        step = np.zeros(len(self.system.columns))
        for last, one in zip(earlier, now, strict=True):
            number = next(k for k, each in enumerate(self.effects) if each is one)
            at = [len(self.bench.nominals) + k for k, owner in enumerate(self.owners) if owner == number]
            for field, k in zip(self.moving(number), at, strict=True):
                step[k] = (getattr(one.effect, field.name) - getattr(last.effect, field.name)) / field.size
        own = step[self.fit.free]
        return float(0.5 * own @ self.fit.information @ own)

    def felt(self, axis: str, effect: Effect) -> Felt:
        """An effect on top of the set. Raises UserError where nothing can follow it."""
        return self.bench.felt(axis, effect, *self._place(axis, effect))

    def predictor(self, axis: str) -> Predict:
        """From an effect on an axis to what it costs on top of the set."""
        return lambda effect: Felt(self.bench, axis, effect, *self._place(axis, effect)).added

    def bends(self, axis: str, effect: Effect) -> bool:
        """Whether what yields in the set costs otherwise with an effect on its axis, which is the friction under it."""
        return any(not later.scales for later, _ in self._place(axis, effect)[1])

    def _place(self, axis: str, effect: Effect) -> tuple[AxisDynamics, Later]:
        """What an effect would stand on in the set, and what of the set would then bend otherwise."""
        key = axis, type(effect)
        found = self._places.get(key)
        if found is None:
            ordered = in_order((*self.effects, PlacedEffect(axis, effect, {})))
            number = next(k for k, one in enumerate(ordered) if one.effect is effect)
            before = self.bench.before(self.effects)
            later = _later(ordered, [*before[:number], self.dynamics[axis], *before[number:]], number)
            under = self.rows.simulation.dynamics_of(axis, self.effects[:number]) if later else self.dynamics[axis]
            found = self._places[key] = under, later
        return found

    @cached_property
    def _places(self) -> dict[tuple[str, type[Effect]], tuple[AxisDynamics, Later]]:
        return {}

    def energy(self, held: frozenset[int], extra: Sequence[Column] = (), less: Column | None = None) -> dict[str, float]:
        """Share of the gap's energy that is left on each axis, least squares; further columns and torque as they are felt."""
        whiten = self.plain.whiten
        return self._shares(self.plain, held, [whiten(each) for each in extra], whiten(less) if less is not None else None)

    def energy_still(self, held: frozenset[int]) -> dict[str, float]:
        """The same, the effects where they are."""
        return self._shares(self.still, held)

    def _shares(
        self, system: System, held: frozenset[int], extra: Sequence[Column] = (), less: Column | None = None
    ) -> dict[str, float]:
        """Of the gap's energy, by axis, what a system leaves beside columns and torque that it has whitened.

        Two readings of a row are no farther apart than is usual: a wave in the position costs what torque costs that is read at
        another moment, and would have no energy of its own.
        """
        moments = {number: APART * one.spread for number, one in enumerate(self.bench.nominals) if one.moment}
        gap = self.bench.rows.gap_energy
        return {
            axis: float(rows @ rows) * system.axes[axis].colour.level ** 2 / max(gap[axis], 1e-300)
            for axis, rows in system.left_within(moments, extra, less, held, NEARBY).items()
        }

    @cached_property
    def patched(self) -> frozenset[int]:
        """Nominal parameters that a patch has as the model has them: all but the timing, which is of the recording."""
        return frozenset(number for number, one in enumerate(self.bench.nominals) if not one.timing)

    @cached_property
    def as_recorded(self) -> frozenset[int]:
        """The timing of axes whose torque is not read earlier: other motion is compared as it was recorded."""
        return frozenset(self.bench.timing(axis) for axis in self.rows.axes if self.late.get(axis, 0.0) == 0.0)

    @cached_property
    def left(self) -> dict[str, float]:
        """`energy` of the set as it stands, with the model's own parameters."""
        return self.energy(self.patched)

    @cached_property
    def left_standing(self) -> dict[str, float]:
        """The same with the effects where they are: no less of all axes together, though it may be less of one."""
        return self.energy_still(self.patched)

    @cached_property
    def within_error(self) -> frozenset[str]:
        """Axes of which it leaves no more, with the model's parameters where least is left, than a calibrated model's misfit.

        Not with a timing that nothing reads earlier: that would hide a delay. Nor with what the model says nothing of.
        """
        untold = frozenset(number for number, one in enumerate(self.bench.nominals) if not one.told)
        left = self.energy_still(self.held() | self.as_recorded | untold)
        return frozenset(self.rows.axes) - {axis_of(name) for name, share in left.items() if share > self.bench.misfit(name)}

    def leaves_more_than(self, other: State, rows: Collection[str] | None = None) -> bool:
        """Whether it leaves more of an axis's gap than another: noise with long tails has learned what that one explains.

        `rows`: those that are compared; all, if not told. Its slopes are asked for only where it leaves more as it stands.
        """
        asked = [name for name in other.left if rows is None or name in rows]
        most = {name: self.bench.tolerated(name, other.left[name]) for name in asked}
        return any(self.left_standing[name] > most[name] for name in asked) and any(
            self.left[name] > most[name] for name in asked
        )


def state_of(
    bench: Bench,
    effects: Sequence[PlacedEffect],
    colours: Mapping[str, Colour | AxisSystem],
    late: Mapping[str, float],
    exact: frozenset[int] = frozenset(),
) -> State:
    """The set's system, in given colours or in those of another set's. Raises UserError where the effects make no mechanism."""
    ordered = in_order(effects)
    bench.rows.simulation.dynamics(ordered)
    before = bench.before(ordered)
    felts = [
        bench.felt(one.axis, one.effect, before[number], _later(ordered, before, number), _beside(bench, ordered, number))
        for number, one in enumerate(ordered)
    ]
    target, axes = {}, {}
    for axis in bench.rows.compared:
        needed = bench.target(axis, late.get(axis, 0.0))
        costs = tuple(felt.cost[axis] for felt in felts if axis in felt.cost)
        same = colour_in(colours[axis]), needed, *costs
        made = partial(explained, bench, axis, colours[axis], needed, costs)
        target[axis], axes[axis] = bench.explained.get(same, made, REMEMBERED * len(bench.rows.compared))
    return State(bench, ordered, tuple(felts), axes, target, late, exact)


def _beside(bench: Bench, ordered: Sequence[PlacedEffect], number: int) -> AxisDynamics | None:
    """The axis of a part with all the other effects of a set; None where none comes after it, or it is none."""
    one = ordered[number]
    if not isinstance(one.effect, PartEffect) or not any(each.axis == one.axis for each in ordered[number + 1 :]):
        return None
    return bench.rows.simulation.dynamics_of(one.axis, [each for each in ordered if each is not one])


def _of_one(column: Column, amount: float) -> Column:
    return {axis: rows / amount for axis, rows in column.items()}


def _later(ordered: Sequence[PlacedEffect], before: Sequence[AxisDynamics], number: int) -> Later:
    """What costs otherwise on the axis of a friction effect, in a set, where that is another: friction and joints that yield.

    In sliding an asymmetry of friction is an offset. Behind play and bristles it is none.
    """
    one = ordered[number]
    if not isinstance(one.effect, FrictionEffect) or one.effect.several:
        return ()
    rest = zip(ordered[number + 1 :], before[number + 1 :], strict=True)
    own = [(each.effect, axis) for each, axis in rest if each.axis == one.axis]
    return tuple((effect, axis) for effect, axis in own if isinstance(effect, AxisEffect) and _bends(effect))


def _bends(effect: AxisEffect) -> bool:
    return effect.on_friction or not effect.scales
