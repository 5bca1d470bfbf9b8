"""From evidence to probabilities: every effect, `unknown` and `none` of one step share one distribution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from diagnosis.comparison import Array
from diagnosis.hypotheses import State
from diagnosis.result import NONE, UNKNOWN
from diagnosis.selection import Deviation, Selection, Step, costliest

TEMPERATURE = 4.0
"""Nats of evidence that count as one: residuals err in common, so that rows tell less than they seem to."""
DOUBT = 0.01
"""Probability that is never given away: the plant is none of the hypotheses to the letter."""
UNKNOWN_FROM = 0.22
"""Share of the gap left after every effect, at which `unknown` is as likely as not."""
SAME_SPEED = 1.5
"""Factor within which speeds count as the same, where means over a speed are taken."""
UNKNOWN_WIDTH = 0.05


@dataclass(frozen=True)
class Answer:
    """One answer of a step with its probability; the axis of `none` is None. `number`: of the hypothesis among the step's."""

    effect: str
    axis: str | None
    probability: float
    number: int | None


def worst_axis(final: State) -> str:
    """Where most is left, against the floor."""
    left = _excess(final, final.residual)
    return max(left, key=lambda axis: left[axis])


def step_left(step: Step, final: State) -> float:
    """Share of the squared gap above the floor that no effect takes, axes weighed by their floors.

    Of a step in which an effect was chosen, the share of the gap as it was at first; of the last one, of what stood before it.
    """
    before = _excess(step.state, step.state.comparison.target if step.chosen is not None else step.state.regression.target)
    after = _excess(final, final.residual)
    whole = sum(before.values())
    return sum(after.values()) / whole if whole > 0.0 else 0.0


def answers_of(step: Step, selection: Selection) -> list[Answer]:
    """Probabilities of one step, largest first."""
    unknown = unknown_of(step, selection)
    evidence = np.array([one.evidence for one in step.answers])
    weights = np.exp((evidence - evidence.max()) / TEMPERATURE)
    shares = (1.0 - DOUBT) * weights / weights.sum() + DOUBT / len(weights)
    told: list[Answer] = [Answer(UNKNOWN, worst_axis(selection.final), unknown, None)]
    for number, (one, share) in enumerate(zip(step.answers, shares, strict=True)):
        part = float(share) * (1.0 - unknown)
        if one.effect == "nominal":
            told.append(_parameters(step, selection, part))
        else:
            told.append(Answer(one.effect, one.axis, part, number))
    return merged(told)


def unknown_of(step: Step, selection: Selection) -> float:
    """Probability of `unknown` in one step."""
    if step.chosen is not None and step.chosen.drive_gain > 0.0:
        return unknown_probability(min(1.0, step.chosen.drive_left))
    return unknown_probability(step_left(step, selection.final)) if has_gap(step) else 0.0


def answers_of_deviation(left: Sequence[Deviation]) -> list[Answer]:
    """A step after the effects: which parameter of the model is off, if any."""
    weights = {(one.effect, one.axis): _bounded(one.evidence) for one in left}
    whole = sum(weights.values()) + 1.0
    told = [Answer(effect, axis, weight / whole, None) for (effect, axis), weight in weights.items()]
    return merged([*told, Answer(NONE, None, 1.0 / whole, None)])


def has_gap(step: Step) -> bool:
    """Whether anything above the floor stood before the step."""
    return sum(_excess(step.state, step.state.regression.target).values()) > 0.0


def unknown_probability(left: float) -> float:
    """That the gap is an effect outside the library, from the share that no effect of it explains."""
    return 1.0 / (1.0 + exp(-max(-50.0, min(50.0, (left - UNKNOWN_FROM) / UNKNOWN_WIDTH))))


def merged(told: Sequence[Answer]) -> list[Answer]:
    """Answers of the same effect on the same axis as one, largest first; they add up to 1."""
    by_name: dict[tuple[str, str | None], Answer] = {}
    for one in told:
        known = by_name.get((one.effect, one.axis))
        if known is None:
            by_name[(one.effect, one.axis)] = one
        else:
            number = known.number if known.number is not None else one.number
            by_name[(one.effect, one.axis)] = Answer(one.effect, one.axis, known.probability + one.probability, number)
    whole = sum(one.probability for one in by_name.values()) or 1.0
    found = [Answer(one.effect, one.axis, one.probability / whole, one.number) for one in by_name.values()]
    return sorted(found, key=lambda one: -one.probability)


def _parameters(step: Step, selection: Selection, part: float) -> Answer:
    """That parameters of the model are off: the one that is named first, which costs most; `none` where none is."""
    if step.chosen is None and step.state.selected == () and selection.deviations:
        first = selection.deviations[0]
        return Answer(first.effect, first.axis, part, None)
    if step.chosen is None or not has_gap(step):
        return Answer(NONE, None, part, None)
    most = costliest(step.state)
    return Answer(most.effect, most.axis, part, None)


def _bounded(evidence: float) -> float:
    return exp(min(evidence / TEMPERATURE, log(100.0))) * max(evidence, 1.0)


def _excess(state: State, rows: Mapping[str, Array]) -> dict[str, float]:
    """Mean square of rows above the floor, in squares of the floor, by axis."""
    found = {}
    for axis, values in rows.items():
        if not len(values):
            found[axis] = 0.0
            continue
        told = values if axis not in state.comparison.relative else means_over_speed(state, axis, values)
        square = float(np.average(told**2, weights=state.comparison.durations(axis)))
        found[axis] = max(0.0, square / state.noise[axis] ** 2 - 1.0)
    return found


def means_over_speed(state: State, axis: str, rows: Array) -> Array:
    """Rows of an axis whose position is relative, as means over each recording's stretches of about one speed.

    What is a function of the position has no place on such an axis, and no effect may be named for it; it averages out here,
    and what depends on speed and direction stays.
    """
    comparison = state.comparison
    velocities = comparison.in_time(axis, comparison.rows(axis, lambda _, own: own.motion.velocity))
    top = max(float(np.abs(velocity).max(initial=0.0)) for velocity in velocities)
    means = []
    for part, velocity in zip(comparison.in_time(axis, rows), velocities, strict=True):
        steps = np.log(np.maximum(np.abs(velocity), 1e-4 * top) / top) / np.log(SAME_SPEED)
        stretch = np.sign(velocity) * (1.0 - np.floor(steps))
        _, number = np.unique(stretch, return_inverse=True)
        sums = np.bincount(number, part) / np.maximum(np.bincount(number), 1)
        means.append(sums[number])
    return comparison.as_rows(axis, np.concatenate(means))
