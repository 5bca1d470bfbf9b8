"""What does not change while sets of effects are weighed, and how one effect is felt on the rows that are compared."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.colour import Colour, white
from drivetwin.diagnosis.model.unknown import Component, components
from drivetwin.diagnosis.prepare.deflection import axis_of, deflection_of
from drivetwin.diagnosis.prepare.rows import Column, Rows
from drivetwin.diagnosis.propose.nominal import Nominal, is_multiple, nominal_parameters
from drivetwin.diagnosis.propose.rigid import Polynomial, polynomial
from drivetwin.diagnosis.propose.search import Beginnings, Field, beginnings, movable_fields, tangents
from drivetwin.diagnosis.propose.side_by_side import by_key
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import AxisEffect, Effect, FrictionEffect, ModelEffect, PlacedEffect, library
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.lately import Lately, OfSame

Array = NDArray[np.float64]
Later = tuple[tuple[AxisEffect, AxisDynamics], ...]
"""Effects, and the axis as each finds it."""

LATELY = 32
"""Columns that are remembered while a search moves on: of what stands and of its neighbours."""
HELD = 400
"""Felt effects that a bench remembers: those of a few sets, one after the other."""

NO_TORQUE = 1e-12
"""Below which a torque counts as none [N·m or N]: of an axis without rows, or whose torque is 0."""
NO_SLOPE = 1e-9
"""Of the steepest slope of an effect, below which another is rounding."""


@dataclass(frozen=True)
class Felt:
    """An effect on the rows, on top of those before it in its axis. Raises UserError where nothing can follow it."""

    bench: Bench
    axis: str
    effect: Effect
    dynamics: AxisDynamics
    later: Later = ()
    """What bends with the friction under it, and the axis as that finds it."""
    beside: AxisDynamics | None = None
    """Of a part of the axis, the axis with all others of the set: there it has its slopes."""

    @cached_property
    def cost(self) -> Column:
        """Torque that it costs, on the rows of every axis that it acts on [N·m or N]."""
        return self._cost(self.effect)

    @cached_property
    def added(self) -> Column:
        """What a set that has the later ones costs more with it [N·m or N]."""
        found = dict(self._with_later(self.effect))
        for one, dynamics in self.later:
            for axis, rows in self.bench.column(PlacedEffect(self.axis, one, {}), dynamics).items():
                found[axis] = found[axis] - rows
        return found

    @cached_property
    def movable(self) -> Sequence[Field]:
        """Its parameters that may move; of a body only those that anything hangs on: where a load rides on a slide does not."""
        fields = self._fields
        if not isinstance(self.effect, ModelEffect):
            return fields
        heights = [_highest(slope) for slope in tangents(self.effect, fields, self._with_later)]
        return [field for field, height in zip(fields, heights, strict=True) if height > NO_SLOPE * max(heights)]

    @cached_property
    def tangents(self) -> Sequence[Column]:
        """Its slope by each of them, in steps that matter to it [N·m or N], with what it does to the later."""
        return tangents(self.effect, self.movable, self._with_later)

    @property
    def _fields(self) -> list[Field]:
        wide = self.bench.settings.wide_step
        fields = movable_fields(self.effect, self.bench.rows.motion[self.axis], self.dynamics, wide)
        if self.later:  # what yields has steps, over which a slope is a wide difference
            fields = [replace(each, difference=wide) for each in fields]
        return fields

    def _cost(self, effect: Effect) -> Column:
        return self.bench.column(PlacedEffect(self.axis, effect, {}), self.dynamics)

    def _with_later(self, effect: Effect) -> Column:
        if self.beside is not None:
            return self.bench.column(PlacedEffect(self.axis, effect, {}), self.beside)
        found = dict(self._cost(effect))
        for one, dynamics in self.later:
            assert isinstance(effect, FrictionEffect)
            changed = replace(dynamics, friction=effect.change(dynamics.friction))
            for axis, rows in self.bench.column(PlacedEffect(self.axis, one, {}), changed).items():
                found[axis] = found[axis] + rows if axis in found else rows
        return found


def _highest(column: Column) -> float:
    return max((float(np.abs(rows).max(initial=0.0)) for rows in column.values()), default=0.0)


@dataclass(frozen=True)
class Bench:
    """What does not change while sets of effects are weighed: rows, nominal parameters, the unknown, what bodies cost."""

    rows: Rows
    settings: Settings
    nominals: tuple[Nominal, ...]
    unknown: Mapping[str, tuple[Component, ...]]
    polynomials: Mapping[tuple[str, str], Polynomial]
    clocks: Array
    """Between samples as they were recorded, and between rows, of each recording (R, 2) [s]."""
    same: Mapping[tuple[str, str], frozenset[int]] = field(default_factory=dict)
    """Inertias of axes, by number, that an effect of bodies is another name of, by axis and name: of a load on a slide."""
    without_gap: frozenset[str] = frozenset()
    """Axes on which nothing is to be explained: their torque is read as it was recorded."""
    _earlier: dict[tuple[str, float], Array] = field(init=False, repr=False, default_factory=dict)
    _felt: dict[Hashable, Felt] = field(init=False, repr=False, default_factory=dict)
    _beginnings: dict[tuple[str, type[AxisEffect]], Beginnings] = field(init=False, repr=False, default_factory=dict)
    _lately: Lately[tuple[str, Effect, AxisDynamics], Column] = field(init=False, repr=False, default_factory=Lately)
    explained: OfSame = field(init=False, repr=False, default_factory=OfSame)
    """Systems of axes, by what their effects cost: a trial changes one axis, and the others stay as they are."""
    whitened: OfSame = field(init=False, repr=False, default_factory=OfSame)
    """Columns, by their colour."""
    bent: OfSame = field(init=False, repr=False, default_factory=OfSame)
    """Nominal parameters, as a set bends them."""
    products: OfSame = field(init=False, repr=False, default_factory=OfSame)
    """Of the columns of an axis."""
    plain: OfSame = field(init=False, repr=False, default_factory=OfSame)
    """Systems of axes without colour and unknown, by what is left there; `flat`: their columns; and their products."""
    flat: OfSame = field(init=False, repr=False, default_factory=OfSame)
    plain_products: OfSame = field(init=False, repr=False, default_factory=OfSame)

    @cached_property
    def white(self) -> dict[str, Colour]:
        """Noise of each axis as it is taken to be at first: white, at the level of the gap."""
        order = self.settings.colour_order
        level = {axis: max(_rms(self.rows.target[axis]), self.noise_floor(axis)) for axis in self.rows.compared}
        return {axis: white(self.rows.of[axis], self.clocks, level[axis], order) for axis in self.rows.compared}

    def noise_floor(self, axis: str) -> float:
        """A quarter of what the comparison itself errs by is white; and never nothing [N·m or N]."""
        return max(0.25 * self.settings.model_error * self.rows.size[axis], NO_TORQUE)

    def felt(
        self, axis: str, effect: Effect, dynamics: AxisDynamics, later: Later = (), beside: AxisDynamics | None = None
    ) -> Felt:
        """An effect on top of those before it, remembered: sets that follow each other have most of their effects in common."""
        key = (axis, effect, dynamics, later, beside)
        found = self._felt.get(key)
        if found is None:
            if len(self._felt) >= HELD:
                for old in list(self._felt)[: HELD // 2]:
                    self._felt.pop(old, None)
            found = self._felt[key] = Felt(self, axis, effect, dynamics, later, beside)
        return found

    def before(self, ordered: tuple[PlacedEffect, ...]) -> list[AxisDynamics]:
        """The axis of each effect of a set with those before it."""
        dynamics = self.rows.simulation.dynamics_of
        return [dynamics(one.axis, ordered[:number]) for number, one in enumerate(ordered)]

    def beginnings(self, axis: str, kind: type[AxisEffect], dynamics: AxisDynamics) -> Beginnings:
        """Where a search for a kind begins on an axis, remembered until what it stands on changes."""
        found = self._beginnings.get((axis, kind))
        if found is None or found.dynamics != dynamics:
            found = self._beginnings[axis, kind] = beginnings(self.rows, axis, kind, dynamics)
        return found

    def target(self, axis: str, late: float) -> Array:
        """What is to be explained on the rows of an axis [N·m or N], its torque read `late` [s] earlier."""
        if late == 0.0:
            return self.rows.target[axis]
        found = self._earlier.get((axis, late))
        if found is None:
            change = self.rows.rows(axis, lambda run, own: run.earlier(own, late))
            found = self._earlier[axis, late] = self.rows.target[axis] + change
        return found

    def least(self, one: PlacedEffect) -> float:
        """Share of an axis's gap energy that an effect must take to be named: of a large gap, what the comparison errs by; and
        never less than that, where its errors look like the effect and no second encoder distinguishes them.
        """
        energy = (self.settings.model_error * self.rows.size[one.axis]) ** 2 * self.rows.count(one.axis)
        errs = energy / max(self.rows.gap_energy[one.axis], 1e-300)
        alike = one.effect.like_errors and deflection_of(one.axis) not in self.rows.compared
        return max(self.settings.least_share, errs) if alike else min(self.settings.least_share, errs)

    def tolerated(self, name: str, before: float) -> float:
        """Share of the gap energy of some rows that may be left where `before` was: no more, to the least share; where there is
        no gap, up to that and what a calibrated model misses.
        """
        most = before + self.settings.least_share
        if axis_of(name) not in self.without_gap:
            return most
        return max(most, 1.0 + self.misfit(name))

    def misfit(self, name: str) -> float:
        """What a calibrated model misses of some rows, as a share of their gap energy."""
        energy = (self.settings.misfit * self.rows.size[name]) ** 2 * len(self.rows.of[name])
        return energy / max(self.rows.gap_energy[name], 1e-300)

    def timing(self, axis: str) -> int:
        """Number of the nominal parameter of the moment at which an axis's torque was read."""
        return next(k for k, one in enumerate(self.nominals) if one.timing and one.loaded_axis == axis and axis in one.column)

    def column(self, one: PlacedEffect, dynamics: AxisDynamics) -> Column:
        """What an effect costs on the rows of every axis that it acts on; a search asks for where it is more than once."""
        effect = one.effect
        if isinstance(effect, AxisEffect):
            return self._lately.get((one.axis, effect, dynamics), lambda: self.rows.cost(one.axis, effect, dynamics), LATELY)
        known = self.polynomials.get((one.axis, one.effect.name))
        if known is None:
            raise UserError(f"axis {one.axis} cannot have {one.effect.name}")
        return known.column(one.effect)


def bench_of(
    rows: Rows,
    settings: Settings,
    absolute: Mapping[str, bool],
    without_gap: frozenset[str] = frozenset(),
    asked: Sequence[tuple[str, type[ModelEffect]]] | None = None,
) -> Bench:
    """`absolute`: axes whose position means the same in all recordings. `asked`: effects of bodies that a set may have, by
    axis; all of the library on all axes, if not told."""
    if asked is None:
        kinds = [kind for kind in library().values() if issubclass(kind, ModelEffect)]
        asked = [(axis, kind) for axis in rows.axes for kind in kinds]
    made = by_key(lambda one: polynomial(rows, *one), asked)
    told = {(axis, kind.name): found for (axis, kind), found in made.items() if found is not None}
    nominals = tuple(nominal_parameters(rows, settings))

    def unknown(axis: str) -> tuple[Component, ...]:
        return tuple(components(rows, axis, settings.misfit_waves, absolute[axis], _known(rows, axis, nominals)))

    return Bench(
        rows,
        settings,
        nominals,
        by_key(unknown, rows.axes),
        told,
        np.array([(run.recording.info.sample_period, run.period * run.stride) for run in rows.runs]),
        {(axis, name): _same(rows, axis, found, nominals) for (axis, name), found in told.items()},
        without_gap,
    )


def _same(rows: Rows, axis: str, effect: Polynomial, nominals: Sequence[Nominal]) -> frozenset[int]:
    """The inertia of an axis, by number, where an effect costs a multiple of it whatever its shape, and nothing elsewhere."""
    none = {name: np.zeros(rows.count(name)) for name in effect.terms}

    def costs(own: Column) -> bool:
        return all(
            is_multiple(rows, name, term, own.get(name, none[name])) for name, terms in effect.terms.items() for term in terms.T
        )

    inertias = [(number, one) for number, one in enumerate(nominals) if (one.effect, one.axis) == ("inertia", axis)]
    return frozenset(number for number, one in inertias if costs(one.column))


def _known(rows: Rows, axis: str, nominals: Sequence[Nominal]) -> Array:
    """What the model's own parameters cost on an axis, and an offset, which no model has and any drive may (N, q)."""
    own = [one.column[axis] for one in nominals if not one.timing and axis in one.column]
    return np.column_stack([*own, rows.rows(axis, lambda run, own: run.moves(own))])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
