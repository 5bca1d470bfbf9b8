"""The intervals of what goes into the patch: narrow on a right model, honest on one of another form than the machine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plain_bench import COGGING, COULOMB, GEAR, INERTIA, ORDER, PERIOD, PHASE, SLIDES, STICKS, VISCOUS, Machine

from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.result import TWO_SIDED_90
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import Bench, bench_of
from drivetwin.diagnosis.weigh.refit import Refitted, refitted
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.recording.recording import Recording


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Machine().bench(tmp_path_factory.mktemp("plain"))


def fitted(bench: Bench, *effects: Effect) -> Refitted:
    """A set, its likeliest parameters, and what the patch gets of it."""
    state = state_of(bench, [placed(bench.rows, "turn", one) for one in effects], bench.white, {})
    return refitted(settled_on(state, 20), ())


def test_of_a_right_model_the_intervals_hold_the_truth_and_are_narrow(bench: Bench) -> None:
    found = fitted(bench, Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE))
    told = dict(zip((one.effect.name for one in found.effects), found.deviations, strict=True))
    values = {one.effect.name: one.effect for one in found.effects}
    for name, field, true in (
        ("stribeck", "static_torque", COULOMB + STICKS),
        ("stribeck", "stribeck_velocity", SLIDES),
        ("torque_ripple", "amplitude", COGGING),
    ):
        half = TWO_SIDED_90 * told[name][field]
        assert abs(getattr(values[name], field) - true) <= 1.5 * half, field
        assert half < 0.05 * true, field


def test_of_another_form_than_the_machine_the_interval_is_as_wide_as_two_ways_to_fit_differ(bench: Bench) -> None:
    """Stribeck's level is not in the set: least squares takes part of it for Coulomb friction, likelihood less."""
    state = settled_on(state_of(bench, [placed(bench.rows, "turn", Coulomb(COULOMB))], bench.white, {}), 20)
    found = refitted(state, ())
    (likeliest,), (least,), (told,) = state.effects, found.effects, found.deviations
    right = fitted(bench, Coulomb(COULOMB), Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE))
    scatter = next(each for one, each in zip(right.effects, right.deviations, strict=True) if one.effect.name == "coulomb")
    assert isinstance(least.effect, Coulomb)
    assert isinstance(likeliest.effect, Coulomb)
    assert told["coulomb"] >= abs(least.effect.coulomb - likeliest.effect.coulomb)
    assert told["coulomb"] > 3.0 * scatter["coulomb"]


def test_where_a_torque_comes_early_the_patch_is_fitted_to_it_as_it_was_recorded(tmp_path: Path) -> None:
    """No recording is read later. So the phase of the cogging is that at which it then leaves least, by a search."""
    path = tmp_path / "model.xml"
    path.write_text(Machine().model, encoding="utf-8")
    ready = prepared(path, [_early(1, 30.0)], [_early(2, 20.0)], Settings())
    bench = bench_of(ready.rows, Settings(), ready.absolute)
    found = fitted(bench, TorqueRipple(COGGING, ORDER, PHASE))
    (ripple,) = found.effects
    assert isinstance(ripple.effect, TorqueRipple)
    assert found.state.late == {}

    def left(phase: float) -> float:
        cogging = placed(bench.rows, "turn", TorqueRipple(COGGING, ORDER, phase))
        return float(np.sum(found.state.of([cogging]).target["turn"] ** 2))

    phases = PHASE + np.linspace(-0.15, 0.15, 301)
    best = phases[int(np.argmin([left(float(phase)) for phase in phases]))]
    assert abs(best - PHASE) > 0.05, "a sample is more than 0.05 rad at this speed"
    assert ripple.effect.phase == pytest.approx(best, abs=0.003)


def _early(seed: int, seconds: float) -> Recording:
    """One way, shaken more and less; the torque is recorded a sample before the position that goes with it."""
    whole = Machine().recording(seed, seconds, f"early{seed}")
    waves = ORDER * GEAR * 0.8 * (whole.time + seed)
    shaken = 0.1 * (1.0 + 0.5 * np.sin(0.9 * whole.time)) * np.sin(waves + 1.0)
    position = (waves + shaken) / (ORDER * GEAR)
    velocity, acceleration = (np.gradient(position, PERIOD), np.gradient(np.gradient(position, PERIOD), PERIOD))
    cogging = COGGING * np.sin(ORDER * GEAR * position + PHASE)
    torque = INERTIA * acceleration + COULOMB + VISCOUS * velocity - cogging
    columns = {"turn": {"position": position[2:-3], "torque": torque[3:-2]}}
    return replace(whole, time=whole.time[2:-3], columns=columns)
