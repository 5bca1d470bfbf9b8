"""The values that go into the patch: plain least squares of the set that was found, with intervals that know the colour.

What was weighed is likelihood; what a patch is judged by is the rms of the gap. So the effects of the set are fitted once
more without colour and unknown, and with them the masses that are off, all other nominal parameters held; their covariance is
the sandwich over blocks of contiguous time (Liang and Zeger, Biometrika 73(1), 1986), which is right whatever the colour of
what is left. It does not know that the model may be of another form than the machine. That shows where likelihood and least
squares, which agree on a right model, give different values (Hausman, Econometrica 46(6), 1978): a deviation is at least that
difference. Even so a wrong form errs alike in all blocks: by how much more parameters miss than blocks tell was counted on
machines of another simulator (`widening`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.solve import Fit, inverse_of
from drivetwin.diagnosis.propose.placing import alike
from drivetwin.diagnosis.weigh.alignment import LEAST, best_moment
from drivetwin.diagnosis.weigh.state import State
from drivetwin.diagnosis.weigh.yielding import DAMPINGS, moved_by_fit
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

STEPS = 3
"""Gauss-Newton steps at most."""
CONVERGED = 30
"""The same where sets are compared: they have then come to rest."""
GAIN = 1e-5
"""Share of the gaps that a step must close."""
MOMENTS = 3
"""Times at most that the moment of each torque and the effects are fitted in turn."""
NOTHING = 1e-6
"""Information on a step that matters to a parameter, below which nothing tells it: the place of a load on a slide, say."""


@dataclass(frozen=True)
class Refitted:
    """The effects in order, and the standard deviation of each one's parameters by name, in their units; infinite for what
    nothing tells.

    `heavier`: bodies, by number, that are heavier by a share of their mass, and the `spread` of each share, its standard
    deviation.
    """

    state: State
    effects: tuple[PlacedEffect, ...]
    deviations: Sequence[dict[str, float]]
    heavier: Mapping[int, float]
    spread: Mapping[int, float]
    late: Mapping[str, float]
    """By how much the torque of each axis was recorded late [s], of those whose torque is read earlier."""


def refitted(state: State, bodies: Collection[int]) -> Refitted:
    """Some Gauss-Newton steps from the set's values, and the moment at which each late torque is read: what the energy does not
    tell stays near. `bodies`: of free mass.
    """
    return _values(state, _read_anew(least_squares(state, bodies), bodies), bodies)


def refitted_as_read(state: State, bodies: Collection[int]) -> Refitted:
    """The same, each torque read as in the set."""
    return _values(state, least_squares(state, bodies), bodies)


def _values(weighed: State, state: State, bodies: Collection[int]) -> Refitted:
    """Of a set as it was weighed and as it was then fitted."""
    heavier = masses(state, bodies)
    columns = _deviations(state, bodies)
    apart = [_apart(one, weighed.effects) for one in state.effects]
    wider = state.bench.settings.widening
    spread = [_of_parameters(state, number, columns) for number in range(len(state.effects))]
    deviations = [{name: wider * max(own[name], far[name]) for name in own} for own, far in zip(spread, apart, strict=True)]
    likeliest = weighed.fit.coefficients
    of_body = {
        one.body: wider * max(columns[k], abs(float(likeliest[k]) - heavier[one.body]))
        for k, one in enumerate(state.bench.nominals)
        if one.body is not None and one.body in heavier
    }
    late = {axis: each for axis, each in state.late.items() if each > 0.0}
    return Refitted(state, state.effects, deviations, heavier, {body: of_body[body] for body in heavier}, late)


def masses(state: State, bodies: Collection[int]) -> dict[int, float]:
    """Bodies, by number, of those of free mass, and by which share of their mass they are heavier with a set as it stands."""
    free = [(k, one.body) for k, one in enumerate(state.bench.nominals) if one.body is not None and one.body in bodies]
    values = _standing(state, bodies).coefficients if free else np.zeros(0)
    return {body: float(values[k]) for k, body in free}


def alone(state: State, effects: Sequence[PlacedEffect], bodies: Collection[int], axis: str | None = None) -> State | None:
    """Some of the effects of a set where least is left; None where they make no mechanism. `bodies`: of free mass; `axis`: only
    effects of one axis move.
    """
    try:
        return least_squares(state.of(effects), bodies, CONVERGED, axis)
    except UserError:
        return None


def least_squares(state: State, bodies: Collection[int], steps: int = STEPS, axis: str | None = None) -> State:
    """The set some Gauss-Newton steps on, as far as less energy is left; `axis`: only effects of one axis move."""
    for _ in range(steps if state.effects else 0):
        before, state = state, _ahead(state, bodies, axis)
        if state is before:
            break
    return state


def _read_anew(state: State, bodies: Collection[int]) -> State:
    """The set with each torque that is read earlier read at the moment at which least is left, and the effects fitted to that.

    The likelihood weighs the fast part of a motion most. Where a recording is not equally late throughout, that differs.
    """
    for _ in range(MOMENTS):
        late = {axis: _moment(state, bodies, axis) for axis, each in state.late.items() if each > 0.0}
        if all(abs(each - state.late[axis]) < LEAST for axis, each in late.items()):
            break
        state = least_squares(state.read({**state.late, **late}), bodies)
    late_ones = [axis for axis, each in state.late.items() if each > 0.0]
    for axis in late_ones:
        state = state.holding(state.bench.timing(axis))
    return least_squares(state, bodies) if late_ones else state


def _moment(state: State, bodies: Collection[int], axis: str) -> float:
    """How late the torque of an axis is read [s] when the set leaves least of its gap."""
    held = _held(state, bodies) | {state.bench.timing(axis)}

    def explained(late: float) -> float:
        return -sum(state.read({**state.late, axis: late}).energy_still(held).values())

    return best_moment(explained, state.late[axis], GAIN)


def left_by(state: State, bodies: Collection[int]) -> float:
    """Share of the gaps' energy that a patch of the set as it stands leaves, the sum of all axes."""
    return sum(left_on(state, bodies).values())


def left_on(state: State, bodies: Collection[int]) -> dict[str, float]:
    """The same of each axis."""
    return state.energy_still(_held(state, bodies))


def _apart(one: PlacedEffect, likeliest: Sequence[PlacedEffect]) -> dict[str, float]:
    """How far each parameter of an effect is from where the likelihood has it."""
    other = next((each for each in likeliest if alike(each, one)), one)
    names = [parameter.name for parameter in one.effect.parameters]
    return {name: abs(float(getattr(one.effect, name)) - float(getattr(other.effect, name))) for name in names}


def _ahead(state: State, bodies: Collection[int], axis: str | None) -> State:
    """One damped Gauss-Newton step on that leaves less energy; as it was where none does (Marquardt 1963, as in a search)."""
    left, held = left_by(state, bodies), _held(state, bodies) | _of_others(state, axis)
    for damping in DAMPINGS:
        fit = replace(state.plain, near=damping * state.plain.near).fit(held=held)
        try:
            ahead = state.of(moved_by_fit(state, fit, 1.0, axis))
        except UserError:
            continue
        if left_by(ahead, bodies) < left - GAIN:
            return ahead
    return state


def _of_others(state: State, axis: str | None) -> frozenset[int]:
    """Columns of effects that do not move, where only those of one axis do."""
    first = len(state.bench.nominals)
    return frozenset(first + k for k, owner in enumerate(state.owners) if axis not in (None, state.effects[owner].axis))


def _held(state: State, bodies: Collection[int]) -> frozenset[int]:
    """All nominal parameters but some bodies' masses; the timing too where the torque is not read earlier."""
    free = {number for number, one in enumerate(state.bench.nominals) if one.body in bodies and one.body is not None}
    return state.held() | ((state.patched | state.as_recorded) - free)


def _fit(state: State, bodies: Collection[int]) -> Fit:
    return state.plain.fit(held=_held(state, bodies))


def _standing(state: State, bodies: Collection[int]) -> Fit:
    """The same with the effects where they are."""
    return state.still.fit(held=_held(state, bodies))


def _deviations(state: State, bodies: Collection[int]) -> dict[int, float]:
    """Of the system's columns that are fitted, by number: bodies of free mass, and parameters of effects."""
    system, held = state.plain, _held(state, bodies)
    count = len(state.bench.nominals)
    free = [k for k in range(len(system.columns)) if k not in held and (k >= count or state.bench.nominals[k].body is not None)]
    if not free:
        return {}
    fit = _fit(state, bodies)
    size = len(free)
    information, middle = np.zeros((size, size)), np.zeros((size, size))
    for axis, own in system.axes.items():
        none = np.zeros(len(own.target))
        columns = np.column_stack([system.columns[k].get(axis, none) for k in free])
        rows = own.target - columns @ fit.coefficients[free]
        information += columns.T @ columns
        scores = np.zeros((int(own.blocks.max(initial=-1)) + 1, size))
        np.add.at(scores, own.blocks, columns * rows[:, None])
        middle += scores.T @ scores
    inverse = inverse_of(information)
    spread = np.sqrt(np.maximum(np.diag(inverse @ middle @ inverse), 0.0))
    spread[np.diag(information) < NOTHING] = np.inf
    return {k: float(deviation) for k, deviation in zip(free, spread, strict=True)}


def _of_parameters(state: State, number: int, columns: Mapping[int, float]) -> dict[str, float]:
    """The same of an effect's parameters by name, in their units; infinite for what nothing tells."""
    one, first = state.effects[number], len(state.bench.nominals)
    own = [first + k for k, owner in enumerate(state.owners) if owner == number]
    nothing = {field.name: np.inf for field in state.fields(one.axis, one.effect)}
    return nothing | {field.name: columns[k] * field.size for field, k in zip(state.moving(number), own, strict=True)}
