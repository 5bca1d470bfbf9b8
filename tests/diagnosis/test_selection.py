"""Two effects on one axis: each is found beside the other, however little one of them is, and neither is made up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import (
    ARM,
    GRAVITY,
    PERIOD,
    as_modelled,
    compared,
    moved,
    recording,
    strokes,
    written_model,
)

from diagnosis import selection
from diagnosis.prepare.rows import Comparison
from diagnosis.diagnose import diagnose
from diagnosis.hypotheses import NOMINAL, Hypothesis, hypotheses, rated, settled, shortlist
from diagnosis.propose.nominal import nominal_parameters
from diagnosis.propose.placing import placed
from diagnosis.report.result import NONE, Diagnosis
from diagnosis.propose.search import Found
from diagnosis.selection import Step, choice, matters, reconsidered, select_causes
from diagnosis.settings import DiagnosisSettings
from diagnosis.state import State, state_with
from drivetwin.recording.recording import Recording
from emulator.effects import Effect, PlacedEffect, library
from emulator.effects.backlash import Backlash
from emulator.effects.delay import Delay
from emulator.effects.torque_ripple import TorqueRipple

SECONDS, QUADRATIC = 20.0, 2.5
NOISE = {"turn": 0.05, "lift": 0.4}
Record = Callable[[int, str], Recording]


def late_and_quadratic(seed: int, name: str) -> Recording:
    """The column is braked by 2.5 v |v| besides, and read three samples late, which is felt little beside that."""
    both = moved(seed, SECONDS)
    turn = both["turn"]
    torques = as_modelled(both)
    torques["turn"] = torques["turn"] + QUADRATIC * turn.velocity * np.abs(turn.velocity)
    read = np.concatenate([np.full(3, turn.position[0]), turn.position[:-3]])
    return recording(torques, {"turn": read, "lift": both["lift"].position}, seed, name)


def loaded_and_rubbing(seed: int, name: str) -> Recording:
    """The carriage carries 0.25 kg at its middle, three deviations of its own mass, and its friction has a Stribeck level."""
    both = moved(seed, SECONDS)
    lift = both["lift"]
    torques = as_modelled(both)
    sticks = 9.0 * np.exp(-((lift.velocity / 0.05) ** 2)) * np.sign(lift.velocity)
    torques["turn"] = torques["turn"] + 0.25 * ARM**2 * both["turn"].acceleration
    torques["lift"] = torques["lift"] + 0.25 * (GRAVITY + lift.acceleration) + sticks
    return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name)


def diagnosed(folder: Path, record: Record) -> Diagnosis:
    return diagnose(
        written_model(folder), [record(1, "fitted")], [record(2, "held")], DiagnosisSettings(), lambda _stage, _share: None
    )


def test_a_small_second_effect_counts_where_else_the_model_would_be_far_off(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, late_and_quadratic)
    assert {(one.effect.name, one.axis) for one in found.selected} >= {("viscous_nonlinear", "turn"), ("delay", "turn")}
    late = next(one.effect for one in found.selected if isinstance(one.effect, Delay))
    assert late.delay == pytest.approx(3.0 * PERIOD, rel=0.02)


def test_a_body_found_heavier_beside_an_effect_may_carry_something(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, loaded_and_rubbing)
    assert ("stribeck", "lift") in {(one.effect.name, one.axis) for one in found.selected}
    told = [one for one in found.causes if one.axis == "lift" and one.effect in ("inertia", "payload")]
    assert any(one.effect == "payload" or "payload" in one.indistinguishable_from for one in told)


def test_a_body_found_heavier_may_as_well_be_another_force_that_does_not_change(tmp_path: Path) -> None:
    """The carriage is pulled down by 1.5 N, as 1.5 deviations of its mass would, on a screw that ripples."""

    def pulled_and_rippled(seed: int, name: str) -> Recording:
        both = moved(seed, SECONDS)
        torques = as_modelled(both)
        torques["lift"] = torques["lift"] + 1.5 + 3.0 * np.sin(2.0 * np.pi * both["lift"].position / 0.01)
        return recording(torques, {axis: at.position for axis, at in both.items()}, seed, name)

    found = diagnosed(tmp_path, pulled_and_rippled)
    assert ("torque_ripple", "lift") in {(one.effect.name, one.axis) for one in found.selected}
    heavier = next(one for one in found.causes if (one.effect, one.axis) == ("inertia", "lift") and one.probability > 0.5)
    assert set(heavier.indistinguishable_from) >= {"torque_offset", "coulomb_asymmetry"}
    assert "standstills" in heavier.tell_apart_by


@pytest.fixture(scope="module")
def waving(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    """The column's friction varies by 0.8 N·m, one wave in 0.6 rad."""
    more = {"turn": lambda at: 0.8 * np.sin(2.0 * np.pi * at.position / 0.6 + 0.5) * np.sign(at.velocity)}
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, SECONDS, more))


def test_an_effect_that_only_stood_in_for_another_is_given_up(waving: Comparison) -> None:
    """Stribeck friction was chosen first, then what it stood in for."""
    nominals = nominal_parameters(waving)
    false = placed(waving, "turn", library()["stribeck"](static_torque=1.9, stribeck_velocity=0.3))
    true = placed(waving, "turn", library()["position_friction"](amplitude=0.8, period=0.6, phase=0.5))
    state = state_with(waving, nominals, (), NOISE)
    beside = state_with(waving, nominals, (false,), NOISE)
    steps = [step(state, "stribeck"), step(beside, "position_friction")]
    again, selected = reconsidered(waving, nominals, NOISE, steps, (false, true))
    assert [(one.effect.name, one.axis) for one in selected] == [("position_friction", "turn")]
    assert [one.chosen.effect for one in again if one.chosen is not None] == ["position_friction"]
    assert again[0].state is state


def test_an_effect_without_which_another_would_push_is_not_tried_away(waving: Comparison) -> None:
    """An asymmetry larger than the model's own viscous friction, beside a viscous friction that carries it."""
    viscous = waving.simulation.dynamics()["turn"].friction.viscous
    carrying = placed(waving, "turn", library()["viscous"](viscous=3.0 * viscous))
    asymmetry = placed(waving, "turn", library()["viscous_asymmetry"](asymmetry=1.5 * viscous))
    nominals, selected = nominal_parameters(waving), (carrying, asymmetry)
    state = state_with(waving, nominals, selected, NOISE)
    assert waving.simulation.dynamics(settled(state, selected))
    fitted = state.regression.fit()
    found = [Found("turn", one.effect, {}, fitted) for one in selected]
    chosen = [Hypothesis(one.effect.name, "turn", one, fitted.held_out, fitted.prior_cost, 1) for one in found]
    steps = [Step(state, [one], one) for one in chosen]
    _, kept = reconsidered(waving, nominals, NOISE, steps, selected)
    assert waving.simulation.dynamics(kept)


def test_an_effect_that_takes_next_to_nothing_beside_another_is_given_up(
    waving: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However sure it is: it was chosen first, and the wave that it stood in for was found later."""
    nominals = nominal_parameters(waving)
    state = state_with(waving, nominals, (), NOISE)
    fitted, rows = state.regression.fit(), state.regression.rows["turn"]
    pair = tuple(
        placed(waving, "turn", effect)
        for effect in (TorqueRipple(0.01, 2.0), library()["position_friction"](amplitude=0.8, period=0.6, phase=0.5))
    )

    def kept(before: float) -> list[str]:
        """Where either effect leaves 0.25 floors, and the wave without the ripple so many."""

        def again(_state: State, own: PlacedEffect) -> list[Hypothesis]:
            alone = {"torque_ripple": before, "position_friction": 9.0}[own.effect.name]
            squares = [{**fitted.held_out, "turn": rows * (floors * NOISE["turn"]) ** 2} for floors in (0.25, alone)]
            found = Found("turn", own.effect, {}, fitted)
            known = Hypothesis(own.effect.name, "turn", found, squares[0], 0.0, 3, 29.0)
            return [known, Hypothesis(NOMINAL, None, None, squares[1], 0.0, 0)]

        monkeypatch.setattr(selection, "hypotheses", again)
        steps = [step(state, "torque_ripple"), step(state, "position_friction")]
        return sorted(one.effect.name for one in reconsidered(waving, nominals, NOISE, steps, pair)[1])

    assert kept(0.47) == ["position_friction"]
    assert kept(1.0) == ["position_friction", "torque_ripple"]


@pytest.fixture
def in_pieces(waving: Comparison, monkeypatch: pytest.MonkeyPatch) -> Comparison:
    """The same, as if it were so long that a search begins on a sample."""
    for name, value in (("LONG", 10.0), ("ENOUGH", 9.0), ("PIECE", 3.0)):
        monkeypatch.setattr(f"diagnosis.prepare.rows.{name}", value)
    pieces = Comparison(waving.simulation, waving.runs)
    assert pieces.sample.duration == pytest.approx(9.0)
    return pieces


def test_a_search_that_begins_on_a_sample_ends_where_one_on_all_rows_does(waving: Comparison, in_pieces: Comparison) -> None:
    whole, sampled = (hypotheses(state_with(one, nominal_parameters(one), (), NOISE)) for one in (waving, in_pieces))
    assert (sampled[0].effect, sampled[0].axis) == (whole[0].effect, whole[0].axis)
    assert sampled[0].evidence == pytest.approx(whole[0].evidence, abs=0.05)
    assert sampled[0].found is not None
    assert whole[0].found is not None
    for parameter in type(whole[0].found.effect).parameters:
        own, other = (getattr(one.found.effect, parameter.name) for one in (sampled[0], whole[0]))  # type: ignore[union-attr]
        assert own == pytest.approx(other, rel=1e-3)


@pytest.mark.parametrize("rows", ["waving", "in_pieces"])
def test_an_effect_far_from_every_start_is_still_known_where_it_was(rows: str, request: pytest.FixtureRequest) -> None:
    """A wave so short that no search begins near it, on all rows and where the search begins on a sample."""
    comparison: Comparison = request.getfixturevalue(rows)
    known = placed(comparison, "turn", library()["torque_ripple"](amplitude=0.1, order=2.345, phase=0.0))
    answers = hypotheses(state_with(comparison, nominal_parameters(comparison), (), NOISE), known)
    found = next(one.found for one in answers if one.effect == "torque_ripple" and one.axis == "turn")
    assert found is not None
    assert isinstance(found.effect, TorqueRipple)
    assert found.effect.order == pytest.approx(2.345, rel=0.02)


def test_of_many_starts_behind_a_spring_those_go_on_that_are_best_once_moved_a_little(
    waving: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = state_with(waving, nominal_parameters(waving), (), NOISE)
    fitted = state.regression.fit()

    def start(effect: Effect, left: float) -> Found:
        held_out = {**fitted.held_out, "turn": left * fitted.held_out["turn"]}
        return Found("turn", effect, {}, replace(fitted, held_out=held_out))

    valleys = {0.001: 3.0, 0.002: 2.0, 0.003: 0.5, 0.004: 1.0}
    monkeypatch.setattr(
        "diagnosis.hypotheses._searched_or_none", lambda _state, _evaluations, one: start(one.effect, valleys[one.effect.gap])
    )
    plays = [start(Backlash(gap, 1e4), 1.0) for gap in valleys]
    ripples = [start(TorqueRipple(0.1, order), 1.0) for order in (1.0, 2.0, 3.0)]
    assert [one.effect for one in shortlist(state, [*plays, *ripples])] == [
        Backlash(0.003, 1e4), Backlash(0.004, 1e4), *(one.effect for one in ripples)
    ]  # fmt: skip


def test_a_strong_effect_is_chosen_before_no_effect_at_all(waving: Comparison) -> None:
    """While another is missing, parameters of the model strain for it, and the model to the letter seems more evident."""
    state = state_with(waving, nominal_parameters(waving), (), NOISE)
    ranked = sorted(hypotheses(state), key=lambda one: one.evidence)
    best = next(one for one in ranked if one.effect == "position_friction")
    letter = replace(next(one for one in ranked if one.effect == NONE), evidence=best.evidence + 1.0)
    nominal = next(one for one in ranked if one.effect == NOMINAL)
    assert choice(state, [letter, best, nominal]) is best
    assert choice(state, [letter, replace(best, held_out=nominal.held_out), nominal]) is None


def test_what_is_behind_moved_parameters_is_given_up_where_no_second_effect_comes(
    waving: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes most of the gap, and the few rows that count then say a little less for it than for moved parameters."""
    nominals = nominal_parameters(waving)
    ranked = hypotheses(state_with(waving, nominals, (), NOISE))
    best = next(one for one in ranked if one.effect == "position_friction")
    nominal = next(one for one in ranked if one.effect == NOMINAL)

    def chosen(behind: float) -> list[str]:
        answers = [nominal, replace(best, evidence=nominal.evidence - behind)]
        monkeypatch.setattr(selection, "hypotheses", lambda state, _known=None: [nominal] if state.selected else answers)
        found = select_causes(waving, nominals, NOISE, lambda _stage, _share: None)
        assert [step.chosen is not None for step in found.steps] == [bool(found.effects)]
        return [one.effect.name for one in found.effects]

    assert choice(state_with(waving, nominals, (), NOISE), [nominal, replace(best, evidence=nominal.evidence - 1.0)])
    assert chosen(1.0) == []
    assert chosen(-0.1) == ["position_friction"]


@pytest.mark.parametrize("beside", [False, True])
def test_a_sure_effect_that_takes_most_of_what_stands_counts_however_large_the_gap_is(waving: Comparison, beside: bool) -> None:
    """Parameters of the model had taken nearly all of a large gap, and what they left is behind a spring; or it is in few rows.

    What is left may be below the floor then, on the effect's own axis, unless another effect is selected.
    """
    first = (placed(waving, "turn", library()["torque_offset"](offset=0.1)),) if beside else ()
    state = state_with(waving, nominal_parameters(waving), first, {"turn": 0.01, "lift": 0.4})
    fitted, rows = state.regression.fit(), state.regression.rows["turn"]

    def counts(before: float, left: float, evidence: float, of: str = "turn") -> bool:
        """In floors, and nats over moved parameters."""
        squares = {floors: {**fitted.held_out, "turn": rows * (0.01 * floors) ** 2} for floors in (before, left)}
        found = Found(of, spring("elasticity"), {}, fitted)
        one = Hypothesis("elasticity", of, found, squares[left], 0.0, 2, evidence)
        return matters(state, one, [Hypothesis(NOMINAL, None, None, squares[before], 0.0, 0)])

    assert counts(2.8, 0.3, 100.0)
    assert counts(0.72, 0.33, 100.0)
    assert not counts(2.8, 0.3, 15.0)
    assert not counts(2.8, 2.1, 100.0)
    assert counts(0.5, 0.1, 100.0) is not beside
    assert not counts(0.5, 0.1, 100.0, of="lift")


def test_play_that_takes_no_more_than_its_flanks_is_rated_behind_their_elasticity(waving: Comparison) -> None:
    state = state_with(waving, nominal_parameters(waving), (), NOISE)
    nominal = state.regression.fit()
    rows, floor = state.regression.rows["turn"], NOISE["turn"] ** 2

    def answer(effect: str, left: float) -> Hypothesis:
        held_out = {**nominal.held_out, "turn": left * rows * floor}
        found = Found("turn", placed(waving, "turn", spring(effect)).effect, {}, replace(nominal, held_out=held_out))
        return Hypothesis(effect, "turn", found, held_out, nominal.prior_cost, 2)

    def order(play: float) -> list[str]:
        return [one.effect for one in rated(state, [answer("backlash", play), answer("elasticity", 3.0)])]

    assert order(2.7) == ["elasticity", "backlash"]
    assert order(2.0) == ["backlash", "elasticity"]


def test_an_effect_that_spares_the_parameters_of_an_axis_without_a_gap_is_none(waving: Comparison) -> None:
    state = state_with(waving, nominal_parameters(waving), (), NOISE)
    fitted = state.regression.fit()

    def sparing(axis: str) -> bool:
        column = {axis: np.full(state.regression.rows[axis], 20.0 * NOISE[axis])}
        found = Found(axis, placed(waving, axis, spring("elasticity")).effect, column, fitted)
        one = Hypothesis("elasticity", axis, found, fitted.held_out, fitted.prior_cost - 8.0, 2)
        return matters(state, one, [Hypothesis(NOMINAL, None, None, fitted.held_out, fitted.prior_cost, 0)])

    assert sparing("turn")
    assert not sparing("lift")


def spring(effect: str) -> Effect:
    """A spring, with or without play."""
    kind = library()[effect]
    return kind(stiffness=1e4) if effect == "elasticity" else kind(stiffness=1e4, gap=1e-4)


def step(state: State, effect: str) -> Step:
    """A step that chose an effect on the column."""
    chosen = Hypothesis(effect, "turn", None, {}, 0.0, 1)
    return Step(state, [chosen, Hypothesis(NOMINAL, None, None, {}, 0.0, 0)], chosen)
