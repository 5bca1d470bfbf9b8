"""A spring, play and friction that yields before it slides, sought together on an axis: each alone takes the others' part.

Between motor and load they lie in series: what one of them gives way by hides in another that is softer. One after the other,
the second is then never found beside the first; two at a time, moved together, they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.diagnosis.model.solve import Fit
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.diagnosis.weigh.alignment import aligned
from drivetwin.diagnosis.weigh.state import FARTHEST, State
from drivetwin.emulator.dynamics.transmission import Transmission
from drivetwin.emulator.effects import AxisEffect, Effect, PlacedEffect
from drivetwin.foundation.errors import UserError

TRIED = 16
"""Starts of a further kind, the best beside what yields already, whose set is made."""
STARTS = 3
"""The best of those sets, that are moved."""
STEPS = 20
"""Gauss-Newton steps at most, with which all parameters move together."""
BRIEF = 5
"""The same of several sets, of which the best goes on: what is still on its way is worse."""
DAMPINGS = (1.0, 10.0, 100.0, 1000.0)
"""Of a step, tried in turn until one is better: Marquardt, J. Soc. Ind. Appl. Math. 11(2), 1963."""
GOOD = 0.25
"""Of what a straight line promises, that a step must bring, or another one is tried as well: the same."""
ENOUGH = 0.5
"""Nats that a further step must bring."""
NEAR = 0.02
"""Of its deviation, by which a parameter may miss the best one: the evidence feels the square of it."""


def yields(kind: type[Effect]) -> bool:
    """Whether an effect has its own motion between motor and load, so that its torque is no multiple of a shape."""
    return issubclass(kind, AxisEffect) and not kind.scales


def best_together(state: State, axis: str, kind: type[Effect]) -> State | None:
    """The set with one more effect that yields, moved together with those of its axis; None where no start can be followed."""
    assert issubclass(kind, AxisEffect)
    alone = [one for one in state.effects if not (one.axis == axis and yields(type(one.effect)))]
    dynamics = state.rows.simulation.dynamics_of(axis, alone)
    starts = [start.members[0] for start in kind.starts(state.rows.motion[axis], dynamics)]
    likely = np.argsort(side_by_side(lambda effect: -state.evidence_with(axis, effect), starts), kind="stable")
    best = [starts[k] for k in likely[:TRIED]]
    tried = side_by_side(lambda effect: tried_set(state, (*state.effects, placed(state.rows, axis, effect))), best)
    begun = [one for one in tried if one is not None]
    begun.sort(key=lambda one: -one.reached)
    briefly = side_by_side(lambda one: settled_on(one, BRIEF, axis), begun[:STARTS])
    ahead = max(briefly, key=lambda one: one.reached, default=None)
    return settled_on(ahead, axis=axis) if ahead is not None else None


def level_that_yields(state: State, axis: str, levels: Sequence[Effect], kind: type[Effect]) -> State | None:
    """The set with a level of friction on an axis and how it yields before it slides, moved together: each from its best start.

    The way on which friction yields is told by its level, and its level by that way: found one after the other, both are wrong.
    """
    assert issubclass(kind, AxisEffect)

    def begun(level: Effect) -> list[State]:
        alone = tried_set(state, (*state.effects, placed(state.rows, axis, level)))
        if alone is None:
            return []
        starts = [start.members[0] for start in kind.starts(state.rows.motion[axis], alone.dynamics[axis])]
        tried = side_by_side(lambda effect: tried_set(alone, (*alone.effects, placed(state.rows, axis, effect))), starts)
        return [one for one in tried if one is not None]

    each = [max(tried, key=lambda one: one.reached) for level in levels if (tried := begun(level))]
    return max(side_by_side(lambda one: settled_on(one, axis=axis), each), key=lambda one: one.reached, default=None)


def simpler(state: State, axis: str, kinds: Sequence[type[Effect]]) -> list[State]:
    """The set with an effect of the axis as another kind that has all its parameters but some: play that closes is a spring."""
    found = []
    for one in state.effects:
        if one.axis == axis and type(one.effect) in kinds:
            beside = [each for each in state.effects if each is not one]
            found += [tried_set(state, (*beside, placed(state.rows, axis, each))) for each in reduced(one.effect, kinds)]
    return [each for each in found if each is not None]


def reduced(effect: Effect, kinds: Sequence[type[Effect]]) -> list[Effect]:
    """An effect that yields as every other such kind that has all its parameters but some."""
    if not yields(type(effect)):
        return []
    names = {each.name for each in type(effect).parameters}
    told = {kind: {each.name for each in kind.parameters} for kind in kinds if yields(kind)}
    return [kind(**{name: getattr(effect, name) for name in own}) for kind, own in told.items() if own < names]


def sets_without(one: PlacedEffect, effects: Sequence[PlacedEffect]) -> list[list[PlacedEffect]]:
    """A set less one of its effects, as the others stand; where that one yields, also once for each other on its axis that
    yields, made as soft as both.

    From where it stands the other may not get there: it was fitted stiffer, and another valley lies in between.
    """
    rest = [each for each in effects if each is not one]
    softer = [(k, both) for k, each in enumerate(rest) if (both := _in_series(one, each)) is not None]
    return [rest, *([*rest[:k], both, *rest[k + 1 :]] for k, both in softer)]


def _in_series(one: PlacedEffect, other: PlacedEffect) -> PlacedEffect | None:
    """The other, as soft and as damped as both; None where one of them is no spring that yields, or on another axis."""
    springs = [each for each in (_spring(one.effect), _spring(other.effect)) if each is not None]
    if one.axis != other.axis or len(springs) < 2:
        return None
    first, second = springs
    both = Transmission().in_series(*first, 0.0).in_series(*second, 0.0)
    values = {"stiffness": both.stiffness, "damping": both.damping}
    return replace(other, effect=replace(other.effect, **values))


def _spring(effect: Effect) -> tuple[float, float] | None:
    """Stiffness and damping of an effect that yields; None where it has none."""
    values = {one.name: float(getattr(effect, one.name)) for one in type(effect).parameters}
    able = yields(type(effect)) and {"stiffness", "damping"} <= values.keys()
    return (values["stiffness"], values["damping"]) if able else None


def settled_on(state: State, steps: int = STEPS, axis: str | None = None) -> State:
    """The set a few Gauss-Newton steps on, all parameters together, as far as the evidence gains; its torque read anew where
    these have come to an end.

    Not to where a straight line leaves more of a gap than in the beginning: the unknown would take over what effects explain.
    `axis`: only effects of one axis move, and only its torque is read anew; nominal parameters are free everywhere.
    """
    state = begun = aligned(state, axis=axis)
    for _ in range(steps):
        ahead = step_ahead(state, begun) if axis is None else _best_step(state, begun, axis)
        gained = ahead.reached - state.reached if ahead is not None else 0.0
        state = ahead if ahead is not None else state
        if gained < ENOUGH:
            read = aligned(state, axis=axis)
            if read is state:
                break
            state = read
    return state


def step_ahead(state: State, begun: State) -> State | None:
    """One damped Gauss-Newton step on, of all axes, or else of one; None where none is better.

    Where one axis's effects bend too much for a straight line, the others still move.
    """
    axes = state.axes_of(state.effects)
    for axis in (None, *(axes if len(axes) > 1 else ())):
        best = _best_step(state, begun, axis)
        if best is not None:
            return best
    return None


def _best_step(state: State, begun: State, axis: str | None) -> State | None:
    """The first step that brings a good part of what it promises, or else the best, of those that leave no more of a gap than
    the set did with which the steps have `begun`."""
    best: State | None = None
    for damping in DAMPINGS:
        told = state.ahead(damping)
        try:
            ahead = state.of(moved_by_fit(state, told, 1.0, axis))
        except UserError:
            continue
        if ahead.reached > (best or state).reached and not ahead.leaves_more_than(begun):
            best = ahead
        if best is not None and best.reached - state.reached > GOOD * (told.evidence - state.unlikely - state.reached):
            break
    return best


def tried_set(state: State, effects: Sequence[PlacedEffect]) -> State | None:
    """Another set; None where it makes no mechanism."""
    try:
        return state.of(effects)
    except UserError:
        return None


def moved_by_fit(state: State, fit: Fit, share: float, axis: str | None = None) -> tuple[PlacedEffect, ...]:
    """The effects, their parameters by a share of the way to where a linear fit about them has them, within their bounds.

    An effect whose every parameter is there already, by its deviation, stays as it is. `axis`: only those of one axis move.
    """
    found, first = [], len(state.bench.nominals)
    deviations = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    for number, one in enumerate(state.effects):
        at = [first + k for k, owner in enumerate(state.owners) if owner == number]
        there = all(abs(fit.coefficients[k]) <= NEAR * deviations[k] for k in at)
        if there or axis not in (None, one.axis):
            found.append(one)
            continue
        values = {}
        for movable, k in zip(state.moving(number), at, strict=True):
            value = float(getattr(one.effect, movable.name))
            step = share * float(np.clip(fit.coefficients[k], -FARTHEST, FARTHEST)) * movable.size
            values[movable.name] = float(np.clip(value + step, movable.low, movable.high))
        found.append(placed(state.rows, one.axis, replace(one.effect, **values)))
    return tuple(found)
