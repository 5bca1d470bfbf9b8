"""What a search proposes of an effect is worth what the best one is: on torques of the test's own formulas, in known noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import COULOMB, GEAR, RESOLUTION, TURNING, VISCOUS, Swing, ready, strokes

from drivetwin.diagnosis.diagnose import proposer_of
from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import Begun, Field, tangents
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh import moves
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.exchange import Exchange
from drivetwin.diagnosis.weigh.explained import colours_of
from drivetwin.diagnosis.weigh.moves import Search
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import Family, Found
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import reduced
from drivetwin.emulator.effects import AxisEffect, Effect, ModelEffect
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coupling import Coupling
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.emulator.effects.temperature_drift import TemperatureDrift
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous_asymmetry import ViscousAsymmetry

WAY = 5e-6
"""On which the carriage's friction gives way [m]: a reversal passes it within some samples."""
SOFT = 1200.0
"""Stiffness of bristles [N·m/rad] on which the column swings at 5 Hz."""
SLOW = 600.0
"""Time constant of a gear that warms [s], ten times as long as a recording."""
TEETH = 18


def ripple(at: Swing) -> Array:
    return 0.4 * np.sin(TEETH * GEAR * at.position + 0.4)


def warming(at: Swing) -> Array:
    return 0.5 * np.exp(-at.time / SLOW) * (COULOMB["turn"] * np.sign(at.velocity) + 0.8 * at.velocity)


def giving_way(at: Swing) -> Array:
    """Less friction after each reversal, by Dahl's law, 1968, exponent 1: F = F_c (1 - 2 exp(-|x - x_r| / way))."""
    turned = np.flatnonzero(np.diff(np.sign(at.velocity), prepend=0.0))
    since = at.position[np.maximum.accumulate(np.where(np.isin(np.arange(len(at.time)), turned), np.arange(len(at.time)), 0))]
    return -2.0 * COULOMB["lift"] * np.exp(-np.abs(at.position - since) / WAY) * np.sign(at.velocity)


def bristles(at: Swing) -> Array:
    """What friction on critically damped bristles differs by from one without: LuGre, Canudas de Wit et al., 1995, by Euler."""
    level, parts = COULOMB["turn"], 40
    damping, period = 2.0 * np.sqrt(SOFT * TURNING), float(at.time[1] - at.time[0]) / parts
    force, bent = np.empty(len(at.time)), 0.0
    for sample, speed in enumerate(at.velocity):
        for _ in range(parts):
            rate = speed - abs(speed) * SOFT * bent / level
            bent += rate * period
        force[sample] = SOFT * bent + damping * rate
    return force - level * np.sign(at.velocity)


@dataclass(frozen=True)
class Case:
    """A torque on an axis, and effects of the kind that is asked for, the best of which are as good as can be."""

    axis: str
    torque: Callable[[Swing], Array]
    known: tuple[AxisEffect, ...]
    noise: float
    """Of the torque, in quanta."""


CASES = (
    Case("lift", ripple, (TorqueRipple(0.4, float(TEETH), 0.4 + np.pi),), 40.0),
    Case("turn", warming, (TemperatureDrift(0.5, SLOW),), 15.0),
    Case("lift", giving_way, tuple(Presliding(1.6 * COULOMB["lift"] / way) for way in np.geomspace(0.5, 8.0, 12) * WAY), 0.3),
    Case(
        "turn",
        bristles,
        tuple(Presliding(each, 2.0 * np.sqrt(each * TURNING)) for each in SOFT * np.geomspace(0.4, 2.5, 12)),
        5.0,
    ),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: type(case.known[0]).name)
def test_a_proposal_is_worth_what_the_best_of_its_kind_is(case: Case, tmp_path: Path) -> None:
    more = {case.axis: case.torque}
    made = ready(tmp_path, *(strokes(seed, seconds, more, noise=case.noise) for seed, seconds in ((1, 60.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    kind = type(case.known[0])
    proposer = Proposer(bench, bench, {case.axis: [kind]}, {})
    rng = np.random.default_rng(3)
    noise = {axis: case.noise * RESOLUTION[axis] * rng.standard_normal(bench.rows.count(axis)) for axis in bench.rows.axes}
    alone = state_of(bench, (), colours_of(bench, noise), {})
    best = max(one.score for each in case.known if (one := proposer.evaluated(alone, Begun(case.axis, each, 0.0, 1))))
    assert best > 100.0
    (found,) = proposer.proposals(Pair(alone, alone))
    assert found.score > 0.9 * best


def test_a_wave_of_the_wrong_order_is_exchanged_for_one_of_the_right_order(tmp_path: Path) -> None:
    made = ready(tmp_path, *(strokes(seed, seconds, {"lift": ripple}) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    wrong = placed(bench.rows, "lift", TorqueRipple(0.1, float(TEETH + 2), 0.0))
    state = state_of(bench, (wrong,), bench.white, {})
    exchange = Exchange(Proposer(bench, bench, {"lift": [TorqueRipple]}, {}), {}, lambda _what, _share: None)
    pair, _, changed = exchange.exchanged(Pair(state, state), [])
    (found,) = pair.whole.effects
    assert changed
    assert isinstance(found.effect, TorqueRipple)
    assert found.effect.order == TEETH
    assert found.effect.amplitude == pytest.approx(0.4, rel=0.05)


def test_what_says_no_more_than_it_costs_is_taken_out(tmp_path: Path) -> None:
    made = ready(tmp_path, *(strokes(seed, seconds, {"lift": ripple}) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    true, needless = TorqueRipple(0.4, float(TEETH), 0.4 + np.pi), ViscousAsymmetry(0.01)
    state = state_of(bench, tuple(placed(bench.rows, "lift", one) for one in (true, needless)), bench.white, {})
    exchange = Exchange(Proposer(bench, bench, {"lift": [TorqueRipple, ViscousAsymmetry]}, {}), {}, lambda _what, _share: None)
    pair, (family,), changed = exchange.exchanged(Pair(state, state), [])
    assert changed
    assert [type(one.effect) for one in pair.whole.effects] == [TorqueRipple]
    assert family.chosen is not None
    assert isinstance(family.chosen.effect, TorqueRipple)


def test_an_axis_without_a_gap_is_asked_only_for_what_others_feel(tmp_path: Path) -> None:
    """And for nothing where no axis has one."""
    seeds = ((1, 20.0), (2, 4.0))
    made = ready(tmp_path, *(strokes(seed, seconds, {"turn": ripple}) for seed, seconds in seeds))
    kinds = proposer_of(made, Settings()).kinds
    assert TorqueRipple in kinds["turn"]
    assert Payload in kinds["lift"]
    assert all(issubclass(kind, ModelEffect) for kind in kinds["lift"])
    clean = ready(tmp_path, *(strokes(seed, seconds, {}) for seed, seconds in seeds))
    assert proposer_of(clean, Settings()).kinds == {"turn": [], "lift": []}


def test_where_no_more_is_left_than_a_calibrated_model_misses_nothing_further_is_asked(tmp_path: Path) -> None:
    """A wave of 0.4 N·m on the turn is a gap; that of a twelfth of it on the lift is below 1 % of its torque."""
    little = {"turn": ripple, "lift": lambda at: ripple(at) / 12.0}
    made = ready(tmp_path, *(strokes(seed, seconds, little) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    proposer = Proposer(bench, bench, {axis: [TorqueRipple] for axis in ("turn", "lift")}, {})
    empty = state_of(bench, (), bench.white, {})
    pair = Pair(empty, empty)
    assert empty.within_error == {"lift"}
    told = {(one.effect.axis, one.effect.effect.name) for one in proposer.further(pair, ["turn", "lift"])}
    assert ("turn", "torque_ripple") in told
    assert ("lift", "torque_ripple") not in told
    assert ("lift", "torque_ripple") in {(one.effect.axis, one.effect.effect.name) for one in proposer.proposals(pair)}


def test_an_axis_whose_rest_grows_beyond_the_error_is_asked_in_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an axis needs may change with what another one has: here the lift counts as explained only as long as nothing is."""
    waves = {"turn": ripple, "lift": ripple}
    made = ready(tmp_path, *(strokes(seed, seconds, waves) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    proposer = Proposer(bench, bench, {axis: [TorqueRipple] for axis in waves}, {})
    monkeypatch.setattr(State, "within_error", property(lambda one: frozenset() if one.effects else frozenset({"lift"})))
    found = Search(proposer, lambda _what, _share: None).run()
    assert {(one.axis, one.effect.name) for one in found.state.effects} == {(axis, "torque_ripple") for axis in waves}


def test_an_effect_is_not_refused_for_what_another_axis_leaves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All settle again in noise of another colour: here the lift seems to keep more with every effect of the turn."""
    made = ready(tmp_path, *(strokes(seed, seconds, {"turn": ripple}) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    proposer = Proposer(bench, bench, {"turn": [TorqueRipple], "lift": []}, {})
    left = property(lambda one: one.energy(one.patched) | {"lift": 0.1 * len(one.effects)})
    monkeypatch.setattr(State, "left", left)
    search = Search(proposer, lambda _what, _share: None)
    added, _ = search.added(empty_pair(bench))
    assert [(one.axis, one.effect.name) for one in added.whole.effects] == [("turn", "torque_ripple")]


def test_a_set_is_as_rare_as_what_it_has_settled_at(tmp_path: Path) -> None:
    """A wave that no whole number of teeth makes is 100,000 times rarer, which costs once; and its order is one more to fit."""
    made = ready(tmp_path, *(strokes(seed, seconds, {"lift": ripple}) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    whole, between = (
        state_of(bench, (placed(bench.rows, "lift", TorqueRipple(0.4, order, 0.4 + np.pi)),), bench.white, {})
        for order in (float(TEETH), TEETH + 1e-3)
    )
    assert between.standing.evidence == pytest.approx(whole.standing.evidence, abs=0.1)
    fitted = 0.5 * np.log(sum(own.colour.independent for own in whole.axes.values()))
    assert whole.reached - between.reached == pytest.approx(np.log(1e5) + fitted, abs=0.1)
    proposer = Proposer(bench, bench, {"lift": [TorqueRipple]}, {})
    rated = Exchange(proposer, {}, lambda _what, _share: None)._rated
    for state in (whole, between):
        one = proposer.evaluated(empty_pair(bench).whole, Begun("lift", state.effects[0].effect, 0.0, 1))
        assert one is not None
        assert rated(replace(one, settled=state)) == pytest.approx(proposer.rated(state))


def test_what_an_exchange_leaves_to_be_added_is_added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where it is the last one: here it takes the only effect out."""
    made = ready(tmp_path, *(strokes(seed, seconds, {"lift": ripple}) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    monkeypatch.setattr(moves, "EXCHANGES", 1)
    monkeypatch.setattr(Exchange, "exchanged", lambda _self, pair, _proposals: (pair.without(pair.whole.effects[0]), [], True))
    found = Search(Proposer(bench, bench, {"turn": [], "lift": [TorqueRipple]}, {}), lambda _what, _share: None).run()
    assert [one.effect.name for one in found.state.effects] == ["torque_ripple"]
    assert [family.chosen for family in found.families] == list(found.state.effects)


def test_what_could_be_added_is_asked_beside_all_that_was_found(tmp_path: Path) -> None:
    """What is given up of it still explains its part; it is no news itself, nor is what is named instead."""
    several = {"turn": lambda at: ripple(at) + 1.0, "lift": ripple}
    made = ready(tmp_path, *(strokes(seed, seconds, several) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    proposer = Proposer(bench, bench, {"turn": [TorqueRipple, TorqueOffset], "lift": [TorqueRipple]}, {})
    nothing = empty_pair(bench)
    turned, offset, lifted = proposer.proposals(nothing)
    whole = nothing.whole.of([lifted.effect])
    found = Found(whole, [Family(lifted.effect, nothing.whole, [lifted])], proposer.again([turned, offset, lifted], whole))
    beyond = found.beyond(nothing.whole.of([turned.effect]))
    assert beyond.state is whole
    assert [(one.effect.axis, type(one.effect.effect)) for one in beyond.proposals] == [("turn", TorqueOffset)]


def empty_pair(bench: Bench) -> Pair:
    state = state_of(bench, (), bench.white, {})
    return Pair(state, state)


def heavier(at: Swing) -> Array:
    return 0.3 * at.acceleration


def test_an_inertia_of_the_axis_before_is_no_coupling(tmp_path: Path) -> None:
    """A rotor of no inertia that turns 100 times with the axis before is that axis's inertia by another name."""
    made = ready(tmp_path, *(strokes(seed, seconds, {"turn": heavier}) for seed, seconds in ((1, 20.0), (2, 4.0))))
    bench = bench_of(made.rows, Settings(), made.absolute)
    proposer = Proposer(bench, bench, {"turn": [Inertia], "lift": [Coupling]}, {})
    empty = state_of(bench, (), bench.white, {})
    assert [one.effect.effect.name for one in proposer.proposals(Pair(empty, empty))] == ["inertia"]
    state = state_of(bench, (placed(bench.rows, "lift", Coupling(0.3e-4, 100.0)),), bench.white, {})
    pair, _, changed = Exchange(proposer, {}, lambda _what, _share: None).exchanged(Pair(state, state), [])
    assert changed
    assert pair.whole.effects == ()


def test_an_effect_is_not_to_blame_for_another_that_pushes(tmp_path: Path) -> None:
    """An asymmetry that is a little too large for a viscous friction lower than modelled; the wave is another matter."""

    def less(at: Swing) -> Array:
        return 0.8 * VISCOUS["turn"] * np.abs(at.velocity) - 0.1 * VISCOUS["turn"] * at.velocity - ripple(at)

    prepared = ready(tmp_path, strokes(1, 20.0, {"turn": less}))
    bench = bench_of(prepared.rows, Settings(), prepared.absolute)
    pushes = ViscousAsymmetry(0.97 * VISCOUS["turn"])
    alone, beside = (state_of(bench, each, bench.white, {}) for each in ([], [placed(prepared.rows, "turn", pushes)]))
    proposer = Proposer(bench, bench, {"turn": [TorqueRipple]}, {})
    assert proposer.evaluated(beside, Begun("turn", TorqueRipple(0.4, TEETH, 0.4), 0.0, 1)) is not None
    assert proposer.evaluated(alone, Begun("turn", pushes, 0.0, 1)) is None
    less_steep = ViscousAsymmetry(0.8 * VISCOUS["turn"])
    assert proposer.evaluated(alone, Begun("turn", less_steep, 0.0, 1)) is not None


def test_play_that_closes_is_a_spring() -> None:
    kinds: list[type[Effect]] = [Backlash, Elasticity, TorqueRipple]
    assert reduced(Backlash(0.0, 1e5, 30.0), kinds) == [Elasticity(1e5, 30.0)]
    assert reduced(Elasticity(1e5, 30.0), kinds) == []
    assert reduced(TorqueRipple(0.4, 18.0, 0.0), kinds) == []


def test_a_parameter_whose_bounds_leave_no_room_has_no_slope() -> None:
    def cost(effect: Effect) -> Column:
        assert isinstance(effect, Coulomb)
        return {"turn": np.full(3, effect.coulomb)}

    (slope,) = tangents(Coulomb(1.0), [Field("coulomb", 1.0, 1.0, 1.0, 0.1)], cost)
    np.testing.assert_array_equal(slope["turn"], np.zeros(3))
