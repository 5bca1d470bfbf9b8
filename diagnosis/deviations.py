"""The model's own parameters: which of them are off, by how much, and as which effects that is corrected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.comparison import Comparison
from diagnosis.corrections import corrections
from diagnosis.nominal import Nominal
from diagnosis.regression import Fitted, covariance
from diagnosis.state import State, memory
from emulator.effects import PlacedEffect

Array = NDArray[np.float64]

FAR_OFF = 2.5
"""Standard deviations from which a nominal parameter counts as off by more than it usually is."""
PARAMETER_EVIDENCE = 4.0
"""Nats that a nominal parameter must bring to be named."""
LEAST_FELT = 0.3
"""Of the squared floor, that the torque of a parameter's deviation must be to be named."""


@dataclass(frozen=True)
class Off:
    """One nominal parameter, by how much it is off, and the standard deviation of that."""

    nominal: Nominal
    amount: float
    deviation: float


@dataclass(frozen=True)
class Deviation:
    """Parameters of the model found off that are named together: `coulomb`, `viscous` or `inertia` of an axis."""

    effect: str
    axis: str
    members: tuple[Off, ...]
    evidence: float


@dataclass(frozen=True)
class Group:
    """Nominal parameters by their numbers that are named together, and the nats that letting them go brought."""

    effect: str
    axis: str
    numbers: tuple[int, ...]
    evidence: float = 0.0


def groups(nominals: Sequence[Nominal]) -> list[Group]:
    """Friction of each axis by itself; inertia with the bodies that load this axis most."""
    found: dict[tuple[str, str], list[int]] = {}
    for number, nominal in enumerate(nominals):
        if not nominal.timing:
            found.setdefault((nominal.effect or "inertia", nominal.loaded_axis), []).append(number)
    return [Group(effect, axis, tuple(numbers)) for (effect, axis), numbers in found.items()]


def costliest(state: State) -> Group:
    """The group whose deviations, where nothing but parameters may be off, cost most against the floor."""
    fitted = state.regression.fit()
    return max(groups(state.nominals), key=lambda group: cost(state, group, fitted))


def cost(state: State, group: Group, fitted: Fitted) -> float:
    """Mean square of the torque that a group's deviations are, in squares of the floor, over all axes."""
    total = 0.0
    for axis, rows in state.regression.rows.items():
        columns = [fitted.coefficients[k] * state.nominals[k].column.get(axis, np.zeros(rows)) for k in group.numbers]
        total += mean_square(np.sum(columns, axis=0)) / state.noise[axis] ** 2
    return total


def forward(state: State) -> list[Group]:
    """Groups of nominal parameters that are off, the one that brings most at each step first."""
    regression, nominals = state.regression, state.nominals
    as_one = {axis: memory(state.comparison, axis, state.residual[axis]) for axis in regression.axes}
    waiting, taken = groups(nominals), list[Group]()

    def evidence(active: Sequence[Group]) -> float:
        free = {number for group in active for number in group.numbers}
        held = frozenset(n for n, one in enumerate(nominals) if n not in free and not one.timing)
        return regression.evidence(regression.fit(held=held), as_one)

    def felt(group: Group) -> bool:
        free = {number for each in (*taken, group) for number in each.numbers}
        held = frozenset(n for n, one in enumerate(nominals) if n not in free and not one.timing)
        return cost(state, group, regression.fit(held=held)) > LEAST_FELT

    known = evidence(taken)
    while waiting:
        gains = [(evidence([*taken, group]) - known, number) for number, group in enumerate(waiting)]
        gain, best = max(gains)
        if gain < PARAMETER_EVIDENCE or not felt(waiting[best]):
            break
        known += gain
        taken.append(replace(waiting.pop(best), evidence=gain))
    return taken


def freed_where_far_off(
    nominals: Sequence[Nominal], found: Sequence[Deviation], off: Sequence[Group]
) -> Sequence[Nominal]:
    """The nominal parameters, those without a prior worth the name that are off by more than a few per cent."""
    far = {
        number
        for group, one in zip(off, found, strict=True)
        for number, member in zip(group.numbers, one.members, strict=True)
        if abs(member.amount) > FAR_OFF * member.nominal.spread
    }
    if not far:
        return nominals
    return [replace(one, spread=10.0 * one.spread) if number in far else one for number, one in enumerate(nominals)]


def deviations(state: State, off: Sequence[Group]) -> list[Deviation]:
    """The groups with the amounts that a fit of the state's nominal parameters gives; numbers are of these."""
    fitted = state.regression.fit()
    spread = np.sqrt(np.maximum(np.diag(covariance(state.regression)), 0.0))
    return [
        Deviation(
            group.effect,
            group.axis,
            tuple(Off(state.nominals[k], float(fitted.coefficients[k]), float(spread[k])) for k in group.numbers),
            group.evidence,
        )
        for group in off
    ]


def renumbered(off: Sequence[Group]) -> list[Group]:
    """The same groups where nothing but they and the timing is left, in their order."""
    found, at = [], 0
    for group in off:
        found.append(replace(group, numbers=tuple(range(at, at + len(group.numbers)))))
        at += len(group.numbers)
    return found


def as_effects(comparison: Comparison, found: Sequence[Deviation]) -> tuple[PlacedEffect, ...]:
    """Deviations of friction and of an axis's inertia as the effects that correct them."""
    members = [off for one in found for off in one.members]
    return corrections(comparison, [off.nominal for off in members], [off.amount for off in members])


def mean_square(values: Array) -> float:
    """0 of nothing."""
    return float(np.mean(values**2)) if len(values) else 0.0
