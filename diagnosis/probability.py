"""From evidence to probabilities: every effect, `unknown` and `none` of one step share one distribution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, log

import numpy as np

from diagnosis.comparison import Array, Comparison
from diagnosis.deviations import Deviation, costliest
from diagnosis.hypotheses import NOMINAL
from diagnosis.result import NONE, UNKNOWN, Prediction
from diagnosis.selection import Selection, Step
from diagnosis.state import State

TEMPERATURE = 4.0
"""Nats of evidence that count as one: residuals err in common, so that rows tell less than they seem to."""
DOUBT = 0.01
"""Probability that is never given away: the plant is none of the hypotheses to the letter."""
UNKNOWN_FROM, UNKNOWN_WIDTH = 0.14, 0.025
"""Share of the fitted gap left after every effect, at which `unknown` is as likely as not, and how sharply so."""
UNSEEN_FROM, UNSEEN_WIDTH = 0.5, 0.05
"""The same of motion that was not fitted: known causes leave more there, where other motion brings gaps of its own."""
SAME_SPEED = 1.5
"""Factor within which speeds count as the same, where means over a speed are taken."""

@dataclass(frozen=True)
class Answer:
    """One answer of a step with its probability; the axis of `none` is None. `number`: of the hypothesis among the step's."""

    effect: str
    axis: str | None
    probability: float
    number: int | None


@dataclass(frozen=True)
class Unseen:
    """Motion that was not fitted, and what is predicted of it with every cause added.

    `only_fitted`: rms of the gap on the fitted motion [N·m or N], of axes that show none on this one.
    """

    comparison: Comparison
    predictions: Sequence[Prediction]
    noise: Mapping[str, float]
    only_fitted: Mapping[str, float] = field(default_factory=dict)

    def left(self, axis: str) -> float:
        """Share of the squared gap of an axis above the floor that no cause takes; 0 where it has no gap there.

        Where nothing is to be closed, a cause must at least not bring a gap: what stands is held against the gap that it was
        fitted to.
        """
        parts = [each.axes[axis] for each in self.predictions]
        if axis in self.only_fitted:
            before = max(0.0, (self.only_fitted[axis] / self.noise[axis]) ** 2 - 1.0)
        else:
            before = self._above(axis, [part.measured - part.before for part in parts])
        after = self._above(axis, [part.measured - part.after for part in parts])
        return after / before if before > 0.0 else 0.0

    def _above(self, axis: str, gaps: Sequence[Array]) -> float:
        return _above_floor(self.comparison, axis, self.comparison.picked(axis, gaps), self.noise[axis])


def worst_axis(final: State) -> str:
    """Where most is left, against the floor."""
    left = _excess(final, final.residual)
    return max(left, key=lambda axis: left[axis])


def step_left(step: Step, final: State) -> float:
    """Share of the squared gap above the floor that no effect takes.

    Of a step in which an effect was chosen, on its axis, and of the gap as it was at first: what it does to other axes is only
    half modelled (docs/diagnosis.md). Of the last one, on all axes, weighed by their floors, and of what stood before it.
    """
    if step.chosen is not None and step.chosen.axis is not None:
        axis = step.chosen.axis
        before, after = _excess(step.state, step.state.comparison.target), _excess(final, final.residual)
        return _share({axis: before[axis]}, {axis: after[axis]})
    before = _excess(step.state, step.state.comparison.target if step.chosen is not None else step.state.regression.target)
    return _share(before, _excess(final, final.residual))


def answers_of(step: Step, selection: Selection, unseen: Unseen) -> list[Answer]:
    """Probabilities of one step, largest first."""
    unknown = unknown_of(step, selection, unseen)
    evidence = np.array([one.evidence for one in step.answers])
    weights = np.exp((evidence - evidence.max()) / TEMPERATURE)
    shares = (1.0 - DOUBT) * weights / weights.sum() + DOUBT / len(weights)
    told: list[Answer] = [Answer(UNKNOWN, worst_axis(selection.final), unknown, None)]
    for number, (one, share) in enumerate(zip(step.answers, shares, strict=True)):
        part = float(share) * (1.0 - unknown)
        if one.effect == NOMINAL:
            told.append(_parameters(step, selection, part))
        else:
            told.append(Answer(one.effect, one.axis, part, number))
    return merged(told)


def unknown_of(step: Step, selection: Selection, unseen: Unseen) -> float:
    """Probability of `unknown` in one step, by what is left of the motion that was fitted or of that which was not.

    What is fitted closely and predicts nothing new is no cause: a foreign effect passes for a known one on the motion that
    shaped it. Of unseen motion the axis of the step's effect counts; others may have causes of their own.
    """
    if step.chosen is not None and step.chosen.drive_gain > 0.0:
        return unknown_probability(min(1.0, step.chosen.drive_left))
    if not has_gap(step):
        return 0.0
    fitted = unknown_probability(step_left(step, selection.final))
    if step.chosen is None or step.chosen.axis is None:
        return fitted
    return max(fitted, _logistic((unseen.left(step.chosen.axis) - UNSEEN_FROM) / UNSEEN_WIDTH))


def answers_of_deviation(left: Sequence[Deviation]) -> list[Answer]:
    """A step after the effects: which parameter of the model is off, if any."""
    weights = {(one.effect, one.axis): _bounded(one.evidence) for one in left}
    whole = sum(weights.values()) + 1.0
    given = DOUBT / (len(weights) + 1)
    told = [Answer(effect, axis, (1.0 - DOUBT) * weight / whole + given, None) for (effect, axis), weight in weights.items()]
    return merged([*told, Answer(NONE, None, (1.0 - DOUBT) / whole + given, None)])


def has_gap(step: Step) -> bool:
    """Whether anything above the floor stood before the step."""
    return sum(_excess(step.state, step.state.regression.target).values()) > 0.0


def unknown_probability(left: float) -> float:
    """That the gap is an effect outside the library, from the share of what was fitted that no effect of it explains."""
    return _logistic((left - UNKNOWN_FROM) / UNKNOWN_WIDTH)


def _logistic(value: float) -> float:
    return 1.0 / (1.0 + exp(-max(-50.0, min(50.0, value))))


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
    return {axis: _above_floor(state.comparison, axis, values, state.noise[axis]) for axis, values in rows.items()}


def _above_floor(comparison: Comparison, axis: str, rows: Array, floor: float) -> float:
    if not len(rows):
        return 0.0
    told = rows if axis not in comparison.relative else means_over_speed(comparison, axis, rows)
    square = float(np.average(told**2, weights=comparison.durations(axis)))
    return max(0.0, square / floor**2 - 1.0)


def _share(before: Mapping[str, float], after: Mapping[str, float]) -> float:
    whole = sum(before.values())
    return sum(after.values()) / whole if whole > 0.0 else 0.0


def means_over_speed(comparison: Comparison, axis: str, rows: Array) -> Array:
    """Rows of an axis whose position is relative, as means over each recording's stretches of about one speed.

    What is a function of the position has no place on such an axis, and no effect may be named for it; it averages out here,
    and what depends on speed and direction stays.
    """
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
