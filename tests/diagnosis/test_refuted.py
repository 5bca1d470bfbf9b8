"""Which answer a step goes by: what brings least evidence by having moved nothing must not hide what takes most of a gap."""

from __future__ import annotations

import numpy as np
import pytest
from rig_bench import compared, strokes

from diagnosis import selection
from diagnosis.prepare.rows import Comparison
from diagnosis.hypotheses import Hypothesis
from diagnosis.propose.placing import placed
from diagnosis.regression import Regression
from diagnosis.propose.search import Found
from diagnosis.selection import Step, reconsidered, without_refuted
from diagnosis.state import State
from emulator.effects.transmission_error import TransmissionError

NOISE = {"turn": 0.1, "lift": 0.5}


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> State:
    """On whose column 15 times the noise stand."""
    comparison = compared(tmp_path_factory.mktemp("rig"), strokes(1, 12.0))
    target = {axis: np.full(len(rows), 15.0 * NOISE[axis]) for axis, rows in comparison.target.items()}
    return State(comparison, [], (), comparison.simulation.dynamics(), _plain(comparison, target), NOISE)


def _plain(comparison: Comparison, target: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]) -> Regression:
    return Regression(comparison, [], [], target, dict.fromkeys(NOISE, 1.0), NOISE, {})


def answer(state: State, effect: str, left: float, evidence: float) -> Hypothesis:
    """One that leaves so many times the noise on the column's held-out rows."""
    held_out = {axis: state.regression.rows[axis] * NOISE[axis] ** 2 for axis in NOISE}
    held_out["turn"] *= left**2
    plain = effect in ("none", "nominal")
    found = None if plain else Found("turn", TransmissionError(0.001, 2.0, 0.0), {}, state.regression.fit())
    return Hypothesis(effect, None if plain else "turn", found, held_out, 0.0 if effect == "none" else 20.0, 0, evidence)


def effects(state: State, left: float, evidence: float) -> list[str]:
    """What stays of `none`, an effect that leaves so much, and moved parameters that leave 13 times the noise."""
    answers = [answer(state, "none", 15.0, 100.0), answer(state, "transmission_error", left, evidence)]
    return [one.effect for one in without_refuted(state, [*answers, answer(state, "nominal", 13.0, 70.0)])]


def test_the_model_to_the_letter_does_not_hide_an_effect_that_takes_much(state: State) -> None:
    """Without two strong effects few rows count: what is left remembers for seconds."""
    assert effects(state, 8.0, 99.0) == ["transmission_error", "nominal"]


def test_it_stands_where_the_effect_takes_little_or_is_clearly_behind_moved_parameters(state: State) -> None:
    assert effects(state, 12.9, 72.0) == ["none", "transmission_error", "nominal"]
    assert effects(state, 8.0, 65.0) == ["none", "transmission_error", "nominal"]
    assert effects(state, 8.0, 67.0) == ["transmission_error", "nominal"]


def test_it_stands_where_nothing_is_above_the_floor(state: State) -> None:
    answers = [answer(state, "none", 1.1, 100.0), answer(state, "transmission_error", 0.9, 99.0)]
    kept = without_refuted(state, [*answers, answer(state, "nominal", 1.0, 70.0)])
    assert kept[0].effect == "none"


def test_nor_does_it_where_the_only_choice_is_made_again(state: State, monkeypatch: pytest.MonkeyPatch) -> None:
    """The answers are told in the order of their evidence: with `none` first, the step would tell that nothing is missing."""
    answers = [answer(state, "none", 15.0, 100.0), answer(state, "transmission_error", 8.0, 99.0)]
    answers.append(answer(state, "nominal", 13.0, 70.0))
    monkeypatch.setattr(selection, "hypotheses", lambda _state, _known: answers)
    own = placed(state.comparison, "turn", TransmissionError(0.001, 2.0, 0.0))
    again, _ = reconsidered(state.comparison, [], NOISE, [Step(state, answers[1:], answers[1])], (own,))
    assert again[0].answers[0].effect == "transmission_error"
