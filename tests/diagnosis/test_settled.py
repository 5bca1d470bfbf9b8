"""A set of effects moves to where it explains most: not to where a straight line promises as much."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, ORDER, PHASE, SLIDES, STICKS, Machine
from rig_bench import COULOMB as RIG_COULOMB
from rig_bench import compared, strokes

from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import moved
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.moves import Search
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.temperature_drift import TemperatureDrift
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.emulator.effects.viscous_nonlinear import ViscousNonlinear

RIPPLE = TorqueRipple(COGGING, ORDER, PHASE)
TRUE = Stribeck(COULOMB + STICKS, SLIDES, 2.0)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """A column with Stribeck friction and cogging, of which the model knows nothing."""
    return Machine().bench(tmp_path_factory.mktemp("plain"))


def state(bench: Bench, *effects: Effect) -> State:
    return state_of(bench, [placed(bench.rows, "turn", one) for one in effects], bench.white, {})


@pytest.mark.parametrize("static", [1.1, 2.5], ids=["less", "more"])
@pytest.mark.parametrize("speed", [0.3, 4.0], ids=["slower", "faster"])
def test_a_set_settles_at_the_truth_from_far_away(bench: Bench, static: float, speed: float) -> None:
    """Where it also settles from the truth; its level with the model's own level beside it, for both are free."""
    begun = state(bench, Stribeck(COULOMB + static * STICKS, speed * SLIDES, 1.0), RIPPLE)
    found, there = settled_on(begun, 30), settled_on(state(bench, TRUE, RIPPLE), 30)
    assert found.reached == pytest.approx(there.reached, abs=2.0)


@pytest.mark.parametrize("begun", [ViscousNonlinear(0.0, 0.1), ViscousNonlinear(1e-5, 0.1)], ids=["none", "hardly any"])
def test_a_power_of_the_speed_that_is_not_there_at_first_is_found(begun: ViscousNonlinear, tmp_path: Path) -> None:
    """Quadratic friction, from a start that is all cubic."""
    own = Machine(quadratic=0.3).bench(tmp_path)
    settled = settled_on(state(own, TRUE, begun, RIPPLE), 30).effects
    (found,) = (one.effect for one in settled if isinstance(one.effect, ViscousNonlinear))
    assert found.quadratic == pytest.approx(0.3, rel=0.1)


def test_what_a_straight_line_promises_is_not_reached_yet(bench: Bench) -> None:
    far, there = state(bench, Stribeck(COULOMB + 2.0 * STICKS, SLIDES, 2.0), RIPPLE), settled_on(state(bench, TRUE, RIPPLE))
    assert there.reached == pytest.approx(there.fit.evidence, abs=1.0)
    assert far.fit.evidence == pytest.approx(there.fit.evidence, abs=1.0), "level alone: a straight line"
    assert far.reached < there.reached - 30.0


def test_a_set_that_is_only_compared_is_not_asked_for_its_slopes(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def slopes(*_: object) -> None:
        raise AssertionError("slopes take most of the time")

    monkeypatch.setattr("drivetwin.diagnosis.weigh.bench.tangents", slopes)
    compared_only = state(bench, Stribeck(COULOMB + 1.37 * STICKS, SLIDES, 2.0), RIPPLE)
    assert np.isfinite(compared_only.reached)
    with pytest.raises(AssertionError, match="slopes"):
        _ = compared_only.fit


@pytest.mark.parametrize("later", [Presliding(2e4, 10.0), Backlash(0.002, 2e4, 10.0)], ids=["presliding", "backlash"])
def test_a_slope_of_friction_knows_what_bends_with_it(later: Effect, tmp_path: Path) -> None:
    """Against the difference of what two whole sets cost, the level of friction less and more on one way."""
    rows = compared(tmp_path, strokes(1, 20.0))
    own = bench_of(rows, Settings(), {"turn": True, "lift": True})
    asymmetry, step = 0.3, Settings().wide_step
    low, middle, high = (state(own, CoulombAsymmetry(asymmetry * (1.0 + change)), later) for change in (-step, 0.0, step))
    by_hand = (low.target["turn"] - high.target["turn"]) / (2.0 * step)
    slope = middle.columns[len(own.nominals)]["turn"]
    assert np.std(by_hand) > 0.0
    np.testing.assert_allclose(slope, by_hand, atol=1e-9 * float(np.abs(by_hand).max()))


@pytest.mark.parametrize(
    "later",
    [Presliding(2e4, 10.0), Backlash(0.002, 2e4, 10.0), TemperatureDrift(0.6, 12.0)],
    ids=["presliding", "backlash", "temperature_drift"],
)
def test_a_nominal_friction_that_is_off_gives_way_and_warms_as_the_set_has_it(later: Effect, tmp_path: Path) -> None:
    """Against the difference of what two whole sets cost, the level of friction as modelled and a standard deviation more."""
    own = bench_of(compared(tmp_path, strokes(1, 20.0)), Settings(), {"turn": True, "lift": True})
    number = next(k for k, one in enumerate(own.nominals) if (one.effect, one.axis) == ("coulomb", "turn"))
    spread = own.nominals[number].spread
    as_modelled, more = state(own, later), state(own, Coulomb(RIG_COULOMB["turn"] + spread), later)
    by_hand = (as_modelled.target["turn"] - more.target["turn"]) / spread
    column = as_modelled.columns[number]["turn"]
    np.testing.assert_allclose(column, by_hand, atol=1e-9 * float(np.abs(by_hand).max()))
    assert np.std(column - own.nominals[number].column["turn"]) > 0.01 * np.std(column), "in the model it sets in at once"


def test_a_stribeck_curve_does_not_rise(tmp_path: Path) -> None:
    """Friction that is lower at low speeds is another effect: by definition the curve falls from its static level."""
    level = RIG_COULOMB["turn"]
    lower = {"turn": lambda at: -0.6 * level * np.exp(-np.abs(at.velocity) / 0.3) * np.sign(at.velocity)}
    own = bench_of(compared(tmp_path, strokes(1, 20.0, lower)), Settings(), {"turn": True, "lift": True})
    (found,) = (one.effect for one in settled_on(state(own, Stribeck(1.2 * level, 0.3, 1.0))).effects)
    assert isinstance(found, Stribeck)
    assert found.static_torque >= level


def test_static_friction_is_not_sought_beyond_what_tears_an_axis_off(bench: Bench) -> None:
    """A fall at speeds that hardly occur fits any level: 15 kN on a table whose drive never gave more than 150 N."""
    motion = bench.rows.motion["turn"]
    seen = float(np.abs(motion.torque - motion.rigid_torque).max())
    _, most = TRUE.bounds(motion, bench.rows.simulation.dynamics(())["turn"])["static_torque"]
    assert seen < most <= 2.0 * seen


def test_a_set_does_not_settle_where_more_of_a_gap_is_left(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The unknown may make such a set as likely. Here every other one seems to leave more."""
    begun = state(bench, replace(TRUE, static_torque=0.8 * TRUE.static_torque))
    assert settled_on(begun).effects != begun.effects
    more = 2.0 * bench.settings.least_share
    monkeypatch.setattr(
        State, "left", property(lambda one: dict.fromkeys(bench.rows.axes, more * (one.effects != begun.effects)))
    )
    assert settled_on(begun).effects == begun.effects


@pytest.mark.parametrize("evaluations", [1, 2, 4])
def test_a_local_search_asks_for_no_slopes_after_its_last_evaluation(bench: Bench, evaluations: int) -> None:
    """Slopes are differences: each takes a prediction here and one a parameter, and a step has one."""
    none, far = state(bench), Stribeck(COULOMB + 3.0 * STICKS, 4.0 * SLIDES, 1.0)
    fields, asked = none.fields("turn", far), []

    def predict(effect: Effect) -> Column:
        asked.append(effect)
        return none.predictor("turn")(effect)

    found = moved(none.frugal, none.frugal_fit, far, fields, predict, frozenset(), evaluations)
    assert len(asked) <= 1 + evaluations + (evaluations - 1) * (1 + len(fields))
    assert (found == far) is (evaluations == 1)


def test_a_set_that_leaves_no_more_as_it_stands_is_not_asked_for_its_slopes(bench: Bench) -> None:
    none, some = state(bench), state(bench, TRUE)
    assert some.left_standing["turn"] < none.left["turn"]
    assert not some.leaves_more_than(none)
    assert "columns" not in some.__dict__
    assert none.leaves_more_than(some)
    assert some.left["turn"] <= some.left_standing["turn"]


def test_where_the_others_make_no_mechanism_without_what_was_added_that_stays(bench: Bench) -> None:
    """A friction that falls with the speed needs the viscous one: alone it would push."""
    before = state(bench, ViscousNonlinear(-0.05, 0.01))
    ahead = state(bench, Viscous(3.0), Coulomb(1.2 * COULOMB), ViscousNonlinear(-0.8, 0.1))
    search = Search(Proposer(bench, bench, {"turn": [Coulomb, Presliding]}, {}), lambda _stage, _share: None)
    assert search.with_yielding_friction(Pair(before, before), ahead, (), ["turn"]) is ahead


def test_an_axis_without_a_gap_may_be_left_with_what_a_model_misses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """1 % of its torque, as a share of the noise that is all it has; where there is a gap, 1 % of that."""
    rows = compared(tmp_path, strokes(1, 20.0))
    bench = bench_of(rows, Settings(), dict.fromkeys(rows.axes, True), frozenset({"lift"}))
    noise, misses = (float(np.sqrt(np.mean(one**2))) for one in (rows.target["lift"], 0.01 * rows.size["lift"]))
    may = (misses / noise) ** 2
    assert bench.tolerated("turn", 0.5) == 0.5 + bench.settings.least_share
    assert bench.tolerated("lift", 0.5) == pytest.approx(1.0 + may, rel=1e-6)
    before, after = state_of(bench, (), bench.white, {}), state_of(bench, (), bench.white, {})
    for more, worse in ((0.9 * may, False), (1.1 * may, True)):
        for left in ("left", "left_standing"):
            monkeypatch.setitem(after.__dict__, left, {**before.left, "lift": 1.0 + more})
        assert after.leaves_more_than(before) is worse
