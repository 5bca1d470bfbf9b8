"""What a set no longer needs goes: two effects that undo each other, one that takes nothing; what closes the gap stays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, INERTIA, ORDER, PERIOD, PHASE, SLIDES, STICKS, VISCOUS, Machine

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.state import first_colours, state_of
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.recording.recording import Recording

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


@pytest.mark.parametrize("scale", [0.001, 0.7, 3.0])
def test_of_two_effects_of_one_torque_the_same_stays_in_every_unit(scale: float, tmp_path: Path) -> None:
    """On one way an offset is an asymmetry of friction: which of them goes is no matter of rounding."""
    assert one_way(1.0, tmp_path / "one") == one_way(scale, tmp_path / "other")


def one_way(scale: float, folder: Path) -> set[str]:
    folder.mkdir()
    machine = Machine(torque_scale=scale)
    path = folder / "model.xml"
    path.write_text(machine.model, encoding="utf-8")
    recordings = [_one_way(machine, seed) for seed in (3, 4)]
    ready = prepared(path, recordings[:1], recordings[1:], Settings())
    own = bench_of(ready.rows, Settings(), ready.absolute)
    return kept(own, CoulombAsymmetry(0.3 * scale), TorqueOffset(0.2 * scale))


def _one_way(machine: Machine, seed: int) -> Recording:
    whole = machine.recording(seed, 20.0, f"way{seed}")
    speed = 0.8 + 0.3 * np.sin(1.3 * whole.time + seed)
    position = np.cumsum(speed) * PERIOD
    acceleration = 0.39 * np.cos(1.3 * whole.time + seed)
    torque = machine.torque_scale * (INERTIA * acceleration + 1.5 * COULOMB + VISCOUS * speed)
    return replace(whole, columns={"turn": {"position": position, "torque": torque}})
