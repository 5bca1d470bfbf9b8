"""Step by step: which effect next, until none is better than nothing more; then the model's own parameters that are off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.comparison import Comparison
from diagnosis.deviations import Deviation, deviations, forward, freed_where_far_off, mean_square, renumbered
from diagnosis.hypotheses import NOMINAL, Hypothesis, hypotheses, settled
from diagnosis.nominal import Nominal
from diagnosis.placing import in_order, placed
from diagnosis.result import NONE
from diagnosis.state import State, state_with
from drivetwin.errors import UserError
from emulator.effects import PlacedEffect

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
ABSORBED = 1.5
"""Nats by which parameters of the model must be further off without an effect, to count as standing in for it."""
MUCH, MUCH_OF_FLOOR = 0.12, 4.0
"""Shares of the squared residual and of the squared floor that are much."""
TENTATIVE = 4.0
"""Nats by which what takes much may be behind parameters that are a little off: it must prove itself beside a second effect."""
SURE = 20.0
"""Nats over parameters that are a little off, from which it is not asked how large the first gap was."""
MOST_OF_LEFT, SOME_OF_FLOOR = 0.5, 0.25
"""Shares of the squared residual, and beside another effect of the squared floor, that an effect must take then."""

NOTHING = np.zeros(1)


@dataclass(frozen=True)
class Step:
    """One step's answers, most evident first, in the state in which they were tried, and which one was selected, if any."""

    state: State
    answers: Sequence[Hypothesis]
    chosen: Hypothesis | None


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
    if len(selected) == 1 and is_tentative(steps[0]):
        state, selected = steps[0].state, ()
        steps = [Step(state, steps[0].answers, None)]
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
        try:
            beside = state_with(comparison, nominals, others, noise)
        except UserError:  # a viscous friction, say, without which its asymmetry would push
            continue
        tried = hypotheses(beside, own)
        if others and _needless(beside, tried, own):
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


def _needless(state: State, answers: Sequence[Hypothesis], own: PlacedEffect) -> bool:
    """Whether an effect says less, beside the others, than that nothing more is missing; or takes next to nothing."""
    plain = max((one for one in answers if one.found is None), key=lambda one: one.evidence)
    known = next((one for one in answers if (one.effect, one.axis) == (own.effect.name, own.axis)), None)
    return known is not None and (known.evidence < plain.evidence or _takes_nothing(state, known, plain))


def _takes_nothing(state: State, one: Hypothesis, plain: Hypothesis) -> bool:
    """Whether an effect of the plant shrinks nothing that stands above the comparison's own errors, and spares no parameter."""
    if one.drive_gain > 0.0 or plain.prior_cost - one.prior_cost > ABSORBED:
        return False
    rows = {axis: max(count, 1) for axis, count in state.regression.rows.items()}
    taken = {axis: (plain.held_out[axis] - one.held_out[axis]) / rows[axis] for axis in rows}
    return all(taken[axis] < SOME_OF_FLOOR * state.noise[axis] ** 2 for axis in taken)


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
            return best.evidence > plain.evidence - TENTATIVE
    return False


def is_tentative(step: Step) -> bool:
    """Whether what was chosen says less than that parameters are a little off."""
    plain = next(answer for answer in step.answers if answer.effect == NOMINAL)
    return step.chosen is not None and step.chosen.evidence <= plain.evidence


def matters(state: State, best: Hypothesis, answers: Sequence[Hypothesis]) -> bool:
    """Whether an answer shrinks what is left on some axis by enough to be more than the comparison's own errors."""
    if best.drive_gain > 0.0:
        return True
    plain = next(answer for answer in answers if answer.found is None)  # parameters far off may have taken the effect's place
    for axis in state.regression.axes:
        rows = max(state.regression.rows[axis], 1)
        taken = (plain.held_out[axis] - best.held_out[axis]) / rows
        first = mean_square(state.comparison.target[axis])
        least = max(LEAST_OF_FLOOR * state.noise[axis] ** 2, LEAST_SHARE * first)
        if taken > least:
            return True
        alone = not state.selected and axis == best.axis  # whether there is a gap at all the gap's own test says
        most = max(0.0 if alone else SOME_OF_FLOOR * state.noise[axis] ** 2, MOST_OF_LEFT * plain.held_out[axis] / rows)
        if best.evidence > plain.evidence + SURE and taken > most:
            return True
        if best.found is None or first < state.noise[axis] ** 2:
            continue
        absorbed = plain.prior_cost - best.prior_cost
        size = mean_square(best.found.column.get(axis, NOTHING))
        if absorbed > STRAIN and size > LEAST_OF_FLOOR * state.noise[axis] ** 2:
            return True
        if absorbed > ABSORBED and size > least:
            return True
    return False


def something_left(state: State) -> bool:
    """Whether any axis still has a gap worth a search."""
    for axis in state.regression.axes:
        left = mean_square(state.residual[axis]) - state.noise[axis] ** 2
        if left > max(LEAST_OF_FLOOR * state.noise[axis] ** 2, LEAST_SHARE * mean_square(state.comparison.target[axis])):
            return True
    return False


def strained(state: State) -> bool:
    """Whether parameters of the model must be so far off that an effect may be behind it."""
    return state.regression.fit().prior_cost > STRAIN


def _drive_left(step: Step) -> bool:
    """Whether a drive gave another torque than its law asks for, beside what was chosen."""
    return any(one.drive_gain > LEAST_DRIVE and one is not step.chosen for one in step.answers)
