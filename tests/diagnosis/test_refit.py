"""The intervals of what goes into the patch: narrow on a right model, honest on one of another form than the machine."""

from __future__ import annotations

import pytest
from plain_bench import COGGING, COULOMB, ORDER, PHASE, SLIDES, STICKS, Machine

from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.result import TWO_SIDED_90
from drivetwin.diagnosis.weigh.bench import Bench
from drivetwin.diagnosis.weigh.refit import Refitted, refitted
from drivetwin.diagnosis.weigh.state import first_colours, state_of
from drivetwin.diagnosis.weigh.yielding import settled_on
from drivetwin.emulator.effects import Effect
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.stribeck import Stribeck
from drivetwin.emulator.effects.torque_ripple import TorqueRipple


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Machine().bench(tmp_path_factory.mktemp("plain"))


def fitted(bench: Bench, *effects: Effect) -> Refitted:
    """A set, its likeliest parameters, and what the patch gets of it."""
    state = state_of(bench, [placed(bench.rows, "turn", one) for one in effects], first_colours(bench), {})
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
    state = settled_on(state_of(bench, [placed(bench.rows, "turn", Coulomb(COULOMB))], first_colours(bench), {}), 20)
    found = refitted(state, ())
    (likeliest,), (least,), (told,) = state.effects, found.effects, found.deviations
    right = fitted(bench, Coulomb(COULOMB), Stribeck(COULOMB + STICKS, SLIDES, 2.0), TorqueRipple(COGGING, ORDER, PHASE))
    scatter = next(each for one, each in zip(right.effects, right.deviations, strict=True) if one.effect.name == "coulomb")
    assert isinstance(least.effect, Coulomb)
    assert isinstance(likeliest.effect, Coulomb)
    assert told["coulomb"] >= abs(least.effect.coulomb - likeliest.effect.coulomb)
    assert told["coulomb"] > 3.0 * scatter["coulomb"]
