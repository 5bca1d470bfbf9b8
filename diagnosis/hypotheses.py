"""Every answer to one step's question, each with its evidence on data that it was not fitted to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from diagnosis.comparison import Column
from diagnosis.drive_search import drive_effects
from diagnosis.model_search import model_starts, polynomial
from diagnosis.nominal import like
from diagnosis.placing import PARAMETERS
from diagnosis.regression import FIRST_MEMORY, Fitted, Regression
from diagnosis.result import NONE
from diagnosis.search import BRIEFLY, EVALUATIONS, INNER, STARTS_REFINED, Found, coarse, less, moved
from diagnosis.side_by_side import side_by_side
from diagnosis.state import State, corrected_by_fit, memory, predictor, scales, state_with
from drivetwin.errors import UserError
from emulator.dynamics import AxisDynamics
from emulator.effects import AxisEffect, DriveEffect, Effect, ModelEffect, PlacedEffect, library
from emulator.effects.temperature_drift import TemperatureDrift

Array = NDArray[np.float64]

NOMINAL = "nominal"
"""The answer that nothing but parameters of the model is off."""
NOT_SEARCHED = ("belt_elasticity",)
OF_POSITION = frozenset(
    {"delay", "encoder_eccentricity", "gravity", "payload", "position_friction", "spring"}
    | {"torque_ripple", "transmission_error"}
)
"""Effects that are a function of the absolute position, or of the moment at which it was counted."""
MOST_DRIFT = 1.5
"""Times what was recorded, beyond which a time constant is no drift but another level."""
LEAST_GAIN = 2.0
"""Nats below which the coarse search is not refined."""
SHARE_OF_BEST = 0.35
"""Of the best coarse gain that another must have to be refined."""
NEARLY = 0.5
"""Of the best gain, from which a spring or a gap is searched once more with corrected parameters, which takes its time."""
MOST_TOLD = 3
"""Parameters of one effect that data tell apart: of a payload, its weight, its inertia and where it hangs."""
SEARCH_COST = 2.0
"""Nats for having looked at the whole library."""
PARAMETER_COST = 1.0
"""Nats a parameter that was fitted beside the folds."""
SAME_OF_FLOOR = 0.5
"""Of the squared floor, by which what is left must differ to tell an effect from a simpler one that it contains."""
DRIVE_MEMORY = 20.0
"""Rows of a drive's law that count as one."""
ROUNDS = 2
"""In which effects are moved in turn beside each other."""


@dataclass(frozen=True)
class Hypothesis:
    """One answer: an effect on an axis with what it costs, or `none` or "nominal" (axis None). `evidence` in nats.

    Of a drive's effect, `drive_gain` is what the drive's law brings to the evidence, `drive_left` the share of its squared
    error that stays.
    """

    effect: str
    axis: str | None
    found: Found | None
    held_out: Mapping[str, float]
    prior_cost: float
    parameters: int
    evidence: float = 0.0
    drive_gain: float = 0.0
    drive_left: float = 1.0


def hypotheses(state: State, known: PlacedEffect | None = None) -> list[Hypothesis]:
    """Every answer of this step, most evident first; among them an effect that is known, searched from where it is."""
    reference = state.regression.fit()
    sample = _sample_of(state)
    begun = _promising(_coarse(sample))
    if sample is not state:
        begun = _moved_on(sample, begun)
    tried = _refine(state, [*begun, *_start_at(state, known)])
    answers = [_of(found) for found in tried]
    answers.extend(_of_drives(state, reference))
    answers.append(_nominal(reference))
    if not state.selected:
        answers.append(_nothing(state))
    return rated(state, answers)


def in_place_of(
    state: State, kind: type[ModelEffect] | type[AxisEffect], axis: str, parameters: frozenset[int]
) -> float | None:
    """Nats by which an effect says more than nominal parameters, by number, that it stands for.

    None where the axis cannot have it, or nothing of it is felt.
    """
    changed = replace(state, regression=state.regression.standing_for(kind.name, axis, parameters))
    if issubclass(kind, ModelEffect):
        starts = model_starts(state.comparison, changed.regression, axis, kind)
    else:
        starts = coarse(state.comparison, changed.regression, axis, kind, state.dynamics[axis])
    tried = [_of(found) for found in _refine(changed, starts)]
    if not tried:
        return None
    answers = rated(changed, [*tried, _nominal(state.regression.fit())])
    evidence = {one.effect: one.evidence for one in answers}
    return evidence[kind.name] - evidence[NOMINAL]


def rated(state: State, answers: Sequence[Hypothesis]) -> list[Hypothesis]:
    """With their evidence, by as many rows of each axis as the best answer leaves independent; most evident first."""
    comparison, regression = state.comparison, state.regression
    at_first = {axis: regression.rows[axis] / FIRST_MEMORY for axis in regression.axes}
    best = max(answers, key=lambda one: _evidence(one, state, at_first))
    residual = _residual(state, best)
    independent = {axis: regression.rows[axis] / memory(comparison, axis, residual[axis]) for axis in regression.axes}
    told = [replace(answer, evidence=_evidence(answer, state, independent)) for answer in answers]
    return sorted(_simpler_first(state, told), key=lambda one: -one.evidence)


def _simpler_first(state: State, answers: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Play whose flanks alone, as elasticity, leave hardly more is not told from it: it is rated behind, by its gap."""
    springs = {one.axis: one for one in answers if one.effect == "elasticity"}
    told = []
    for one in answers:
        spring = springs.get(one.axis) if one.effect == "backlash" else None
        if spring is not None and spring.axis is not None and _as_little(state, spring.axis, one, spring):
            told.append(replace(one, evidence=min(one.evidence, spring.evidence - PARAMETER_COST)))
        else:
            told.append(one)
    return told


def _as_little(state: State, axis: str, one: Hypothesis, other: Hypothesis) -> bool:
    """Whether what two answers leave on an axis differs by less than the comparison's own errors."""
    more = (other.held_out[axis] - one.held_out[axis]) / max(state.regression.rows[axis], 1)
    return more < SAME_OF_FLOOR * state.noise[axis] ** 2


def _evidence(answer: Hypothesis, state: State, independent: Mapping[str, float]) -> float:
    fit = answer.drive_gain
    for axis in state.regression.axes:
        if state.regression.rows[axis]:
            left = answer.held_out[axis] / state.regression.rows[axis]
            fit -= 0.5 * independent[axis] * float(np.log(left + state.noise[axis] ** 2))
    searched = SEARCH_COST if answer.found is not None and answer.effect not in PARAMETERS else 0.0
    return float(fit - answer.prior_cost - searched - PARAMETER_COST * answer.parameters)


def _residual(state: State, answer: Hypothesis) -> dict[str, Array]:
    if answer.found is None:
        return state.regression.residual(state.regression.fit())
    return state.regression.residual(answer.found.fitted, target=less(state.regression.target, answer.found.column))


def _of(found: Found) -> Hypothesis:
    name = found.effect.name
    count = min(len(type(found.effect).parameters), MOST_TOLD)
    return Hypothesis(name, found.axis, found, found.fitted.held_out, found.fitted.prior_cost, count)


def _of_drives(state: State, reference: Fitted) -> list[Hypothesis]:
    """Effects of the drives: the plant is left as it is, what the drive's law does not tell shrinks."""
    chosen = {(placed.effect.name, placed.axis) for placed in state.selected}
    answers = []
    axes, known = state.comparison.simulation.axes, state.comparison.drives
    if not known:
        known.update(zip(axes, side_by_side(partial(drive_effects, state.comparison), axes), strict=True))
    for axis in axes:
        for found in known[axis]:
            if (found.effect.name, axis) in chosen:
                continue
            floor = state.noise[axis] ** 2
            gain = 0.5 * found.rows / DRIVE_MEMORY * float(np.log((found.without + floor) / (found.left + floor)))
            left = max(0.0, found.left - floor) / max(found.without - floor, 1e-12 * found.without, 1e-300)
            here = Found(axis, found.effect, {}, reference)
            plain = Hypothesis(found.effect.name, axis, here, reference.held_out, reference.prior_cost, 1)
            answers.append(replace(plain, drive_gain=gain, drive_left=left))
    return answers


def _nominal(reference: Fitted) -> Hypothesis:
    """Nothing but parameters of the model that are a little off; or, where effects are selected, nothing more."""
    return Hypothesis(NOMINAL, None, None, reference.held_out, reference.prior_cost, 0)


def _nothing(state: State) -> Hypothesis:
    """The simulation as it stands."""
    exact = {axis: float(rows @ rows) for axis, rows in state.regression.target.items()}
    return Hypothesis(NONE, None, None, exact, 0.0, 0)


def _sample_of(state: State) -> State:
    """The state on as much of the recordings as a coarse search needs."""
    sample = state.comparison.sample
    if sample is state.comparison:
        return state
    return state_with(sample, like(state.nominals, sample), state.selected, state.noise)


def _coarse(state: State) -> list[tuple[Found, float]]:
    """The best starts of every effect on every axis, each with the nats that it brings."""
    asked = list(_asked(state))
    of_axes = [(axis, kind) for axis, kind in asked if issubclass(kind, AxisEffect)]
    of_model = [(axis, kind) for axis, kind in asked if issubclass(kind, ModelEffect)]
    comparison, regression = state.comparison, state.regression
    found = side_by_side(lambda one: coarse(comparison, regression, *one, state.dynamics[one[0]]), of_axes)
    found.extend(model_starts(comparison, regression, *one) for one in of_model)
    least = regression.evidence(regression.fit())
    return [(one, regression.evidence(one.fitted) - least) for starts in found for one in starts]


def _asked(state: State) -> Iterator[tuple[str, type[Effect]]]:
    """Every axis with every effect that it may have and that is not selected yet."""
    chosen = {(placed.effect.name, placed.axis) for placed in state.selected}
    for axis in state.comparison.simulation.axes:
        if state.regression.rows[axis] == 0:
            continue
        for name, kind in library().items():
            if name in NOT_SEARCHED or (name, axis) in chosen:
                continue
            if not (axis in state.comparison.relative and name in OF_POSITION):
                yield axis, kind


def _promising(coarse_found: Sequence[tuple[Found, float]]) -> list[Found]:
    """Starts that bring enough to be refined, best first."""
    best = max((gain for _, gain in coarse_found), default=0.0)
    enough = [(one, gain) for one, gain in coarse_found if gain >= max(LEAST_GAIN, SHARE_OF_BEST * best)]
    return [found for found, _ in sorted(enough, key=lambda pair: -pair[1])]


def _start_at(state: State, known: PlacedEffect | None) -> list[Found]:
    """A known effect as a start; a drive's is no matter of a local search."""
    if known is None or isinstance(known.effect, DriveEffect):
        return []
    return [Found(known.axis, known.effect, {}, state.regression.fit())]


def _refine(state: State, begun: Sequence[Found]) -> list[Found]:
    """Each effect on each axis where least is left, springs and gaps with what is fitted behind them."""
    return _corrected_where_near(state, _best_of_each(state, begun))


def _moved_on(sample: State, begun: Sequence[Found]) -> list[Found]:
    """Starts moved to where less is left of a sample; where that ends nowhere, as they were."""
    found = _best_of_each(sample, begun)
    moved_on = {_answer(one) for one in found}
    return [*found, *(one for one in begun if _answer(one) not in moved_on)]


def _best_of_each(state: State, begun: Sequence[Found]) -> list[Found]:
    """Each effect on each axis as the best of its local searches leaves it, but for those that make no mechanism."""
    regression = state.regression
    for one in begun:
        if isinstance(one.effect, ModelEffect):
            polynomial(state.comparison, one.axis, type(one.effect))  # in threads each call of MuJoCo would pass the lock on
    begun = shortlist(state, begun)
    searched = side_by_side(partial(_searched_or_none, state, EVALUATIONS), begun)
    done: dict[tuple[str, str], Found] = {}
    for start, better in zip(begun, searched, strict=True):
        if better is None or not _makes_a_mechanism(state, better):
            continue
        if isinstance(better.effect, TemperatureDrift) and better.effect.time_constant > MOST_DRIFT * state.comparison.span:
            continue
        key = _answer(start)
        known = done.get(key)
        if known is None or regression.evidence(better.fitted) > regression.evidence(known.fitted):
            done[key] = better
    return list(done.values())


def shortlist(state: State, begun: Sequence[Found]) -> list[Found]:
    """The starts worth a whole local search: of many of one effect on one axis, the best once all have been moved a little."""
    chosen: list[Found] = []
    for _, group in groupby(sorted(begun, key=_answer), key=_answer):
        same = list(group)
        if same[0].effect.family == INNER and len(same) > STARTS_REFINED:
            tried = side_by_side(partial(_searched_or_none, state, BRIEFLY), same)
            same = sorted(filter(None, tried), key=lambda one: -state.regression.evidence(one.fitted))[:STARTS_REFINED]
        chosen.extend(same)
    return chosen


def _answer(found: Found) -> tuple[str, str]:
    return found.effect.name, found.axis


def _corrected_where_near(state: State, found: Sequence[Found]) -> list[Found]:
    """Springs and gaps that bring nearly as much as the best, with the axis's friction and inertia as fitted behind them."""
    least = state.regression.evidence(state.regression.fit())
    gains = [state.regression.evidence(one.fitted) - least for one in found]
    near = max(LEAST_GAIN, NEARLY * max(gains, default=0.0))
    return [
        _with_corrections(state, one) if one.effect.family == INNER and gain >= near else one
        for one, gain in zip(found, gains, strict=True)
    ]


def _makes_a_mechanism(state: State, found: Found) -> bool:
    try:
        state.comparison.simulation.dynamics((*state.selected, PlacedEffect(found.axis, found.effect, {})))
    except UserError:
        return False
    return True


def _searched_or_none(state: State, evaluations: int, start: Found) -> Found | None:
    try:
        return _searched(state, start.effect, start.axis, state.dynamics, evaluations)
    except UserError:
        return None


def _searched(
    state: State, start: Effect, axis: str, dynamics: Mapping[str, AxisDynamics], evaluations: int = EVALUATIONS
) -> Found:
    """An effect moved to where least is left, and everything else fitted beside it."""
    predict = predictor(state.comparison, axis, start, dynamics)
    held = state.regression.replaced_by(start.name, axis)
    effect = moved(_weighed(state, predict(start), held), start, predict, held, evaluations)
    column = predict(effect)
    fitted = _weighed(state, column, held).fit(target=less(state.regression.target, column), held=held)
    return Found(axis, effect, column, fitted)


def _with_corrections(state: State, found: Found) -> Found:
    """The same behind which the axis moves by its friction and inertia as fitted, where that leaves less."""
    corrected = corrected_by_fit(state, found.fitted)
    try:
        again = _searched(state, found.effect, found.axis, state.comparison.simulation.dynamics((*corrected, *state.selected)))
        state.comparison.simulation.dynamics((*corrected, *state.selected, PlacedEffect(found.axis, again.effect, {})))
    except UserError:
        return found
    return max(found, again, key=lambda one: state.regression.evidence(one.fitted))


def _weighed(state: State, column: Column, held: frozenset[int]) -> Regression:
    """The regression, its rows weighed by what an effect leaves: nominal parameters move as far as beside a selected one.

    By what is left without it, they would hardly move where the effect is large, and another that looks like their deviation
    would be taken in its place.
    """
    target = less(state.regression.target, column)
    left = state.regression.residual(state.regression.fit(target=target, held=held), target=target)
    return state.regression.rescaled(scales(state.comparison, left, state.noise))


def settled(
    state: State, selected: tuple[PlacedEffect, ...], scale: Mapping[str, float] | None = None
) -> tuple[PlacedEffect, ...]:
    """The selected effects, each moved in turn to where least is left beside the others and the nominal parameters.

    `scale` weighs the rows of each axis; without it, what stands without the effect that is moved does: nominal parameters are
    held more firmly then, while other effects may still be missing. One without which the others make no mechanism stays.
    """
    comparison, nominals = state.comparison, state.nominals
    for _ in range(ROUNDS if len(selected) > 1 else 1):
        for number, placed in enumerate(selected):
            if isinstance(placed.effect, DriveEffect):
                continue
            others = selected[:number] + selected[number + 1 :]
            try:
                beside = state_with(comparison, nominals, others, state.noise)
                dynamics = comparison.simulation.dynamics((*state.corrected, *others))
                predict = predictor(comparison, placed.axis, placed.effect, dynamics)
                weighed = beside.regression.rescaled(scale or beside.regression.scale)
                held = weighed.replaced_by(placed.effect.name, placed.axis)
                effect = moved(weighed, placed.effect, predict, held)
                changed = (*selected[:number], replace(placed, effect=effect), *selected[number + 1 :])
                comparison.simulation.dynamics(changed)
            except UserError:
                continue
            selected = changed
    return selected
