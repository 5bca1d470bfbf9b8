"""What is named has to be worth its cost beside nominal parameters that are off by as much as usual: torques of a formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import exp
from pathlib import Path

import numpy as np
import plain_bench as plain
import pytest
from plain_bench import Machine
from rig_bench import (
    ARM,
    CARRIAGE,
    GRAVITY,
    LIFT_MOTOR,
    PERIOD,
    TURNING,
    Swing,
    Torques,
    as_modelled,
    moved,
    ready,
    recording,
    strokes,
    turn_torque,
)

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Answer, Unexplained, weighed
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.named import _too_dear, named
from drivetwin.diagnosis.weigh.off import corrected, heavier, is_off
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import AxisEffect, Effect, PlacedEffect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.spring import Spring
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.viscous import Viscous

KINDS: tuple[type[AxisEffect], ...] = (Coulomb, CoulombAsymmetry, Inertia, TorqueConstant, TorqueOffset, Viscous)
SECONDS = 12.0
NONE = {"turn": 0.0, "lift": 0.0}
WEIGH = partial(weighed, unexplained=Unexplained(NONE, NONE), settings=Settings())
"""All that is left is noise."""


def machine(folder: Path, more: Torques) -> Bench:
    prepared = ready(folder, strokes(1, SECONDS, more))
    return bench_of(prepared.rows, Settings(), prepared.absolute)


def heavier_by(mass: float) -> Torques:
    """What a heavier carriage costs both axes."""
    return {"turn": lambda at: mass * ARM**2 * at.acceleration, "lift": lambda at: mass * (GRAVITY + at.acceleration)}


def proposer_of(bench: Bench) -> Proposer:
    return Proposer(bench, bench, {"turn": KINDS, "lift": KINDS}, {})


def state_with(bench: Bench, axis: str, *effects: Effect) -> State:
    """In the noise that it leaves."""
    state = state_of(bench, [placed(bench.rows, axis, one) for one in effects], bench.white, {})
    return settled_on(coloured(state, ()))


def names_of(bench: Bench, axis: str, *effects: Effect) -> tuple[set[str], set[int]]:
    """The effects that are named of a set, and the bodies that are heavier."""
    state, _ = named(state_with(bench, axis, *effects), [], proposer_of(bench), WEIGH)
    return {one.effect.name for one in state.effects}, set(heavier(state))


def test_a_carriage_that_is_a_little_heavier_is_no_offset(tmp_path: Path) -> None:
    more = 0.03 * CARRIAGE
    bench = machine(tmp_path, heavier_by(more))
    found, bodies = names_of(bench, "lift", TorqueOffset(-more * GRAVITY))
    assert not found
    assert bodies


def test_however_many_nats_an_effect_is_worth_it_says_nothing_where_nominal_parameters_close_as_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred nats in favour of each name: real friction is of another form, and each row counts."""
    monkeypatch.setattr(Proposer, "tried", lambda _self, _axis: exp(-100.0))
    more, force = 0.03 * CARRIAGE, 0.3 * CARRIAGE * GRAVITY
    heavier, loaded = machine(tmp_path, heavier_by(more)), machine(tmp_path, {"lift": lambda at: force + 0.0 * at.time})
    gone = _too_dear(state_with(heavier, "lift", TorqueOffset(-more * GRAVITY)), [], proposer_of(heavier))
    assert gone is not None
    assert not gone[1].effects
    assert _too_dear(state_with(loaded, "lift", TorqueOffset(-force)), [], proposer_of(loaded)) is None


def test_a_force_of_a_third_of_the_weight_is_one(tmp_path: Path) -> None:
    force = 0.3 * CARRIAGE * GRAVITY
    bench = machine(tmp_path, {"lift": lambda at: force + 0.0 * at.time})
    assert names_of(bench, "lift", TorqueOffset(-force)) == ({"torque_offset"}, set())


@pytest.mark.parametrize("share", [0.09, 0.11])
def test_what_is_given_up_and_comes_back_ends_the_search(tmp_path: Path, share: float) -> None:
    """A torque constant costs about as much as the inertia and the friction that it moves."""
    bench = machine(tmp_path, {"turn": lambda at: share * turn_torque(at)})
    found, _ = names_of(bench, "turn")
    assert found in ({"torque_constant"}, {"coulomb", "viscous", "inertia"})


def test_what_a_patch_does_not_hold_is_not_corrected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a straight line promises of nominal parameters that move far, a patch with them need not hold."""
    force = 0.3 * CARRIAGE * GRAVITY
    bench = machine(tmp_path, {"lift": lambda at: force + 0.0 * at.time})
    moved = placed(bench.rows, "turn", Inertia(0.5))

    def promised(state: State, *_: object) -> tuple[State, list[Answer]]:
        return state.of([*state.effects, moved]), [Answer(moved, 1.0, True, ())]

    def left(state: State) -> dict[str, float]:
        return {"turn": 0.4 if moved in state.effects else 0.0, "lift": 0.0}

    monkeypatch.setattr("drivetwin.diagnosis.weigh.named.corrected", promised)
    monkeypatch.setattr("drivetwin.diagnosis.weigh.named._left", left)
    monkeypatch.setattr("drivetwin.diagnosis.weigh.named.needed", lambda state: state)
    begun = state_with(bench, "lift", TorqueOffset(-force))
    state, _ = named(begun, [], proposer_of(bench), WEIGH)
    assert [one.effect.name for one in state.effects] == ["torque_offset"]


def test_what_a_name_explains_is_not_given_up_for_three(tmp_path: Path) -> None:
    bench = machine(tmp_path, {"turn": lambda at: 0.05 * turn_torque(at)})
    assert names_of(bench, "turn", TorqueConstant(-0.05))[0] == {"torque_constant"}


def test_a_carriage_that_is_heavier_is_a_payload(tmp_path: Path) -> None:
    more = 0.15 * CARRIAGE
    bench = machine(tmp_path, heavier_by(more))
    proposer = Proposer(bench, bench, {"turn": [*KINDS, Payload], "lift": [*KINDS, Payload]}, {})
    state, _ = corrected(state_with(bench, "lift"), proposer, WEIGH)
    (found,) = state.effects
    assert isinstance(found.effect, Payload)
    assert found.effect.mass == pytest.approx(more, rel=0.02)


def test_what_is_not_believed_does_not_move_the_others(tmp_path: Path) -> None:
    """They would make up for it, and may be no mechanism without it: then it could not go any more."""
    bench = machine(tmp_path, {"turn": lambda at: 2.0 * plain.VISCOUS * at.velocity})
    begun = state_with(bench, "turn")
    assert {one.effect.name for one in corrected(begun, proposer_of(bench), WEIGH)[0].effects} == {"viscous"}
    state, (answer, *_) = corrected(begun, proposer_of(bench), lambda family: Answer(family.chosen, 0.4, True, ()))
    assert not state.effects
    assert answer.chosen is not None
    assert answer.chosen.effect.name == "viscous"


def test_what_is_given_up_may_still_be_what_is_named_instead(tmp_path: Path) -> None:
    """A force along the lift is given up and a heavier carriage named: the answer says that it may be the force."""
    force = 0.15 * CARRIAGE * GRAVITY
    bench = machine(tmp_path, {"lift": lambda at: force + 0.0 * at.time})
    proposer = Proposer(bench, bench, {"turn": [*KINDS, Payload], "lift": [*KINDS, Payload]}, {})
    given_up = {(one, "lift") for one in ("torque_offset", "coulomb_asymmetry")}
    state, (answer, *_) = corrected(state_with(bench, "lift"), proposer, WEIGH, given_up)
    assert not {(one.effect.name, one.axis) for one in state.effects} & given_up
    assert answer.chosen is not None
    assert answer.chosen.effect.name == "payload"
    assert "torque_offset" in answer.indistinguishable


def test_an_effect_is_not_given_up_for_another_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A force along the lift that is called an asymmetric friction: given up for a heavier carriage, it would be an offset."""
    force = 0.15 * CARRIAGE * GRAVITY
    bench = machine(tmp_path, {"lift": lambda at: force + 0.0 * at.time})

    def any_of(state: State, kept: Sequence[PlacedEffect], _proposer: Proposer) -> tuple[PlacedEffect, State] | None:
        one = next((each for each in state.effects if each not in kept), None)
        return None if one is None else (one, settled_on(state.of([each for each in state.effects if each is not one])))

    monkeypatch.setattr("drivetwin.diagnosis.weigh.named._too_dear", any_of)
    proposer = Proposer(bench, bench, {"turn": [*KINDS, Payload], "lift": [*KINDS, Payload]}, {})
    state, _ = named(state_with(bench, "lift", CoulombAsymmetry(-force)), [], proposer, WEIGH)
    assert [one.effect.name for one in state.effects] == ["coulomb_asymmetry"]


def test_a_friction_of_which_the_model_says_nothing_is_named_and_stays(tmp_path: Path) -> None:
    """Given up, it is a nominal parameter that is off, and comes back as that."""
    bench = Machine(friction=False).bench(tmp_path, seconds=15.0)
    proposer = Proposer(bench, bench, {"turn": KINDS}, {})
    effects = [placed(bench.rows, "turn", one) for one in (Coulomb(plain.COULOMB), Viscous(plain.VISCOUS))]
    state, _ = named(settled_on(state_of(bench, effects, bench.white, {})), [], proposer, WEIGH)
    assert {one.effect.name for one in state.effects} >= {"coulomb"}


def chirping() -> Swing:
    """Swings of the column whose frequency changes by a few per cent: in them a spring is nearly an inertia."""
    time = np.arange(round(2.0 * SECONDS / PERIOD), dtype=np.float64) * PERIOD
    rate = 2.0 * np.pi * (1.0 + 0.06 * np.sin(2.0 * np.pi * time / (2.0 * SECONDS)))
    angle, change = np.cumsum(rate) * PERIOD, np.gradient(rate, PERIOD)
    position, velocity = 0.5 * np.sin(angle), 0.5 * rate * np.cos(angle)
    return Swing(time, position, velocity, 0.5 * (change * np.cos(angle) - rate**2 * np.sin(angle)))


def test_an_inertia_that_a_spring_of_the_set_could_imitate_is_off_all_the_same(tmp_path: Path) -> None:
    """Moved, the spring would take the place of the inertia here, and in no other motion."""
    at = chirping()
    lift = moved(1, 2.0 * SECONDS)["lift"]
    torques = as_modelled({"turn": at, "lift": lift})
    torques["turn"] = torques["turn"] + 0.1 * TURNING * at.acceleration + 20.0 * at.position
    made = ready(tmp_path, recording(torques, {"turn": at.position, "lift": lift.position}, noise=1.0))
    bench = bench_of(made.rows, Settings(), made.absolute)
    state = settled_on(coloured(state_with(bench, "turn", Spring(20.0, 0.0)), ()))
    number = next(k for k, one in enumerate(bench.nominals) if (one.effect, one.axis) == ("inertia", "turn"))
    held = state.energy(state.patched)["turn"]
    assert held - state.energy(state.patched - {number})["turn"] < Settings().least_share, "with the spring free"
    assert is_off(state, number)


def test_no_rotor_is_off_by_more_than_it_has(tmp_path: Path) -> None:
    bench = machine(tmp_path, {})
    inertia = next(one for one in bench.nominals if (one.effect, one.axis) == ("inertia", "lift"))
    assert inertia.off_by(-1.1 * LIFT_MOTOR, 0.2 * LIFT_MOTOR) == Inertia(-0.95 * LIFT_MOTOR)
    assert inertia.off_by(-1.1 * LIFT_MOTOR, 0.05 * LIFT_MOTOR) is None, "it is the link's, or something else"
    assert replace(inertia, rotor=0.0).off_by(-0.1, 1.0) is None
    assert inertia.off_by(-0.5 * LIFT_MOTOR) == Inertia(-0.5 * LIFT_MOTOR)
