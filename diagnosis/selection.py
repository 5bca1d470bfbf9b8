"""Step by step: which effect next, until none is better than nothing more; then the model's own parameters that are off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.comparison import Comparison
from diagnosis.hypotheses import NOMINAL, PARAMETERS, Hypothesis, State, hypotheses, memory, settled, state_with
from diagnosis.nominal import Nominal
from diagnosis.regression import Fitted, Regression
from diagnosis.result import NONE
from emulator.effects import Effect, PlacedEffect, library

Array = NDArray[np.float64]

MOST_EFFECTS = 3
"""Beside parameters of the model: what more would be needed is not an explanation."""
LEAST_EVIDENCE = 3.0
"""Nats by which an effect must beat parameters that are a little off, to be selected."""
LEAST_SHARE = 0.03
"""Of an axis's squared gap as it was at first, that an effect must take away on rows that it was not fitted to."""
LEAST_OF_FLOOR = 0.5
"""Of the squared floor of the comparison, that an effect must take away."""
LEAST_DRIVE = 20.0
"""Nats that a drive's effect must bring to be looked at beside another effect."""
STRAIN = 5.0
"""Nats of the prior from which parameters of the model are further off than usual: no share of the first gap is asked of an
effect that takes as much from them."""
FAR_OFF = 2.5
"""Standard deviations from which a nominal parameter counts as off by more than it usually is."""
ABSORBED = 1.5
"""Nats by which parameters of the model must be further off without an effect, to count as standing in for it."""
MUCH, MUCH_OF_FLOOR = 0.12, 4.0
"""Shares of the squared residual and of the squared floor that are much."""
PARAMETER_EVIDENCE = 4.0
"""Nats that a nominal parameter must bring to be named."""
LEAST_FELT = 0.3
"""Of the squared floor, that the torque of a parameter's deviation must be to be named."""
HARDLY_KNOWN = 100.0
"""Standard deviation of an effect's parameter that no data tell, in its own size."""
ORDER = {"friction": 0, "rigid body": 1, "motor and drive": 2, "transmission": 3, "sensing and timing": 4}
"""In which torque and motion pass the effects: each is predicted on an axis that has those before it."""

NOTHING = np.zeros(1)


@dataclass(frozen=True)
class Step:
    """One step's answers, most evident first, in the state in which they were tried, and which one was selected, if any."""

    state: State
    answers: Sequence[Hypothesis]
    chosen: Hypothesis | None


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
class Selection:
    """All steps; the effects selected, settled together; the parameters found off; the state that has the effects in it."""

    steps: Sequence[Step]
    effects: tuple[PlacedEffect, ...]
    deviations: Sequence[Deviation]
    final: State


def select_causes(
    comparison: Comparison, nominals: Sequence[Nominal], noise: Mapping[str, float], progress: Callable[[str, float], None]
) -> Selection:
    """Effects in the order of their evidence, each step given those before; then deviations of nominal parameters."""
    selected: tuple[PlacedEffect, ...] = ()
    steps: list[Step] = []
    state = state_with(comparison, nominals, selected, noise)
    for number in range(MOST_EFFECTS + 1):
        if number > 0 and not something_left(state) and not _drive_left(steps[-1]) and not strained(state):
            break
        progress(f"step {number + 1}: every effect on every axis", 1.0)
        answers = worth_telling(state, hypotheses(state))
        chosen = choice(state, answers) if number < MOST_EFFECTS else None
        steps.append(Step(state, answers, chosen))
        if chosen is None or chosen.found is None or chosen.axis is None:
            break
        selected = in_order([*selected, placed(comparison, chosen.axis, chosen.found.effect)])
        selected = settled(state_with(comparison, nominals, selected, noise), selected)
        state = state_with(comparison, nominals, selected, noise)
    if len(selected) > 1:
        steps, selected = reconsidered(comparison, nominals, noise, steps, selected)
        state = state_with(comparison, nominals, selected, noise)
    off = forward(state)
    freed = freed_where_far_off(nominals, deviations(state, off), off)
    if selected and freed != nominals:
        steps, selected = reconsidered(comparison, freed, noise, steps, selected)
        state = state_with(comparison, freed, selected, noise)
        off = forward(state)
        nominals = freed
    kept = [nominals[number] for group in off for number in group.numbers] + [one for one in nominals if one.timing]
    state = state_with(comparison, kept, selected, noise)
    if selected:
        selected = settled(state, selected, state.regression.scale)
        state = state_with(comparison, kept, selected, noise)
    return Selection(steps, selected, deviations(state, renumbered(off)), state)


def reconsidered(
    comparison: Comparison,
    nominals: Sequence[Nominal],
    noise: Mapping[str, float],
    steps: Sequence[Step],
    selected: tuple[PlacedEffect, ...],
) -> tuple[list[Step], tuple[PlacedEffect, ...]]:
    """Each choice again, beside the others: a first choice may have stood in for two effects, or for one found later."""
    again = list(steps)
    made = [number for number, step in enumerate(steps) if step.chosen is not None]
    for number in made:
        former = again[number].chosen
        assert former is not None
        own = next(one for one in selected if (one.effect.name, one.axis) == (former.effect, former.axis))
        others = tuple(one for one in selected if one is not own)
        beside = state_with(comparison, nominals, others, noise)
        tried = hypotheses(beside, own)
        if others and _needless(tried, own):
            rest = settled(beside, others)
            return reconsidered(comparison, nominals, noise, _without(again, number), rest)
        answers = worth_telling(beside, tried)
        chosen = choice(beside, answers)
        if chosen is None or chosen.found is None or chosen.axis is None:
            continue
        again[number] = Step(again[number].state, _with_evidence_of(again[number].answers, answers), chosen)
        if (chosen.effect, chosen.axis) != (former.effect, former.axis):
            selected = in_order([*others, placed(comparison, chosen.axis, chosen.found.effect)])
            selected = settled(state_with(comparison, nominals, selected, noise), selected)
    return again, selected


def _needless(answers: Sequence[Hypothesis], own: PlacedEffect) -> bool:
    """Whether an effect says less, beside the others, than that nothing more is missing."""
    plain = max(one.evidence for one in answers if one.found is None)
    return any((one.effect, one.axis) == (own.effect.name, own.axis) and one.evidence < plain for one in answers)


def _without(steps: Sequence[Step], number: int) -> list[Step]:
    """The steps as if one had not been: those after it take the place of those before them."""
    rest = [*steps[:number], *steps[number + 1 :]]
    return [replace(one, state=step.state) for step, one in zip(steps, rest, strict=False)]


def _with_evidence_of(former: Sequence[Hypothesis], later: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The later answers; what was only tried at first keeps its place behind them."""
    known = {(one.effect, one.axis) for one in later}
    least = min(one.evidence for one in later)
    rest = [replace(one, evidence=min(one.evidence, least)) for one in former if (one.effect, one.axis) not in known]
    return [*later, *rest]


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


def in_order(effects: Sequence[PlacedEffect]) -> tuple[PlacedEffect, ...]:
    """Effects in the order in which torque passes them, what the model has first."""
    return tuple(sorted(effects, key=lambda one: (ORDER[one.effect.family], one.effect.name not in PARAMETERS)))


def placed(comparison: Comparison, axis: str, effect: Effect) -> PlacedEffect:
    """An effect on an axis, its parameters' units filled in."""
    joint = comparison.simulation.model.joint(comparison.simulation.drives[axis].joint)
    units = {parameter.name: parameter.unit.on(int(joint.type[0])) for parameter in type(effect).parameters}
    return PlacedEffect(axis, effect, units)


def choice(state: State, answers: Sequence[Hypothesis]) -> Hypothesis | None:
    """The most evident answer, where it is an effect that beats the model as it is and shrinks enough of what is left."""
    best = next((one for one in answers if one.found is not None), None)
    if best is None:
        return None
    nothing = max(answer.evidence for answer in answers if answer.found is None)
    if best.evidence < nothing + LEAST_EVIDENCE and not takes_much(state, best, answers):
        return None
    return best if matters(state, best, answers) else None


def worth_telling(state: State, answers: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Without effects that hardly cost anything: they are but another name for nothing more. Nor a `none` that is refuted."""
    return without_refuted(state, [one for one in answers if one.found is None or matters(state, one, answers)])


def without_refuted(state: State, answers: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Without `none` where an effect is chosen that stands behind it.

    The model to the letter moves no parameter, which costs it nothing; while two strong effects are missing few rows count, and
    that alone can put it before the one that takes most of a gap far above the floor.
    """
    chosen = choice(state, answers)
    return [one for one in answers if one.effect != NONE or chosen is None or one.evidence < chosen.evidence]


def takes_much(state: State, best: Hypothesis, answers: Sequence[Hypothesis]) -> bool:
    """Whether an answer takes a good share of what is left on an axis.

    While a second strong effect is missing the residual remembers for seconds, and few rows are left to bring evidence: the
    choice is made all the same, and made again beside what is found later (`reconsidered`).
    """
    plain = next(answer for answer in answers if answer.effect == NOMINAL)
    for axis in state.regression.axes:
        rows = max(state.regression.rows[axis], 1)
        taken = (plain.held_out[axis] - best.held_out[axis]) / rows
        if taken > max(MUCH * plain.held_out[axis] / rows, MUCH_OF_FLOOR * state.noise[axis] ** 2):
            return best.evidence > plain.evidence
    return False


def matters(state: State, best: Hypothesis, answers: Sequence[Hypothesis]) -> bool:
    """Whether an answer shrinks what is left on some axis by enough to be more than the comparison's own errors."""
    if best.drive_gain > 0.0:
        return True
    plain = next(answer for answer in answers if answer.found is None)  # parameters far off may have taken the effect's place
    for axis in state.regression.axes:
        rows = max(state.regression.rows[axis], 1)
        taken = (plain.held_out[axis] - best.held_out[axis]) / rows
        first = _square(state.comparison.target[axis])
        least = max(LEAST_OF_FLOOR * state.noise[axis] ** 2, LEAST_SHARE * first)
        if taken > least:
            return True
        if best.found is None or first < state.noise[axis] ** 2:
            continue
        absorbed = plain.prior_cost - best.prior_cost
        size = _square(best.found.column.get(axis, NOTHING))
        if absorbed > STRAIN and size > LEAST_OF_FLOOR * state.noise[axis] ** 2:
            return True
        if absorbed > ABSORBED and size > least:
            return True
    return False


def something_left(state: State) -> bool:
    """Whether any axis still has a gap worth a search."""
    for axis in state.regression.axes:
        left = _square(state.residual[axis]) - state.noise[axis] ** 2
        if left > max(LEAST_OF_FLOOR * state.noise[axis] ** 2, LEAST_SHARE * _square(state.comparison.target[axis])):
            return True
    return False


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
        total += _square(np.sum(columns, axis=0)) / state.noise[axis] ** 2
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


def strained(state: State) -> bool:
    """Whether parameters of the model must be so far off that an effect may be behind it."""
    return state.regression.fit().prior_cost > STRAIN


def _drive_left(step: Step) -> bool:
    """Whether a drive gave another torque than its law asks for, beside what was chosen."""
    return any(one.drive_gain > LEAST_DRIVE and one is not step.chosen for one in step.answers)


def deviations(state: State, off: Sequence[Group]) -> list[Deviation]:
    """The groups with the amounts that a fit of the state's nominal parameters gives; numbers are of these."""
    fitted = state.regression.fit()
    spread = _standard_deviations(state.regression)
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


def _standard_deviations(regression: Regression) -> Array:
    return np.sqrt(np.maximum(np.diag(covariance(regression)), 0.0))


def covariance(regression: Regression, without_prior_from: int | None = None) -> Array:
    """Of the coefficients: rows weighted by residual and memory, priors included but for those from a number on."""
    size = len(regression.spreads)
    spreads = regression.spreads.copy()
    if without_prior_from is not None:
        spreads[without_prior_from:] = HARDLY_KNOWN
    gram = np.diag(1.0 / spreads**2)
    for axis in regression.axes:
        weighted = regression.matrix[axis] / regression.scale[axis]
        gram = gram + weighted.T @ weighted
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0.0] = 1.0
    return np.asarray(np.linalg.inv(gram / np.outer(scale, scale) + 1e-12 * np.eye(size)) / np.outer(scale, scale))


def _square(values: Array) -> float:
    return float(np.mean(values**2)) if len(values) else 0.0


def as_effects(comparison: Comparison, found: Sequence[Deviation]) -> list[PlacedEffect]:
    """Deviations of friction and of an axis's inertia as the effects that correct them."""
    kinds = library()
    corrected = []
    for off in (member for one in found for member in one.members):
        nominal = off.nominal
        if nominal.effect is None or nominal.axis is None:
            continue
        value = off.amount if nominal.effect == "inertia" else max(0.0, nominal.value + off.amount)
        parameter = kinds[nominal.effect].parameters[0]
        corrected.append(placed(comparison, nominal.axis, kinds[nominal.effect](**{parameter.name: value})))
    return corrected
