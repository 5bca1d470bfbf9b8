"""What stands in the place of an effect is judged in the noise that it leaves: on torques of a formula."""

from __future__ import annotations

from dataclasses import replace

import pytest
from plain_bench import COGGING, COULOMB, ORDER, PHASE, Machine

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.diagnosis.weigh.bench import Bench
from drivetwin.diagnosis.weigh.colouring import coloured
from drivetwin.diagnosis.weigh.exchange import Exchange
from drivetwin.diagnosis.weigh.pair import Pair
from drivetwin.diagnosis.weigh.proposal import Family, Proposal
from drivetwin.diagnosis.weigh.proposer import Proposer
from drivetwin.diagnosis.weigh.state import State, first_colours, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import AxisEffect, Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous

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
    ripple = state_of(bench, [placed(bench.rows, "turn", TorqueRipple(COGGING, ORDER, PHASE))], first_colours(bench), {})
    return coloured(ripple, proposer.proposals(Pair(ripple, ripple)))


def proposed(proposer: Proposer, cogging: State, effect: Effect) -> Proposal:
    """An effect beside the cogging, moved to where it belongs in that noise."""
    found = proposer.evaluated(cogging, Begun("turn", effect, 0.0, 1))
    assert found is not None
    return replace(found, settled=settled_on(cogging.of([*cogging.effects, found.effect])))


def test_what_leaves_less_takes_the_place_of_what_the_noise_of_neither_prefers(proposer: Proposer, cogging: State) -> None:
    """An asymmetry explains nothing of a friction that is the same both ways; a level explains a part of it."""
    asymmetry, level = (proposed(proposer, cogging, one) for one in (CoulombAsymmetry(0.1), Coulomb(1.2 * COULOMB)))
    assert asymmetry.settled is not None
    assert level.settled is not None
    assert asymmetry.settled.reached > level.settled.reached + 100.0, "in the noise of neither"
    assert level.settled.left["turn"] < asymmetry.settled.left["turn"] - 0.02
    exchange = Exchange(proposer, {}, lambda _stage, _share: None)
    better = exchange._better(Family(asymmetry.effect, cogging, [asymmetry, level]), asymmetry.settled)
    assert better is not None
    assert [one.effect.name for one in better.effects] == ["coulomb", "torque_ripple"]
    assert exchange._better(Family(level.effect, cogging, [level, asymmetry]), level.settled) is None
