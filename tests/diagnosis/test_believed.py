"""Which set of effects is left once each has a probability, and how far a search may move a parameter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bench import Machine
from rig_bench import COULOMB, GEAR, TURNING, as_modelled, moved, ready, recording, strokes

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Answer, Unexplained, Weighed, believed, preferred, weighed
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.proposal import Family
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.effects import AxisEffect, Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.position_friction import PositionFriction
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous_asymmetry import ViscousAsymmetry
from drivetwin.emulator.effects.waves import travel
from drivetwin.foundation.errors import UserError

NOISE = Unexplained({"turn": 0.0, "lift": 0.0}, {"turn": 0.0, "lift": 0.0})
"""All that is left is."""
WAVE, OFFSET = PositionFriction(0.1, 0.5), TorqueOffset(0.3)


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> State:
    """A set of a wave and an offset."""
    bench = Machine().bench(tmp_path_factory.mktemp("plain"), 20.0)
    return state_of(bench, [placed(bench.rows, "turn", one) for one in (WAVE, OFFSET)], bench.white, {})


def answer(state: State, chosen: Effect, *, predicts: bool, probability: float = 0.6) -> Answer:
    return Answer(placed(state.bench.rows, "turn", chosen), probability, predicts, ())


def of_turn(
    folder: Path,
    torque: Array,
    effect: AxisEffect,
    prior: float,
    rest: Unexplained = NOISE,
) -> Answer:
    """What is said of the only effect that is asked for, of an axis that was moved with such a torque (n,) [N·m]."""
    both = moved(1, 20.0)
    positions = {axis: at.position for axis, at in both.items()}
    told = ready(folder, recording(as_modelled(both) | {"turn": torque}, positions, 1, "one"))
    bench = bench_of(told.rows, Settings(), told.absolute)
    nothing = settled_on(coloured(state_of(bench, (), bench.white, {}), ()))
    found = Proposer(bench, bench, {"turn": [type(effect)]}, {}).evaluated(nothing, Begun("turn", effect, 0.0, 1))
    assert found is not None
    settled = settled_on(nothing.of((found.effect,)))
    member = replace(found, effect=settled.effects[0], prior=prior, settled=settled)
    return weighed(Family(member.effect, nothing, [member]), rest, Settings())


def names(state: State) -> list[str]:
    return sorted(one.effect.name for one in state.effects)


def test_what_predicts_no_better_than_nothing_is_given_up(state: State) -> None:
    left = believed(state, [answer(state, WAVE, predicts=False), answer(state, OFFSET, predicts=True)])
    assert names(left) == ["torque_offset"]


def test_what_is_rather_not_there_is_given_up_though_it_predicts(state: State) -> None:
    """One moment may say in nearly all draws of blocks that it does, and little where what is left is systematic."""
    told = [answer(state, WAVE, predicts=True, probability=0.34), answer(state, OFFSET, predicts=True)]
    assert names(believed(state, told)) == ["torque_offset"]


def test_beside_what_is_left_noise_is_as_loud_as_what_the_given_up_explained(state: State) -> None:
    """Beside the cogging nearly nothing was left. In that noise, which is none now, anything may be likelier than the truth."""
    cogging = TorqueRipple(0.6, 2.0, 0.4)
    found = state.of([placed(state.bench.rows, "turn", one) for one in (cogging, OFFSET)])
    found = settled_on(coloured(settled_on(found), ()))
    chosen = next(one.effect for one in found.effects if one.effect.name == cogging.name)
    left = believed(found, [answer(state, chosen, predicts=False)])
    assert names(left) == ["torque_offset"]
    assert found.of(left.effects).standing.level["turn"] > 5.0, "in the noise beside the cogging"
    assert left.standing.level["turn"] < 1.1


@pytest.mark.parametrize(("effect", "there"), [(TorqueRipple(0.6, 2.0, 0.4), True), (TorqueRipple(0.6, 7.0, 0.4), False)])
def test_what_leaves_less_of_held_out_motion_predicts_though_no_density_says_so(
    state: State, effect: TorqueRipple, there: bool
) -> None:
    """The machine's own cogging, and one of an order that it has not; by the prior both are too rare for their density."""
    nothing = state.of(())
    chosen = placed(state.bench.rows, "turn", effect)
    found = Proposer(state.bench, state.bench, {"turn": [TorqueRipple]}, {}).evaluated(nothing, Begun("turn", effect, 0.0, 1))
    assert found is not None
    rare = replace(found, prior=-1e9, settled=nothing.of((chosen,)))
    told = weighed(Family(chosen, nothing, [rare]), Unexplained({"turn": 0.0}, {"turn": 0.0}), Settings())
    assert told.members[0].weight < 0.01
    assert told.probability == pytest.approx(float(there), abs=0.01)
    assert told.predicts == there


@pytest.mark.parametrize(
    ("rest", "noisy"),
    [
        pytest.param(Unexplained({"turn": 0.0}, {"turn": 0.0}), True, id="the rest is noise"),
        pytest.param(Unexplained({"turn": 1.0}, {"turn": 0.0}), False, id="the rest is what the comparison errs by"),
        pytest.param(Unexplained({"turn": 1.0}, {"turn": 1.0}), False, id="the rest is unknown"),
    ],
)
@pytest.mark.parametrize(("order", "there"), [(2.0, True), (3.0, False)])
def test_what_takes_little_of_what_has_no_name_is_no_more_than_an_imitation(
    state: State, order: float, rest: Unexplained, *, there: bool, noisy: bool
) -> None:
    """The machine's own cogging, and a wave of another order, both certain by their density."""
    nothing = state.of(())
    settled = settled_on(nothing.of((placed(state.bench.rows, "turn", TorqueRipple(0.6, order, 0.4)),)))
    begun = Begun("turn", settled.effects[0].effect, 0.0, 1)
    found = Proposer(state.bench, state.bench, {"turn": [TorqueRipple]}, {}).evaluated(nothing, begun)
    assert found is not None
    certain = replace(found, prior=1e3, settled=settled)
    told = weighed(Family(settled.effects[0], nothing, [certain]), rest, Settings())
    named = noisy or there
    assert told.predicts == named
    assert told.probability > 0.9 if named else told.probability < 0.2


@pytest.mark.parametrize(("scale", "there"), [(1.01, False), (1.2, True)])
def test_what_a_usual_model_is_off_by_explains_needs_no_other_cause(tmp_path: Path, scale: float, *, there: bool) -> None:
    """All torque of an axis is so many times the modelled one: by 1 % friction and inertia are usually off, by 20 % hardly."""
    both = moved(1, 20.0)
    answer = of_turn(tmp_path, scale * as_modelled(both)["turn"], TorqueConstant(1.0 / scale - 1.0), prior=-1e9)
    assert answer.predicts == there


def test_a_friction_that_is_off_is_no_parameter_of_the_set_that_has_nothing_in_its_place(tmp_path: Path) -> None:
    """Coulomb friction 30 % above the model's, beside a torque without a name: left free, it would explain itself."""
    both = moved(1, 20.0)
    raised = 0.3 * COULOMB["turn"] * np.sign(both["turn"].velocity)
    time = both["turn"].time
    unknown = 0.8 * np.sin(2.3 * time) * np.sin(8.2 * time + 1.0)
    torque = as_modelled(both)["turn"] + raised + unknown
    assert of_turn(tmp_path, torque, Coulomb(1.3 * COULOMB["turn"]), prior=-1e9).predicts


def test_what_takes_little_beside_what_nominal_parameters_are_off_by_is_no_imitation(tmp_path: Path) -> None:
    """A cogging beside an inertia and a friction that are off by 1 %, which as a gap is much larger."""
    turn = moved(1, 20.0)["turn"]
    off = 0.01 * TURNING * turn.acceleration - 0.005 * COULOMB["turn"] * np.sign(turn.velocity)
    amplitude = 0.3 * float(np.std(off))
    torque = as_modelled(moved(1, 20.0))["turn"] + off - amplitude * np.sin(2.0 * GEAR * turn.position + 0.4)
    rest = Unexplained({"turn": 1.0, "lift": 1.0}, {"turn": 0.0, "lift": 0.0})
    assert of_turn(tmp_path, torque, TorqueRipple(amplitude, 2.0, 0.4), prior=1e3, rest=rest).predicts


def offset_or_asymmetry(state: State, weight: float) -> tuple[State, Answer]:
    """A set of an offset, and an answer in which an asymmetry of friction, in sliding the same, has a weight of 0.4."""
    alone = state.of((placed(state.bench.rows, "turn", OFFSET),))
    other = CoulombAsymmetry(OFFSET.offset)
    proposer = Proposer(state.bench, state.bench, {"turn": [TorqueOffset, CoulombAsymmetry]}, {})
    own, rival = (proposer.evaluated(state.of(()), Begun("turn", one, 0.0, 1)) for one in (OFFSET, other))
    assert own is not None
    assert rival is not None
    members = sorted((Weighed(own, weight, True), Weighed(rival, 0.4, True)), key=lambda one: -one.weight)
    return alone, Answer(alone.effects[0], 0.9, True, tuple(members))


@pytest.mark.parametrize(("weight", "named"), [(0.3, "coulomb_asymmetry"), (0.45, "torque_offset")])
def test_of_what_cannot_be_distinguished_the_most_probable_is_named(state: State, weight: float, named: str) -> None:
    """In sliding an offset is an asymmetry of friction: the weights decide, whichever the search came upon."""
    alone, answer = offset_or_asymmetry(state, weight)
    found, (told,) = preferred(alone, [answer])
    assert names(found) == [named]
    assert told.chosen is not None
    assert told.chosen.effect.name == named


def test_the_most_probable_is_not_named_where_it_leaves_more_of_the_gap(state: State, monkeypatch: pytest.MonkeyPatch) -> None:
    alone, answer = offset_or_asymmetry(state, 0.3)
    monkeypatch.setattr(State, "leaves_more_than", lambda own, _other: names(own) == ["coulomb_asymmetry"])
    found, (told,) = preferred(alone, [answer])
    assert found is alone
    assert told is answer


def test_names_of_one_torque_count_together(state: State) -> None:
    """Two names of a constant torque have 0.23 and 0.22; what is no constant has 0.34, and is less probable than both."""
    chosen = ViscousAsymmetry(0.1)
    alone = state.of((placed(state.bench.rows, "turn", chosen),))
    kinds = [ViscousAsymmetry, TorqueOffset, CoulombAsymmetry]
    proposer = Proposer(state.bench, state.bench, {"turn": kinds}, {})
    effects = (chosen, CoulombAsymmetry(OFFSET.offset), OFFSET)
    found = [proposer.evaluated(state.of(()), Begun("turn", one, 0.0, 1)) for one in effects]
    weights = (0.34, 0.23, 0.22)
    members = [Weighed(one, weight, True) for one, weight in zip(found, weights, strict=True) if one is not None]
    left, _ = preferred(alone, [Answer(alone.effects[0], 0.8, True, tuple(members))])
    assert names(left) == ["coulomb_asymmetry"]
    alone_there, _ = preferred(alone, [Answer(alone.effects[0], 0.8, True, tuple(members[:2]))])
    assert names(alone_there) == ["viscous_asymmetry"]


def test_a_payload_has_no_advantage_of_the_mass_whose_place_it_takes(tmp_path: Path) -> None:
    """Beside an offset the carriage's mass is free as well, which costs evidence: it does not decide between the two."""
    made = ready(tmp_path, strokes(1, 20.0, {"lift": lambda at: np.full(len(at.time), 1.5)}))
    bench = bench_of(made.rows, Settings(), made.absolute)
    empty = settled_on(coloured(state_of(bench, (), bench.white, {}), ()))
    proposer = Proposer(bench, bench, {"lift": [Payload, TorqueOffset]}, {})
    payload, offset = (
        proposer.evaluated(empty, Begun("lift", one, 0.0, 1)) for one in (Payload(0.1, 0.0, 0.0, 0.0), TorqueOffset(-1.5))
    )
    assert payload is not None
    assert offset is not None
    chosen = settled_on(empty.of((payload.effect,)))
    members = (Weighed(offset, 0.6, True), Weighed(replace(payload, effect=chosen.effects[0]), 0.4, True))
    found, _ = preferred(chosen, [Answer(chosen.effects[0], 1.0, True, members)])
    assert names(found) == ["torque_offset"]


def test_no_search_makes_a_wave_longer_than_the_travel(state: State) -> None:
    motion = state.rows.motion["turn"]
    low, high = WAVE.bounds(motion, state.dynamics["turn"])["period"]
    assert low < 0.5 < high
    assert high == pytest.approx(float(np.ptp(motion.position)), rel=0.2)
    assert high == travel(motion)


@pytest.mark.parametrize("effect", [CoulombAsymmetry(0.1), ViscousAsymmetry(0.1)])
def test_no_search_makes_friction_that_pushes(state: State, effect: CoulombAsymmetry | ViscousAsymmetry) -> None:
    """Beyond its bound an effect would be no proposal at all, and no alternative to what fits as well."""
    rows = state.bench.rows
    _, most = effect.bounds(state.rows.motion["turn"], rows.simulation.dynamics(())["turn"])["asymmetry"]
    rows.simulation.dynamics((placed(rows, "turn", replace(effect, asymmetry=most)),))
    with pytest.raises(UserError, match="it would push"):
        rows.simulation.dynamics((placed(rows, "turn", replace(effect, asymmetry=1.001 * most)),))


@pytest.mark.parametrize("effect", [CoulombAsymmetry(0.1), ViscousAsymmetry(0.1)])
def test_where_a_model_has_no_friction_there_is_still_room_for_a_search(state: State, effect: Effect) -> None:
    frictionless = AxisDynamics(friction=FrictionLaw())
    low, high = effect.bounds(state.rows.motion["turn"], frictionless)["asymmetry"]
    assert low < high
