"""What stands in the place of an effect is judged in the noise that it leaves, and what leaves more of the gap is not added:
on torques of a formula.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log
from pathlib import Path

import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, ORDER, PHASE, SLIDES, STICKS, VISCOUS, Machine
from rig_bench import MOTOR, TURNING, Swing, compared, strokes
from rig_bench import VISCOUS as COLUMN_VISCOUS
from scipy.signal import lsim

from drivetwin.diagnosis.propose.placing import name_of, placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Unexplained, preferred, weighed
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.colouring import coloured, in_its_noise
from drivetwin.diagnosis.weigh.exchange import Exchange
from drivetwin.diagnosis.weigh.moves import Search
from drivetwin.diagnosis.weigh.pair import Pair, empty
from drivetwin.diagnosis.weigh.proposal import Family, Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import AxisEffect, Effect, PlacedEffect, library
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.temperature_drift import TemperatureDrift
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.emulator.effects.viscous_asymmetry import ViscousAsymmetry

SOFT, STIFF = Elasticity(700.0, 3.0, 1.0), Elasticity(3e4, 30.0, 1.0)
"""Springs on which the column swings at 3 and at 18 Hz, all friction before them."""
KINDS: tuple[type[AxisEffect], ...] = (Coulomb, CoulombAsymmetry, Stribeck, Viscous)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """A column with a Stribeck level and cogging, of which the model knows nothing."""
    return Machine().bench(tmp_path_factory.mktemp("plain"))


@pytest.fixture(scope="module")
def proposer(bench: Bench) -> Proposer:
    return Proposer(bench, bench, {"turn": KINDS}, {})


@pytest.fixture(scope="module")
def cogging(bench: Bench, proposer: Proposer) -> State:
    """The cogging alone, in the noise that is left beside everything that could be asked: none of it stands in the set yet."""
    ripple = state_of(bench, [placed(bench.rows, "turn", TorqueRipple(COGGING, ORDER, PHASE))], bench.white, {})
    return coloured(ripple, proposer.proposals(Pair(ripple, ripple)))


def proposed(proposer: Proposer, cogging: State, effect: Effect) -> Proposal:
    """An effect beside the cogging, moved to where it belongs in that noise."""
    found = proposer.evaluated(cogging, Begun("turn", effect, 0.0, 1))
    assert found is not None
    return replace(found, settled=settled_on(cogging.of([*cogging.effects, found.effect])))


def better(proposer: Proposer, family: Family, state: State) -> list[str] | None:
    """Names of the effects of the set that takes the place; None where the set stays."""
    exchange = Exchange(proposer, {}, lambda _stage, _share: None)
    found = exchange._better(family, state, in_its_noise(state, state))
    return None if found is None else [one.effect.name for one in found.effects]


def test_what_leaves_less_replaces_what_only_noise_of_another_set_prefers(proposer: Proposer, cogging: State) -> None:
    """An asymmetry explains nothing of a friction that is the same both ways; a level explains a part of it."""
    asymmetry, level = (proposed(proposer, cogging, one) for one in (CoulombAsymmetry(0.1), Coulomb(1.2 * COULOMB)))
    assert asymmetry.settled is not None
    assert level.settled is not None
    assert asymmetry.settled.reached > level.settled.reached + 100.0, "in noise that is neither's"
    assert level.settled.left["turn"] < asymmetry.settled.left["turn"] - 0.02
    assert better(proposer, Family(asymmetry.effect, cogging, [asymmetry, level]), asymmetry.settled) == [
        "coulomb",
        "torque_ripple",
    ]
    assert better(proposer, Family(level.effect, cogging, [level, asymmetry]), level.settled) is None


def test_what_is_much_better_replaces_an_effect_that_is_worth_nothing(proposer: Proposer, cogging: State) -> None:
    """And where nothing is better than it, it leaves the set."""
    nothing, stick = proposed(proposer, cogging, Viscous(VISCOUS)), proposed(proposer, cogging, Stribeck(2.0, 0.2, 2.0))
    worthless = replace(nothing, prior=nothing.prior - 1e4)
    assert worthless.settled is not None
    family = Family(worthless.effect, cogging, [worthless, stick])
    assert better(proposer, family, worthless.settled) == ["stribeck", "torque_ripple"]
    assert better(proposer, replace(family, proposals=[worthless]), worthless.settled) == ["torque_ripple"]


def test_what_cannot_be_evaluated_is_not_replaced_by_what_is_worse(proposer: Proposer, cogging: State) -> None:
    """A set whose effect nothing can follow beside the others still has the evidence of its own."""
    stick, level = (proposed(proposer, cogging, one) for one in (Stribeck(2.0, 0.2, 2.0), Coulomb(1.2 * COULOMB)))
    assert stick.settled is not None
    assert better(proposer, Family(stick.effect, cogging, [level]), stick.settled) != ["coulomb", "torque_ripple"]


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_how_much_better_a_set_is_does_not_depend_on_the_unit_of_torque(unit: float, tmp_path: Path) -> None:
    """Of a torque in steps that are coarse beside what the sets leave: a row of a plateau counts as a part of one."""
    gains = []
    for scale in (1.0, unit):
        own = Machine(torque_scale=scale).bench(tmp_path, seconds=12.0, resolution=0.2)
        bare = state_of(own, (), own.white, {})
        ripple = bare.of([placed(own.rows, "turn", TorqueRipple(COGGING * scale, ORDER, PHASE))])
        gains.append(in_its_noise(ripple, bare).reached - in_its_noise(bare, bare).reached)
    assert gains[1] == pytest.approx(gains[0], abs=1.0)


def added(proposer: Proposer) -> dict[str, State]:
    """Of the set that a search adds up from nothing, the names of the effects."""
    found, _ = Search(proposer, lambda _stage, _share: None).added(empty(proposer.bench, proposer.part))
    return {one.effect.name: found.whole for one in found.whole.effects}


def test_what_leaves_more_of_the_gap_is_not_added_however_likely_it_is(
    proposer: Proposer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a Stribeck curve the likelihood reads the torque 20 ms too early: the next best is added instead."""
    assert "stribeck" in added(proposer)
    honest = Search._with

    def misread(search: Search, pair: Pair, best: Sequence[Proposal], proposals: Sequence[Proposal]) -> Pair:
        ahead = honest(search, pair, best, proposals)
        late = {"turn": 0.02} if any(isinstance(one.effect, Stribeck) for one in ahead.whole.effects) else {}
        return Pair(ahead.whole.read(late), ahead.part.read(late))

    monkeypatch.setattr(Search, "_with", misread)
    instead = added(proposer)
    assert "stribeck" not in instead
    assert "coulomb" in instead
    assert instead["coulomb"].left["turn"] < empty(proposer.bench, proposer.part).whole.left["turn"]


def test_an_effect_is_not_dropped_for_a_nominal_parameter_that_no_patch_has(tmp_path: Path) -> None:
    """That the model's own level is 10 % off is as likely as one more effect; but without that more of the gap is left."""
    own = Machine(level=0.9 * COULOMB).bench(tmp_path)
    true: list[Effect] = [Coulomb(COULOMB), Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE)]
    whole = coloured(state_of(own, [placed(own.rows, "turn", one) for one in true], own.white, {}), ())
    less = Pair(whole, whole).without(whole.effects[0])
    kinds = [kind for kind in library().values() if issubclass(kind, AxisEffect)]
    assert less is not None
    assert less.whole.fit.evidence + log(len(kinds)) > whole.fit.evidence, "the nominal parameter takes its place"
    search = Search(Proposer(own, own, {"turn": kinds}, {}), lambda _stage, _share: None)
    names = [one.effect.name for one in search.dropped(Pair(whole, whole), ()).whole.effects]
    assert names == [one.effect.name for one in whole.effects]


def test_what_two_effects_imitate_may_be_one_of_them(tmp_path: Path) -> None:
    """A cold machine as a higher level and a warming that is soon over. Without the level, the warming does not come back
    all the way from there, and is sought from all its starts. It is no alternative to the level: it is in the set anyway.
    """
    own = Machine(cold=1.5).bench(tmp_path)
    told: list[Effect] = [Coulomb(2.0 * COULOMB), Viscous(1.9 * VISCOUS), TemperatureDrift(3.0, 5.0)]
    told += [Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE)]
    begun = state_of(own, [placed(own.rows, "turn", one) for one in told], own.white, {})
    begun = coloured(settled_on(begun, steps=1), ())
    level = next(one for one in begun.effects if isinstance(one.effect, Coulomb))
    exchange = Exchange(Proposer(own, own, {"turn": [*KINDS, TemperatureDrift]}, {}), {}, lambda _stage, _share: None)
    family = exchange._family(Pair(begun, begun), level)
    assert family is not None
    again = {one.effect.effect.name: one for one in exchange._sought_again(Pair(begun, begun), family)}
    warming = again["temperature_drift"]
    assert warming.settled is not None
    assert warming.settled.reached > family.state.reached + 20.0
    names = [one.effect.name for one in warming.settled.effects]
    assert names.count("temperature_drift") == 1
    assert "coulomb" not in names
    assert "temperature_drift" not in {one.effect.effect.name for one in family.proposals}


def test_what_came_in_last_has_a_family_as_well(bench: Bench, proposer: Proposer, cogging: State) -> None:
    """Without one it would be certain, and nothing could be in its place."""
    wrong = cogging.of([*cogging.effects, placed(bench.rows, "turn", CoulombAsymmetry(0.1))])
    exchange = Exchange(proposer, {}, lambda _stage, _share: None)
    pair, families, changed = exchange.exchanged(Pair(wrong, wrong), ())
    assert changed
    named = [name_of(one) for one in pair.whole.effects]
    assert [name_of(one.chosen) for one in families if one.chosen is not None] != named
    whole = exchange.completed(pair)
    assert [name_of(one.chosen) for one in whole if one.chosen is not None] == named
    assert all(any(one.settled is not None for one in each.proposals) for each in whole)


def test_a_family_is_asked_for_again_beside_what_came_in_on_its_axis(bench: Bench, proposer: Proposer, cogging: State) -> None:
    exchange = Exchange(proposer, {}, lambda _stage, _share: None)
    pair, _, _ = exchange.exchanged(Pair(cogging, cogging), ())
    ahead = pair.whole.of([*pair.whole.effects, placed(bench.rows, "turn", CoulombAsymmetry(0.1))])
    for family in exchange.completed(Pair(ahead, ahead)):
        assert family.chosen is not None
        assert len(family.state.effects) == len(ahead.effects) - 1


@pytest.mark.parametrize(("nats", "asked"), [(0.3, False), (0.7, True)])
def test_a_family_is_asked_for_again_where_its_axis_has_moved(
    nats: float, asked: bool, proposer: Proposer, cogging: State, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By what a further step would have to bring, half a nat; of several effects of a kind, each has its own."""
    exchange = Exchange(proposer, {}, lambda _stage, _share: None)
    pair, families, _ = exchange.exchanged(Pair(cogging, cogging), ())
    (one,) = (each for each in pair.whole.effects if isinstance(each.effect, TorqueRipple))

    def larger(by: float) -> State:
        assert isinstance(one.effect, TorqueRipple)
        moved = replace(one, effect=replace(one.effect, amplitude=(1.0 + by) * one.effect.amplitude))
        return pair.whole.of([moved if each is one else each for each in pair.whole.effects])

    little = larger(1e-3)
    meant = little.moved_by(pair.whole.effects, little.effects)
    ahead = larger(1e-3 * float(np.sqrt(nats / meant)))  # nats go with the square of the way
    assert ahead.moved_by(pair.whole.effects, ahead.effects) == pytest.approx(nats, rel=0.05)
    seen: list[PlacedEffect] = []
    monkeypatch.setattr(Exchange, "_family", lambda _self, _pair, each: seen.append(each))
    found = exchange.completed(Pair(ahead, ahead))
    assert bool(seen) == asked
    assert len(found) == (0 if asked else len(families))


def test_what_nothing_sets_apart_is_listed_and_does_not_take_the_name(bench: Bench, cogging: State) -> None:
    """Only a level can be asked for; the curve that the friction truly has is better, and is listed only."""
    proposer = Proposer(bench, bench, {"turn": [Coulomb]}, {}, {"turn": [Stribeck]})
    level = cogging.of([*cogging.effects, placed(bench.rows, "turn", Coulomb(1.2 * COULOMB))])
    exchange = Exchange(proposer, {}, lambda _stage, _share: None)
    pair, families, changed = exchange.exchanged(Pair(level, level), ())
    assert not changed
    (family,) = [each for each in families if each.chosen is not None and each.chosen.effect.name == "coulomb"]
    assert [one.effect.effect.name for one in family.proposals if one.only_listed] == ["stribeck"]
    answer = weighed(family, Unexplained({"turn": 0.0}, {"turn": 0.0}), bench.settings)
    assert answer.indistinguishable == ("stribeck",)
    _, (told,) = preferred(pair.whole, [answer])
    assert told.chosen is not None
    assert told.chosen.effect.name == "coulomb"


def test_an_effect_of_a_set_is_weighed_also_if_it_would_push_beside_the_friction_that_a_step_leaves(tmp_path: Path) -> None:
    """An asymmetry at its bound, the model's slope. The true slope is 5 % less, and an asymmetry beyond it pushes."""
    slope = COLUMN_VISCOUS["turn"]
    made = strokes(1, 20.0, {"turn": lambda at: 0.9 * slope * np.abs(at.velocity) - 0.05 * slope * at.velocity})
    rows = compared(tmp_path, made)
    own = bench_of(rows, Settings(), {"turn": True, "lift": True})
    state = coloured(state_of(own, [placed(rows, "turn", ViscousAsymmetry(slope))], own.white, {}), ())
    proposer = Proposer(own, own, {"turn": [ViscousAsymmetry]}, {})
    (family,) = Exchange(proposer, {}, lambda *_: None).completed(Pair(state, state))
    assert [one.effect.effect.name for one in family.proposals] == ["viscous_asymmetry"]
    answer = weighed(family, Unexplained({"turn": 0.1, "lift": 0.1}, {"turn": 0.1, "lift": 0.1}), Settings())
    assert answer.believed


def on_a_soft_spring(at: Swing) -> Array:
    """What a link on a soft spring costs, all friction on its motor's side: a linear filter of the motor's motion."""
    link, spring = TURNING - MOTOR, SOFT
    moves = [spring.damping, spring.stiffness], [link, spring.damping, spring.stiffness]
    _, place, _ = lsim(moves, at.position - at.position[0], at.time - at.time[0])
    _, speed, _ = lsim(moves, at.velocity, at.time - at.time[0])
    twist, untwists = at.position - at.position[0] - place, at.velocity - speed
    return np.asarray(spring.stiffness * twist + spring.damping * untwists - link * at.acceleration)


def test_a_spring_that_was_found_elsewhere_is_sought_where_it_now_belongs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was known of it was found beside something that took its part: a stiff one, in another valley."""
    rows = compared(tmp_path, strokes(61, 12.0, {"turn": on_a_soft_spring}))
    bench = bench_of(rows, Settings(), dict.fromkeys(rows.axes, True))
    proposer = Proposer(bench, bench, {"turn": [Elasticity]}, {})
    state = state_of(bench, (), bench.white, {})
    stiff = placed(rows, "turn", STIFF)
    monkeypatch.setitem(proposer._best, ("turn", "elasticity"), STIFF)
    monkeypatch.setitem(proposer._tried, ("turn", "elasticity"), 1)
    found = proposer.instead(Pair(state, state), stiff)
    (effect,) = (one.effect.effect for one in found)
    assert isinstance(effect, Elasticity)
    assert effect.stiffness == pytest.approx(SOFT.stiffness, rel=0.1)


def test_a_parameter_that_is_fixed_now_and_was_elsewhere_is_another_effect(tmp_path: Path) -> None:
    """All friction behind a spring is a parameter less: no slope says how far away the share was."""
    rows = compared(tmp_path, strokes(61, 4.0, {"turn": on_a_soft_spring}))
    bench = bench_of(rows, Settings(), dict.fromkeys(rows.axes, True))
    shared, behind = (placed(rows, "turn", replace(SOFT, motor_friction_share=share)) for share in (0.9, 0.0))
    state = state_of(bench, [behind], bench.white, {})
    assert state.moved_by([behind], state.effects) == 0.0
    assert state.moved_by([shared], state.effects) == np.inf


def test_the_largest_effect_is_asked_for_first(bench: Bench, proposer: Proposer) -> None:
    """Of a set in which a small viscosity stands before a large cogging: what is wrong with the large one bends the small."""
    small, large = (placed(bench.rows, "turn", one) for one in (Viscous(0.02), TorqueRipple(COGGING, ORDER, PHASE)))
    found = state_of(bench, [small, large], bench.white, {})
    asked: list[str] = []
    Exchange(proposer, {}, lambda stage, _share: asked.append(stage)).exchanged(Pair(found, found), ())
    assert asked[0] == "what else than torque_ripple on turn"
