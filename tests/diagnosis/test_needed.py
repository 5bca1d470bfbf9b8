"""What a set no longer needs goes: two effects that undo each other, one that takes nothing; what closes the gap stays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import carts_bench as carts
import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, INERTIA, ORDER, PERIOD, PHASE, SLIDES, STICKS, VISCOUS, Machine

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.needed import needed
from drivetwin.diagnosis.weigh.refit import CONVERGED, least_squares, left_by
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.coulomb_asymmetry import CoulombAsymmetry
from drivetwin.emulator.effects.coupling import Coupling
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.payload import Payload
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_constant import TorqueConstant
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.emulator.effects.viscous_nonlinear import ViscousNonlinear
from drivetwin.recording.recording import Recording, RecordingInfo

TRUE = (Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE))
SCALED = 0.1
MORE = 1.0 + SCALED
UNDONE = (TorqueConstant(SCALED), Coulomb(MORE * COULOMB), Viscous(MORE * VISCOUS), Inertia(SCALED * INERTIA))

STICKY = 600.0
"""Viscous friction of the upper cart that the model does not have [N·s/m]: beside its gap a load there is little."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Machine().bench(tmp_path_factory.mktemp("plain"))


def kept(bench: Bench, *effects: Effect) -> set[str]:
    state = state_of(bench, [placed(bench.rows, "turn", one) for one in effects], bench.white, {})
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


@pytest.mark.parametrize("seed", [3, 7, 8])
def test_no_set_leaves_more_than_one_that_is_part_of_it_and_what_takes_enough_stays(seed: int, tmp_path: Path) -> None:
    """Viscous friction that stands beside a nonlinear one is told badly: a step that clips each for itself stalls."""
    own = bench_of_seed(seed, tmp_path)
    effects = (Viscous(1.0), ViscousNonlinear(-0.3, 0.1), Coulomb(1.2 * COULOMB), TRUE[1])
    state = settled_on(state_of(own, [placed(own.rows, "turn", one) for one in effects], own.white, {}), 20)
    whole = least_squares(state, (), CONVERGED)
    left = left_by(whole, ())
    for one in whole.effects:
        rest = least_squares(whole.of([each for each in whole.effects if each is not one]), (), CONVERGED)
        assert left_by(rest, ()) > left - 1e-4, one.effect.name
    assert {one.effect.name for one in needed(state).effects} == {"viscous", "viscous_nonlinear", "coulomb", "torque_ripple"}


def bench_of_seed(seed: int, folder: Path) -> Bench:
    path = folder / "model.xml"
    path.write_text(Machine().model, encoding="utf-8")
    one, other = (Machine().recording(each, 12.0, f"seed{each}") for each in (seed, seed + 50))
    ready = prepared(path, [one], [other], Settings())
    return bench_of(ready.rows, Settings(), ready.absolute)


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


def test_a_load_stays_on_the_axis_that_carries_it_in_whichever_order_the_axes_come(tmp_path: Path) -> None:
    """A payload is felt by the axes before its own as well: what explains both is not taken for what explains one."""
    for number, names in enumerate((("lower", "upper"), ("upper", "lower"))):
        own = loaded(names, 0.3, tmp_path / str(number))
        effects = [placed(own.rows, axis, Payload(0.15)) for axis in names]
        effects.append(placed(own.rows, "upper", Viscous(carts.VISCOUS + STICKY)))
        state = state_of(own, effects, own.white, {})
        assert {(one.effect.name, one.axis) for one in needed(state).effects} == {("payload", "lower"), ("viscous", "upper")}


def test_what_three_effects_of_two_axes_explain_and_one_does_stays_as_one(tmp_path: Path) -> None:
    """A coupling that is off, and an inertia on either axis that makes up for it: the others have to move where one goes."""
    inertia, ratio = 1.0, -0.5
    own = loaded(("lower", "upper"), 0.0, tmp_path / "coupled", inertia, ratio)
    off = Coupling(1.45 * inertia, ratio / 1.45)
    beside = {"upper": inertia - off.inertia, "lower": inertia * ratio**2 - off.inertia * off.ratio**2}
    effects = [placed(own.rows, "upper", one) for one in (off, Viscous(carts.VISCOUS + STICKY))]
    effects += [placed(own.rows, axis, Inertia(difference)) for axis, difference in beside.items()]
    left = needed(state_of(own, effects, own.white, {})).effects
    assert {(one.effect.name, one.axis) for one in left} == {("coupling", "upper"), ("viscous", "upper")}
    (coupling,) = (one.effect for one in left if isinstance(one.effect, Coupling))
    assert coupling.inertia == pytest.approx(inertia, rel=0.02)
    assert coupling.ratio == pytest.approx(ratio, rel=0.02)


def loaded(names: tuple[str, ...], load: float, folder: Path, inertia: float = 0.0, ratio: float = 0.0) -> Bench:
    """One cart on another, the lower with a load [kg] that the model does not have, and a coupling of an inertia [kg]."""
    folder.mkdir()
    path = folder / "model.xml"
    path.write_text(carts.MODEL, encoding="utf-8")
    lower = carts.waves((0.25, 0.5, 0.0), (0.02, 1.9, 1.0))
    upper = 0.5 * carts.waves((0.02, 0.6, 0.5), (0.002, 2.3, 0.0))
    of_lower, of_upper = (carts.slope(carts.slope(each)) for each in (lower, upper))
    shared = carts.UPPER * (of_lower + of_upper)
    couples = inertia * (of_upper + ratio * of_lower)
    torque = {
        "lower": (carts.LOWER + load) * of_lower + shared + ratio * couples,
        "upper": couples + shared + carts.MOTOR * of_upper + (carts.VISCOUS + STICKY) * carts.slope(upper),
    }
    noise, gears = np.random.default_rng(0), {"lower": 1.0, "upper": carts.GEAR}
    torque = {axis: rows + 0.02 * noise.standard_normal(len(rows)) for axis, rows in torque.items()}
    position = {"lower": lower, "upper": upper}
    sensors = {"torque_resolution": 1e-3, "position_resolution": 1e-8}
    known = {axis: {"joint": axis, "gear_ratio": gears[axis], **sensors} for axis in names}
    info = RecordingInfo.model_validate(
        {"schema": "recording/1", "machine": "carts", "sample_period": carts.PERIOD, "axes": known}
    )
    columns = {axis: {"position": position[axis], "torque": torque[axis]} for axis in names}
    one, other = (Recording(name, info, carts.TIME, columns) for name in ("one", "other"))
    ready = prepared(path, [one], [other], Settings(cutoff_hz=carts.CUTOFF))
    return bench_of(ready.rows, Settings(), ready.absolute)
