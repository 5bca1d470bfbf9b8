"""What a set no longer needs goes: two effects that undo each other, one that takes nothing; what closes the gap stays."""

from __future__ import annotations

import pytest
from plain_bench import COGGING, COULOMB, INERTIA, ORDER, PHASE, SLIDES, STICKS, VISCOUS, Machine

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.weigh.bench import Bench
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.state import first_colours, state_of
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous

TRUE = (Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE))
SCALED = 0.1
MORE = 1.0 + SCALED
UNDONE = (TorqueConstant(SCALED), Coulomb(MORE * COULOMB), Viscous(MORE * VISCOUS), Inertia(SCALED * INERTIA))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Machine().bench(tmp_path_factory.mktemp("plain"))


def kept(bench: Bench, *effects: Effect) -> set[str]:
    state = state_of(bench, [placed(bench.rows, "turn", one) for one in effects], first_colours(bench), {})
    return {one.effect.name for one in needed(state).effects}


@pytest.mark.parametrize("beside", [(CoulombAsymmetry(0.01),), UNDONE], ids=["takes nothing", "undo each other"])
def test_only_what_closes_the_gap_stays(bench: Bench, beside: tuple[Effect, ...]) -> None:
    assert kept(bench, *TRUE, *beside) == {"stribeck", "torque_ripple"}


def test_without_an_effect_there_is_nothing_to_leave_out(bench: Bench) -> None:
    assert kept(bench) == set()
