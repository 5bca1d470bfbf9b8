"""One distribution a step: it adds up to 1, evidence is odds, and `unknown` takes what no effect explains."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import numpy as np
import pytest
from rig_bench import compared, strokes

from diagnosis.prepare.rows import Comparison
from diagnosis.deviations import Deviation
from diagnosis.hypotheses import Hypothesis
from diagnosis.probability import (
    DOUBT,
    TEMPERATURE,
    UNKNOWN_FROM,
    UNSEEN_FROM,
    Answer,
    Unseen,
    answers_of,
    answers_of_deviation,
    merged,
    step_left,
    unknown_probability,
    worst_axis,
)
from diagnosis.regression import Regression
from diagnosis.report.result import AxisPrediction, Prediction
from diagnosis.selection import Selection, Step
from diagnosis.state import State

NOISE = {"turn": 0.1, "lift": 0.5}


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, 12.0))


def state(comparison: Comparison, turn: float, lift: float) -> State:
    """A state in which so many times the noise is left on the two axes, whatever time they are at, and nothing is free."""
    levels = {"turn": turn * NOISE["turn"], "lift": lift * NOISE["lift"]}
    target = {axis: np.full(len(comparison.target[axis]), level) for axis, level in levels.items()}
    regression = Regression(comparison, [], [], target, dict.fromkeys(NOISE, 1.0), NOISE, {})
    return State(comparison, [], (), comparison.simulation.dynamics(), regression, NOISE)


def unseen(comparison: Comparison, before: float, after: float) -> Unseen:
    """Motion that was not fitted, on whose column so many times the noise stands before and after; nothing on the lift."""
    predictions = []
    for run in comparison.runs:
        none = np.zeros(len(run.recording.time))
        first, last = none - before * NOISE["turn"], none - after * NOISE["turn"]
        turn = AxisPrediction(first, last, none, none == 0.0, none, none, none)
        lift = AxisPrediction(none, none, none, none == 0.0, none, none, none)
        predictions.append(Prediction(run.recording.name, run.recording.time, {"turn": turn, "lift": lift}))
    return Unseen(comparison, predictions, NOISE)


def hypothesis(effect: str, axis: str | None, evidence: float, drive_gain: float = 0.0, drive_left: float = 1.0) -> Hypothesis:
    return Hypothesis(effect, axis, None, {}, 0.0, 1, evidence, drive_gain, drive_left)


ANSWERS = (hypothesis("stribeck", "turn", -100.0), hypothesis("presliding", "turn", -108.0), hypothesis("none", None, -130.0))


def told(comparison: Comparison, left: float, answers: tuple[Hypothesis, ...] = ANSWERS) -> dict[tuple[str, str | None], float]:
    """Probabilities of a last step before which the column had 10 times its noise, and after which `left` times are."""
    step = Step(state(comparison, 10.0, 1.0), answers, None)
    found = answers_of(step, Selection([step], (), (), state(comparison, left, 1.0)), unseen(comparison, 10.0, 1.0))
    assert sum(one.probability for one in found) == pytest.approx(1.0)
    assert [one.probability for one in found] == sorted((one.probability for one in found), reverse=True)
    return {(one.effect, one.axis): one.probability for one in found}


def test_evidence_is_odds_by_the_temperature_but_for_the_doubt(comparison: Comparison) -> None:
    found = told(comparison, 1.0)
    weights = np.array([1.0, exp(-8.0 / TEMPERATURE), exp(-30.0 / TEMPERATURE)])
    shares = (1.0 - DOUBT) * weights / weights.sum() + DOUBT / 3.0
    effects = [found["stribeck", "turn"], found["presliding", "turn"], found["none", None]]
    np.testing.assert_allclose(effects, (1.0 - found["unknown", "turn"]) * shares)


def test_unknown_is_told_from_the_share_that_is_left(comparison: Comparison) -> None:
    """Of the square above the noise: (3² - 1) / (10² - 1) = 0.08, (4² - 1) / 99 = 0.15, (9² - 1) / 99 = 0.81."""
    assert told(comparison, 3.0)["unknown", "turn"] == pytest.approx(unknown_probability(8.0 / 99.0))
    assert told(comparison, 4.0)["unknown", "turn"] == pytest.approx(unknown_probability(15.0 / 99.0))
    assert told(comparison, 9.0)["unknown", "turn"] > 0.99
    assert told(comparison, 1.0)["unknown", "turn"] < 0.02


def test_unknown_is_as_likely_as_not_at_its_limit_and_grows_with_what_is_left() -> None:
    assert unknown_probability(UNKNOWN_FROM) == 0.5
    shares = [unknown_probability(left) for left in np.linspace(0.0, 1.0, 11)]
    assert shares == sorted(shares)
    assert unknown_probability(1e9) == pytest.approx(1.0)


def test_what_is_left_is_weighed_by_the_noise_of_each_axis(comparison: Comparison) -> None:
    step = Step(state(comparison, 3.0, 5.0), ANSWERS, None)
    assert step_left(step, state(comparison, 1.0, 3.0)) == pytest.approx(8.0 / (8.0 + 24.0))
    assert step_left(step, state(comparison, 0.2, 0.3)) == 0.0


def test_unknown_is_on_the_axis_where_most_is_left(comparison: Comparison) -> None:
    assert worst_axis(state(comparison, 2.0, 3.0)) == "lift"
    assert worst_axis(state(comparison, 3.0, 2.0)) == "turn"


def chosen(comparison: Comparison, on_unseen: Unseen) -> float:
    """Probability of `unknown` where an effect explains all that was fitted."""
    step = Step(state(comparison, 10.0, 1.0), ANSWERS, ANSWERS[0])
    found = answers_of(step, Selection([step], (), (), state(comparison, 1.0, 1.0)), on_unseen)
    return next(one.probability for one in found if one.effect == "unknown")


def test_what_explains_only_the_motion_that_shaped_it_is_unknown(comparison: Comparison) -> None:
    assert chosen(comparison, unseen(comparison, 10.0, 1.0)) < 0.02
    assert chosen(comparison, unseen(comparison, 10.0, 9.0)) > 0.99
    half = np.sqrt(1.0 + UNSEEN_FROM * 99.0)
    assert chosen(comparison, unseen(comparison, 10.0, float(half))) == pytest.approx(0.5)


def test_what_an_effect_does_to_other_axes_makes_it_no_stranger(comparison: Comparison) -> None:
    """A spring in one joint shakes the others: nothing is left on its own axis, much on another."""
    gap = replace(comparison)
    gap.__dict__["target"] = {axis: np.full(len(rows), 10.0 * NOISE[axis]) for axis, rows in comparison.target.items()}
    step = Step(state(gap, 10.0, 10.0), ANSWERS, ANSWERS[0])
    assert step_left(step, state(gap, 1.0, 9.0)) == 0.0
    assert step_left(step, state(gap, 9.0, 1.0)) == pytest.approx(80.0 / 99.0)


def test_unseen_motion_without_a_gap_says_nothing(comparison: Comparison) -> None:
    assert unseen(comparison, 0.9, 0.9).left("turn") == 0.0
    assert chosen(comparison, unseen(comparison, 0.9, 3.0)) < 0.02


def test_a_cause_of_a_gap_that_has_died_out_must_not_bring_one(comparison: Comparison) -> None:
    """The unseen motion shows 1.2 times the noise, which is no gap; what was fitted had 10 times."""
    for after, share in ((1.2, (1.2**2 - 1.0) / 99.0), (9.0, 80.0 / 99.0)):
        seen = replace(unseen(comparison, 1.2, after), only_fitted={"turn": 10.0 * NOISE["turn"]})
        assert seen.left("turn") == pytest.approx(share)
    kept = replace(unseen(comparison, 1.2, 1.2), only_fitted={"turn": 10.0 * NOISE["turn"]})
    assert chosen(comparison, kept) < 0.02
    spoiled = replace(unseen(comparison, 1.2, 9.0), only_fitted={"turn": 10.0 * NOISE["turn"]})
    assert chosen(comparison, spoiled) > 0.99


def test_nothing_is_unknown_where_there_is_no_gap(comparison: Comparison) -> None:
    step = Step(state(comparison, 0.9, 0.9), ANSWERS, None)
    found = answers_of(step, Selection([step], (), (), step.state), unseen(comparison, 0.9, 0.9))
    assert next(one.probability for one in found if one.effect == "unknown") == 0.0


def test_a_drive_is_unknown_by_what_its_own_law_leaves(comparison: Comparison) -> None:
    """The plant's residual has nothing to do with it."""
    drive = hypothesis("torque_saturation", "turn", -90.0, drive_gain=40.0, drive_left=0.5)
    step = Step(state(comparison, 10.0, 1.0), (drive, *ANSWERS), drive)
    found = answers_of(step, Selection([step], (), (), state(comparison, 1.0, 1.0)), unseen(comparison, 10.0, 10.0))
    assert next(one.probability for one in found if one.effect == "unknown") == pytest.approx(unknown_probability(0.5))


def test_the_same_answer_twice_is_one_answer() -> None:
    found = merged([Answer("none", None, 0.1, None), Answer("delay", "turn", 0.3, 4), Answer("none", None, 0.4, 2)])
    assert found == [Answer("none", None, pytest.approx(0.625), 2), Answer("delay", "turn", pytest.approx(0.375), 4)]


def test_parameters_that_are_off_share_a_step_with_nothing_more() -> None:
    one, other = Deviation("inertia", "turn", (), 20.0), Deviation("viscous", "lift", (), 6.0)
    found = answers_of_deviation([other, one])
    assert [each.effect for each in found] == ["inertia", "viscous", "none"]
    assert sum(each.probability for each in found) == pytest.approx(1.0)


def test_no_parameter_is_off_for_certain() -> None:
    found = answers_of_deviation([Deviation("inertia", "turn", (), 1e6)])
    assert found[0].probability == pytest.approx(1.0 - 0.5 * DOUBT, abs=1e-4)
