"""What is named has to be worth its cost beside nominal parameters that are off by as much as usual: torques of a formula."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from rig_bench import CARRIAGE, COULOMB, GRAVITY, Torques, ready, strokes, turn_torque

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Unexplained, weighed
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.named import named
from drivetwin.diagnosis.weigh.off import _better, heavier
from drivetwin.diagnosis.weigh.proposal import Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, first_colours, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import AxisEffect, Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.viscous import Viscous

KINDS: tuple[type[AxisEffect], ...] = (Coulomb, CoulombAsymmetry, Inertia, TorqueConstant, TorqueOffset, Viscous)
SECONDS = 12.0
NONE = {"turn": 0.0, "lift": 0.0}
WEIGHT = CARRIAGE * GRAVITY


def machine(folder: Path, more: Torques) -> Bench:
    prepared = ready(folder, strokes(1, SECONDS, more))
    return bench_of(prepared.rows, Settings(), prepared.absolute)


def proposer_of(bench: Bench) -> Proposer:
    return Proposer(bench, bench, {"turn": KINDS, "lift": KINDS}, {})


def state_with(bench: Bench, axis: str, *effects: Effect) -> State:
    return settled_on(state_of(bench, [placed(bench.rows, axis, one) for one in effects], first_colours(bench), {}))


def names_of(bench: Bench, axis: str, *effects: Effect) -> tuple[set[str], set[int]]:
    """The effects that are named of a set, and the bodies that are heavier."""
    weigh = partial(weighed, unexplained=Unexplained(NONE, NONE), settings=Settings())
    state, _ = named(state_with(bench, axis, *effects), [], proposer_of(bench), weigh)
    return {one.effect.name for one in state.effects}, set(heavier(state))


@pytest.mark.parametrize(("share", "stays"), [(0.03, False), (0.3, True)])
def test_a_weight_that_is_off_by_as_much_as_usual_is_no_offset(tmp_path: Path, share: float, stays: bool) -> None:
    """A carriage that is heavier and a motor that is lighter by as much cost a constant force."""
    offset = share * WEIGHT
    bench = machine(tmp_path, {"lift": lambda at: offset + 0.0 * at.time})
    found, bodies = names_of(bench, "lift", TorqueOffset(-offset))
    assert ("torque_offset" in found) == stays
    assert bool(bodies) != stays


def inertia_of(bench: Bench, axis: str) -> int:
    """Number of the motor's inertia among the nominal parameters."""
    return next(k for k, one in enumerate(bench.nominals) if (one.effect, one.axis) == ("inertia", axis))


def rival(proposer: Proposer, exact: State, promises: Callable[[Proposal], float]) -> Proposal:
    """A torque constant instead of an inertia that is off, with the score that a straight line promises."""
    found = proposer.evaluated(exact, Begun("turn", TorqueConstant(0.01), 0.0, 1))
    assert found is not None
    return replace(found, score=promises(found))


def instead(bench: Bench, promises: Callable[[Proposal], float]) -> Proposal | None:
    proposer, number = proposer_of(bench), inertia_of(bench, "turn")
    state = state_with(bench, "turn")
    exact = state.holding(number)
    return _better(state, number, 0.0, exact, [rival(proposer, exact, promises)])


def test_what_only_promises_more_does_not_take_the_place_of_an_inertia(tmp_path: Path) -> None:
    bench = machine(tmp_path, {"turn": lambda at: 0.1 * at.acceleration})
    assert instead(bench, lambda _: 1e6) is None


def test_what_moved_several_parameters_takes_the_place_of_one(tmp_path: Path) -> None:
    """A torque constant of 15 %, whatever a straight line makes of it."""
    bench = machine(tmp_path, {"turn": lambda at: 0.15 * turn_torque(at)})
    found = instead(bench, lambda _: -1e6)
    assert found is not None
    assert found.effect.effect.name == "torque_constant"


def test_the_machine_has_the_friction_that_its_model_has(tmp_path: Path) -> None:
    """Beside nothing that is off, nothing is named."""
    bench = machine(tmp_path, {})
    assert names_of(bench, "turn", Coulomb(COULOMB["turn"])) == (set(), set())
